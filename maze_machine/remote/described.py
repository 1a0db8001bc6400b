"""What a remote machine says of itself, checked before a page, a terminal or a debugger uses it.

Anybody may answer on the network. A message of another form, or a larger one, is refused whole with one message that
names the first value that is wrong; keys that are not known here are left out. ``docs/reference/machine.schema.json``
and ``docs/reference/tick.schema.json`` publish the forms.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, NotRequired

from pydantic import ConfigDict, Field, FiniteFloat, TypeAdapter, ValidationError
from typing_extensions import TypedDict  # pydantic supports no other before Python 3.12

from maze_machine.drive.tick_json import TickJson, Value
from maze_machine.errors import CommandError, ExitStatus
from transport.wording import in_words

LARGEST_TICK = 1 << 20
"""The largest tick, bytes; the shipped machines need less than 1% of it."""
LARGEST_MACHINE = 1 << 25
"""The largest description of a machine, with its text and its pictures, bytes."""
MOST_STATES = 100_000
"""The most states, transitions and other parts of a machine."""

_Index = Annotated[int, Field(ge=0, le=MOST_STATES)]
_Line = Annotated[int, Field(ge=1, le=1 << 31)] | None
_Point = Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)]
_Segment = Annotated[list[FiniteFloat], Field(min_length=4, max_length=4)]
_Texts = Annotated[dict[str, str], Field(max_length=MOST_STATES)]


class StateJson(TypedDict):
    """A state of a machine, after those around it."""

    index: Annotated[_Index, Field(description="its number in the machine; pictures name it `state_INDEX`")]
    name: Annotated[str, Field(description="its full name")]
    kind: Annotated[str, Field(description="`atomic`, `compound`, `parallel` or `final`")]
    parent: Annotated[str | None, Field(description="the full name of the state around it; null at the top")]
    instance: Annotated[str | None, Field(description="the machine that it is an instance of; null for none")]
    activity: Annotated[str | None, Field(description="its activity, as the file has it")]
    file: Annotated[str | None, Field(description="the file that declares it, without folders")]
    line: _Line


class TransitionJson(TypedDict):
    """A transition; its number is its place in the list."""

    source: Annotated[str, Field(description="the full name of a state, or the name of the machine")]
    targets: list[str]
    trigger: Annotated[str, Field(description="trigger and guard, as the file has them")]
    actions: list[str]
    file: str | None
    line: _Line


class LaserJson(TypedDict):
    """The beams of a tick's `ranges`."""

    angle_min: FiniteFloat
    step: FiniteFloat
    x: FiniteFloat
    y: FiniteFloat
    heading: FiniteFloat


class SceneJson(TypedDict):
    """A maze: segments as x1, y1, x2, y2 in m."""

    walls: Annotated[list[_Segment], Field(max_length=MOST_STATES)]
    doors: Annotated[list[_Segment], Field(max_length=MOST_STATES)]
    exits: Annotated[list[_Segment], Field(max_length=MOST_STATES)]


class PageJson(TypedDict):
    """What a page shows besides the machine."""

    title: str
    period: Annotated[FiniteFloat, Field(gt=0, description="from one tick to the next, s")]
    footprint: Annotated[list[_Point], Field(max_length=1000, description="the outline of the robot, m")]
    laser: LaserJson | None
    scene: Annotated[SceneJson | None, Field(description="null where the maze is not known")]
    sources: Annotated[_Texts, Field(description="the text of the machine's files, by name")]
    drawings: Annotated[_Texts, Field(description="SVG by the compound state that is opened")]
    undrawn: Annotated[str, Field(description="why there are no pictures")]


class MachineJson(TypedDict):
    """The constant part of a run."""

    machine: Annotated[str, Field(min_length=1, max_length=1000)]
    parameters: Annotated[dict[str, Value], Field(description="in SI units")]
    types: Annotated[_Texts, Field(description="the types of parameters and variables")]
    adjustable: Annotated[
        dict[str, Annotated[list[FiniteFloat | None], Field(min_length=2, max_length=2)]],
        Field(description="the bounds of each parameter that an operator may change; null for none"),
    ]
    events: Annotated[list[str] | None, Field(description="the events that may be sent; null where any may")]
    event_data: Annotated[dict[str, dict[str, str]], Field(description="names and types of what events carry")]
    states: Annotated[list[StateJson], Field(max_length=MOST_STATES)]
    transitions: Annotated[list[TransitionJson], Field(max_length=MOST_STATES)]
    properties: _Texts
    assumptions: _Texts
    page: NotRequired[PageJson]


class _Ended(TypedDict):
    line: str
    solved: bool
    lines: list[str]
    outcome: str | None
    reason: NotRequired[str]
    at_rest: NotRequired[bool]


class PublishedTick(TickJson, total=False):
    """A tick as it is published: with ``paused`` if the run is paused after it, ``ended`` after the last."""

    __pydantic_config__ = ConfigDict(extra="ignore")  # type: ignore[misc]  # a newer machine may say more

    paused: str
    ended: _Ended


class _Considered(TypedDict):
    trigger: str
    line: _Line
    verdict: str
    reason: str


class _Why(TypedDict):
    tick: Annotated[int, Field(ge=0)]
    state: str
    active: bool
    transitions: list[_Considered]


class _NoWhy(TypedDict):
    reason: str


_MACHINE, _TICK = TypeAdapter(MachineJson), TypeAdapter(PublishedTick)
_WHY, _NO_WHY = TypeAdapter(_Why), TypeAdapter(_NoWhy)
_EMPTY = b"{}"


class ForeignMessageError(CommandError):
    """A remote machine sends a message that is not of the published form."""

    status = ExitStatus.UNREACHABLE


def machine_schema() -> dict[str, Any]:
    """The JSON Schema of the description of a machine."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "A machine that runs, as it describes itself",
        **_MACHINE.json_schema(),
    }


def read_machine(message: bytes) -> dict[str, Any]:
    """A machine from its description.

    Raises:
        ForeignMessageError: it is not one.
    """
    machine = _read(_MACHINE, message, "description", LARGEST_MACHINE)
    known: set[str] = set()
    for state in machine["states"]:
        if state["name"] in known or (state["parent"] is not None and state["parent"] not in known):
            raise _refusal("description", f"state `{state['name']}` is listed twice, or before the state around it")
        known.add(state["name"])
    for transition in machine["transitions"]:
        if transition["source"] not in known and transition["source"] != machine["machine"]:
            raise _refusal(
                "description", f"a transition belongs to `{transition['source']}`, which is not a state of it"
            )
    return machine


def read_tick(message: bytes) -> dict[str, Any]:
    """A published tick; empty before the first.

    Raises:
        ForeignMessageError: it is not one.
    """
    return {} if message == _EMPTY else _read(_TICK, message, "tick", LARGEST_TICK)


def read_why(message: bytes) -> dict[str, Any]:
    """The verdicts about a state's transitions, or the ``reason`` why there are none.

    Raises:
        ForeignMessageError: it is neither.
    """
    try:
        return _read(_NO_WHY, message, "answer", LARGEST_TICK)
    except ForeignMessageError:
        return _read(_WHY, message, "answer", LARGEST_TICK)


def _read(form: TypeAdapter[Any], message: bytes, what: str, largest: int) -> dict[str, Any]:
    if len(message) > largest:
        raise _refusal(what, f"it has {len(message)} bytes, and at most {largest} are read")
    try:
        found: Mapping[str, Any] = form.validate_json(message, strict=True)
    except ValidationError as error:
        raise _refusal(what, in_words(error.errors(include_url=False)[0])) from None
    return dict(found)


def _refusal(what: str, reason: str) -> ForeignMessageError:
    return ForeignMessageError(
        f"the {what} that the machine sends cannot be used: {reason}",
        "is it maze-machine of another version, or another program?",
    )
