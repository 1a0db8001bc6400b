"""A small library of a robot that walks mazes, for the tests of the language."""

from __future__ import annotations

from enum import StrEnum

from hsm.model.registry import Library
from hsm.model.types import Angle, Duration, Length, Quantity, Speed, TurnRate


class Side(StrEnum):
    LEFT = "left"
    RIGHT = "right"


class Junction(StrEnum):
    CORRIDOR = "corridor"
    DEAD_END = "dead_end"
    CORNER = "corner"
    CROSSING = "crossing"


def make_library() -> Library:
    library = Library("test")

    for name in ("space.left", "space.front", "space.right", "exit.crossed", "door.near", "door.tried"):

        @library.signal(name)
        def flag(facts: object) -> bool:
            """One flag."""
            return bool(facts)

    @library.signal("clear")
    def clear(facts: object, distance: Length = 0.5) -> bool:
        """Whether nothing stands within a distance ahead."""
        return bool(facts and distance)

    @library.signal("ahead")
    def ahead(facts: object) -> Length:
        """Free distance ahead."""
        return float(bool(facts))

    @library.signal("heading")
    def heading(facts: object) -> Angle:
        """Where the robot looks."""
        return float(bool(facts))

    @library.signal("steps")
    def steps(facts: object) -> int:
        """How many cells were crossed."""
        return int(bool(facts))

    @library.signal("junction.kind")
    def kind(facts: object) -> Junction:
        """What stands ahead."""
        return Junction.CORRIDOR if facts else Junction.CORNER

    class Skill:
        def tick(self, facts: object) -> object:
            return facts

    @library.activity("drive", outcomes=("blocked",), holds=("base",))
    class Drive(Skill):
        """Drive straight on."""

        def __init__(self, speed: Speed = 0.5) -> None: ...

    @library.activity("align", outcomes=("done", "blocked"), holds=("base",))
    class Align(Skill):
        """Turn to be parallel to a wall."""

        def __init__(self, side: Side) -> None: ...

    @library.activity("follow_wall", outcomes=(), holds=("base",))
    class FollowWall(Skill):
        """Drive along a wall."""

        def __init__(self, side: Side = Side.RIGHT, speed: Speed = 0.5) -> None: ...

    @library.activity("rotate", outcomes=("done",), holds=("base",))
    class Rotate(Skill):
        """Turn on the spot."""

        def __init__(self, angle: Angle, rate: TurnRate = 0.8) -> None: ...

    @library.activity("ring", outcomes=("done", "refused"), holds=("bell",))
    class Ring(Skill):
        """Ring the bell of a door."""

    @library.activity("wait", outcomes=("done",))
    class Wait(Skill):
        """Stand still."""

        @classmethod
        def refuses(cls, *, times: int = 1, **_: object) -> str:
            return "" if times > 0 else f"`times` must be above zero, not {times}"

        def __init__(self, duration: Duration = 1.0, times: int = 1) -> None: ...

    @library.action("door.remember")
    def remember(facts: object) -> None:
        """Note that this door was tried."""

    @library.action("beep")
    def beep(facts: object, times: int = 1) -> None:
        """Make a sound."""

    library.constant("robot.radius", Quantity(length=1), 0.25, "As far as the robot reaches.")
    library.event("bumped", "the robot touched something")
    return library
