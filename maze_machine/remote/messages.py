"""The JSON messages about a running machine on the network: ``docs/reference/link.md`` lists it key by key."""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from hsm import Machine
from hsm.model.unparse import trigger_text
from maze_machine.drive.tick import Tick
from transport.wording import in_words, printable

LONGEST = 4096
"""The largest question; a longer one is refused unread, bytes."""


class _Question(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore", strict=True)


class SendEvent(_Question):
    """An event for the next tick, with its data: ``floor(number = 3)``."""

    kind: Literal["event"] = "event"
    name: Annotated[str, Field(min_length=1, max_length=1000)]


class SetParameter(_Question):
    """A new value for a parameter that the machine declares as adjustable, from the next tick on."""

    kind: Literal["set"] = "set"
    parameter: Annotated[str, Field(min_length=1, max_length=200)]
    value: Annotated[str, Field(min_length=1, max_length=200)]
    """As in the language: ``0.3 m/s``, ``true``."""

    @property
    def text(self) -> str:
        """The adjustment as recordings have it, not checked yet."""
        return f"{self.parameter} = {self.value}"


class Pause(_Question):
    """Pause after this tick; only if time is simulated and waits for the controller."""

    kind: Literal["pause"] = "pause"


class Resume(_Question):
    """Continue."""

    kind: Literal["resume"] = "resume"


class AdvanceRun(_Question):
    """Continue for some ticks, then pause again."""

    kind: Literal["advance"] = "advance"
    ticks: Annotated[int, Field(ge=1, le=1_000_000)] = 1


class SetSpeed(_Question):
    """Change the speed; only if time is simulated and waits for the controller."""

    kind: Literal["speed"] = "speed"
    factor: Annotated[float, Field(ge=0.001, le=1000)] | None = None
    """A multiple of real time, 0.001 to 1000; None for as fast as it can."""


class PauseAt(_Question):
    """Pause where the run comes to a place; only if time is simulated and waits for the controller."""

    kind: Literal["break"] = "break"
    at: Annotated[str, Field(max_length=1000)]
    """A state, ``line 12``, ``door:12`` or a condition such as ``turns == 2``; empty to take it back."""


class EndRun(_Question):
    """End the run; the robot is stopped."""

    kind: Literal["end"] = "end"


Operation = SendEvent | SetParameter | Pause | Resume | AdvanceRun | SetSpeed | PauseAt | EndRun
_OPERATIONS: TypeAdapter[Operation] = TypeAdapter(Annotated[Operation, Field(discriminator="kind")])


class Answer(BaseModel):
    """The result of an operation."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    done: bool
    reason: Annotated[str, Field(max_length=1000)] = ""


class OperationError(Exception):
    """A question that is not an operation; the message says why."""


def read_operation(payload: bytes) -> Operation:
    """The operation in a question.

    Raises:
        OperationError: it is invalid.
    """
    if len(payload) > LONGEST:
        raise OperationError(f"a question has at most {LONGEST} bytes")
    try:
        return _OPERATIONS.validate_json(payload)
    except ValidationError as error:
        raise OperationError(in_words(error.errors()[0])) from None


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
    """A JSON text; values without a JSON form are written as text."""
    return json.dumps(value, separators=(",", ":"), default=str).encode()
