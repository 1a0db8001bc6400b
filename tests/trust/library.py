"""A small robot for the tests of trust: its functions are never called, only what they declare counts."""

from __future__ import annotations

from enum import StrEnum

from hsm.model.registry import Library
from hsm.model.types import Angle, Length, Speed


class Light(StrEnum):
    RED = "red"
    GREEN = "green"


class Skill:
    def tick(self, facts: object) -> object:
        raise AssertionError("no test of trust runs a robot's own code")


def make_library() -> Library:
    library = Library("test")

    def signal(name: str, kind: type) -> None:
        def ask(facts: object) -> object:
            raise AssertionError("no test of trust runs a robot's own code")

        ask.__annotations__["return"] = kind
        library.signal(name)(ask)

    for name in ("space.left", "space.front", "space.right", "exit.crossed", "door.near", "door.tried", "door.open"):
        signal(name, bool)
    signal("ahead", Length)
    signal("tilt", Angle)
    signal("steps", int)
    signal("light", Light)

    @library.signal("clear")
    def clear(facts: object, distance: Length = 0.5) -> bool:
        raise AssertionError("no test of trust runs a robot's own code")

    @library.activity("drive", outcomes=("blocked",), holds=("base",))
    class Drive(Skill):
        def __init__(self, speed: Speed = 0.5) -> None: ...

    @library.activity("rotate", outcomes=("done", "blocked"), holds=("base",))
    class Rotate(Skill):
        def __init__(self, angle: Angle) -> None: ...

    @library.activity("ring", outcomes=("accepted", "refused"))
    class Ring(Skill): ...

    @library.activity("stop", holds=("base",))
    class Stop(Skill): ...

    @library.action("log")
    def log(facts: object, what: int) -> None:
        raise AssertionError("no test of trust runs a robot's own code")

    library.event("go")
    return library
