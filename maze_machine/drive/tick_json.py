"""The JSON of a tick, key by key, and its schema.

The same object is a line of a trace (the keys of ``TickLine``), the step in a recording, the message on the network and
the input of the page. ``docs/reference/tick.schema.json`` is made from here.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, NotRequired

from pydantic import ConfigDict, Field, FiniteFloat, TypeAdapter
from typing_extensions import TypedDict  # pydantic supports no other before Python 3.12

Triple = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]
Value = bool | int | FiniteFloat | str


class ActivityRecord(TypedDict):
    """The activity of an active state."""

    text: Annotated[str, Field(description="the activity as the machine's file has it")]
    arguments: Annotated[
        dict[str, str], Field(description="the values that it was begun with, with units; empty before it begins")
    ]


class Reason(TypedDict):
    """The verdict about a transition."""

    transition: Annotated[int, Field(ge=0, description="its index among the transitions of the machine's model")]
    verdict: Literal["taken", "preempted", "false", "earlier", "not_due", "failed", "undone", "absent"]
    reason: Annotated[str, Field(description="the verdict in words, with the values that decided it")]


class TickLine(TypedDict):
    """The sensed, decided and commanded values of a tick: a line of a trace."""

    tick: Annotated[int, Field(ge=0, lt=1 << 63, description="its number, from 0")]
    stamp: Annotated[int, Field(ge=0, lt=1 << 63, description="the time of the observation on the robot's clock, ns")]
    states: Annotated[list[str], Field(description="full names of the active states, in document order")]
    taken: Annotated[list[str], Field(description="the transitions taken, in order: source -> targets (line N)")]
    pose: Annotated[Triple, Field(description="x, y, heading by odometry, m and rad")]
    twist: Annotated[Triple, Field(description="the command: forward and left, m/s, and turn, rad/s")]
    ring: Annotated[bool, Field(description="whether the door bell is rung")]
    goal: Annotated[NotRequired[Triple], Field(description="x, y, heading for the robot's own navigation, m and rad")]
    events: Annotated[NotRequired[list[str]], Field(description="the external events of this tick")]
    sent: Annotated[
        NotRequired[list[str]], Field(description=("the events that the machine sent to other machines, in order"))
    ]
    blind: Annotated[NotRequired[str], Field(description="why the loop keeps the base stopped")]
    outcome: Annotated[NotRequired[str], Field(description="the final state that ended the machine")]
    violated: Annotated[NotRequired[list[str]], Field(description="properties that do not hold from this tick on")]
    broken: Annotated[NotRequired[list[str]], Field(description="assumptions that do not hold from this tick on")]


class TickJson(TickLine):
    """The full JSON of a tick."""

    __pydantic_config__ = ConfigDict(extra="forbid")  # type: ignore[misc]  # a key that is not documented is a mistake

    doing: Annotated[str, Field(description="the state that names the tick: the first that asked for motion")]
    fired: Annotated[list[int], Field(description="the transitions taken, as indices in the machine's model")]
    regions: Annotated[dict[str, str], Field(description="the innermost active state of each region")]
    activities: Annotated[dict[str, ActivityRecord], Field(description="the activity of each active state")]
    outcomes: Annotated[
        list[Annotated[list[str], Field(min_length=2, max_length=2)]],
        Field(description="states whose activities ended, or that completed, with the outcome"),
    ]
    variables: Annotated[dict[str, Value], Field(description="variables and parameters by full name, in SI units")]
    why: Annotated[list[Reason], Field(description="every transition that was considered or that an active state has")]
    truth: Annotated[NotRequired[Triple], Field(description="the true pose of the robot in the frame of the maze")]
    place: Annotated[
        NotRequired[Literal["known", "doubtful", "lost"]],
        Field(description="what the robot knows of its place on its map; absent if it keeps none"),
    ]
    ranges: Annotated[
        NotRequired[list[int]], Field(description="over the network and on the page: every 8th beam, cm; -1 for no hit")
    ]


LINE = frozenset(TickLine.__annotations__)
"""The keys of a trace."""


def tick_schema() -> dict[str, Any]:
    """The JSON Schema of a tick."""
    schema = TypeAdapter(TickJson).json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "A tick of a run", **schema}


def line_of(step: Mapping[str, Any]) -> dict[str, Any]:
    """The trace line within the full JSON of a tick."""
    return {name: value for name, value in step.items() if name in LINE}
