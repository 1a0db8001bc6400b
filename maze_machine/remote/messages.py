"""What is said about a running machine over the network, as JSON: ``docs/reference/link.md`` lists it key by key."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from hsm import Machine
from hsm.model.chart import StateKind
from hsm.model.unparse import activity_text, trigger_text
from maze_machine.drive.loop import Tick
from maze_machine.drive.trace import trace_line
from transport.wording import in_words, printable

LONGEST = 4096
"""A longer question is refused unread, bytes."""


class _Question(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore", strict=True)


class SendEvent(_Question):
    """An event for the next tick, with what it carries: ``floor(number = 3)``."""

    kind: Literal["event"] = "event"
    name: Annotated[str, Field(min_length=1, max_length=1000)]


class Pause(_Question):
    """Stand still after this tick; only where time is simulated in the machine's own process."""

    kind: Literal["pause"] = "pause"


class Resume(_Question):
    """Go on."""

    kind: Literal["resume"] = "resume"


class Advance(_Question):
    """Go on for some ticks, and stand still again."""

    kind: Literal["advance"] = "advance"
    ticks: Annotated[int, Field(ge=1, le=1_000_000)] = 1


class End(_Question):
    """End the run; the robot is stopped."""

    kind: Literal["end"] = "end"


Operation = SendEvent | Pause | Resume | Advance | End
_OPERATIONS: TypeAdapter[Operation] = TypeAdapter(Annotated[Operation, Field(discriminator="kind")])


class Answer(BaseModel):
    """What became of an operation."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    done: bool
    reason: Annotated[str, Field(max_length=1000)] = ""


class OperationError(Exception):
    """A question that is no operation; the message says why."""


def read_operation(payload: bytes) -> Operation:
    """The operation in a question.

    Raises:
        OperationError: it is none.
    """
    if len(payload) > LONGEST:
        raise OperationError(f"a question has at most {LONGEST} bytes")
    try:
        return _OPERATIONS.validate_json(payload)
    except ValidationError as error:
        raise OperationError(in_words(error.errors()[0])) from None


def tick_json(machine: Machine, tick: Tick) -> dict[str, Any]:
    """What is published of a tick: its trace line, what each active state does, and the variables."""
    states = machine.model.states
    active = (states[machine.indices[name]] for name in tick.configuration)
    doing = {state.name: activity_text(state.activity) for state in active if state.activity is not None}
    return {**trace_line(machine, tick), "doing": doing, "variables": dict(tick.variables)}


def model_json(machine: Machine, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """What does not change during a run: states with their kinds and parents, transitions, events, parameters."""
    model = machine.model
    states = [
        {
            "name": state.name,
            "kind": state.kind.value,
            "parent": None if state.parent in (None, 0) else model.states[state.parent].name,
            "activity": None if state.activity is None else activity_text(state.activity),
            "line": None if state.place is None else state.place.line,
        }
        for state in model.states[1:]
        if state.kind not in (StateKind.SHALLOW_HISTORY, StateKind.DEEP_HISTORY)
    ]
    transitions = [
        {
            "source": model.states[one.source].name,
            "targets": [model.states[target].name for target in one.targets],
            "trigger": trigger_text(one.trigger, one.guard),
            "line": None if one.place is None else one.place.line,
        }
        for one in model.transitions
    ]
    return {
        "machine": machine.name,
        "parameters": dict(parameters),
        "events": None if model.events is None else sorted(model.events),
        "event_data": {one.event: {part.name: str(part.type) for part in one.fields} for one in model.event_data},
        "states": states,
        "transitions": transitions,
    }


def why_json(machine: Machine, tick: Tick | None, state: str) -> dict[str, Any]:
    """Why the transitions of a state fired or did not in a tick."""
    if tick is None:
        return {"reason": "no tick yet"}
    if state not in machine.indices:
        return {"reason": f"machine {machine.name} has no state `{printable(state[:200])}`"}
    return {
        "tick": tick.index,
        "state": state,
        "active": state in tick.configuration,
        "transitions": [
            {
                "trigger": trigger_text(one.transition.trigger, one.transition.guard),
                "line": None if one.transition.place is None else one.transition.place.line,
                "verdict": one.verdict.name.lower(),
                "reason": one.reason,
            }
            for one in tick.step.why(state)
        ],
    }


def encoded(value: object) -> bytes:
    """A JSON text; whatever JSON does not know is written as text."""
    return json.dumps(value, separators=(",", ":"), default=str).encode()
