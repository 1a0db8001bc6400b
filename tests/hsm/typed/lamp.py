"""A program of a user's, as a type checker sees it: no ``Any`` and no ``cast`` between the facts and the effects."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import hsm


@dataclass(frozen=True)
class Room:
    """The facts of a step."""

    dark: bool
    distance: float


@dataclass(frozen=True)
class Light:
    """The effect of an activity."""

    watts: float


class Mode(StrEnum):
    """How bright it is."""

    DIM = "dim"
    BRIGHT = "bright"


library: hsm.Library[Room, Light] = hsm.Library("lamp")
library.event("knock", "somebody is at the door")


@library.signal("dark")
def dark(facts: Room) -> bool:
    """Whether the lamp is needed."""
    return facts.dark


@library.signal("near")
def near(facts: Room, limit: hsm.Length = 2.0) -> bool:
    """Whether somebody is near."""
    return facts.distance < limit


@library.action("ring")
def ring(facts: Room, times: int = 1) -> None:
    """Ring the bell."""


@library.activity("shine", outcomes=("burnt_out",), holds=("bulb",))
class Shine:
    """Shine until the bulb has burnt out."""

    def __init__(self, mode: Mode = Mode.BRIGHT, duration: hsm.Duration = 10.0) -> None:
        self._mode = mode
        self._left = duration

    def tick(self, facts: Room) -> Light | hsm.Outcome:
        """One step."""
        self._left -= 1.0
        if self._left < 0:
            return hsm.Outcome("burnt_out")
        return Light(60.0 if self._mode is Mode.BRIGHT else 5.0)


TEXT = """\
machine lamp

param patience : time = 2 s

initial off

state off
    on knock if dark   -> on
    when dark and near(1 m) -> on

state on
    do shine(mode = dim)
    on burnt_out       -> off    / ring(2)
    after patience     -> off
"""


def brightness(effects: list[Light]) -> float:
    """What the room gets."""
    return sum(one.watts for one in effects)


def main() -> float:
    """Load, run, explain, save, restore, go on as a pure function."""
    machine: hsm.Machine[Room, Light] = hsm.loads(TEXT, library, "lamp.maze-machine")
    run = machine.start({"patience": 3.0}, facts=Room(dark=False, distance=9.0))
    step: hsm.Macrostep = run.step(0.1, ["knock"], Room(dark=True, distance=9.0))
    reasons: list[str] = [one.reason for one in step.considered if one.verdict is not hsm.Verdict.TAKEN]
    effects: list[Light] = [effect for _, effect in run.act(Room(dark=True, distance=9.0))]
    snapshot = run.snapshot()
    after, later = hsm.transition(machine, snapshot, hsm.Inputs(5.0, facts=Room(dark=False, distance=9.0)))
    other: hsm.Supervisor[Room, Light] = machine.restore(after)
    assert other.configuration == {"off"}
    assert later.exited == ("on",)
    assert all(reasons)
    return brightness(effects)
