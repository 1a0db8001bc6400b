"""The map of a run, kept for its file and its picture."""

from __future__ import annotations

from dataclasses import dataclass

from maze_machine.drive.tick import Tick
from perception.facts import take_in
from perception.mapping.frames import between, compose
from perception.world import WorldModel
from transport.messages import Pose


@dataclass(slots=True)
class MapRecorder:
    """Watches the ticks for the map of the robot, or makes one where the machine makes none.

    Attributes:
        own: makes a map from what the robot sees, without influence on it; None where only the machine's counts.
        world: the memory with the map; None before there is one.
        anchor: the robot when it first knew its place, in the frame of the picture and in the world model's.
    """

    own: WorldModel | None = None
    world: WorldModel | None = None
    anchor: tuple[Pose, Pose] | None = None

    def __call__(self, tick: Tick) -> None:
        """Take in a tick."""
        facts = tick.facts
        if facts is None:
            return
        if facts.world.surveyor is not None:
            if self.own is not None:
                self.own, self.anchor = None, None
            self.world = facts.world
        elif self.own is not None:
            take_in(facts, self.own)
            self.own.begin_map(facts.sweep)
            self.world = self.own
        if self.anchor is None and self.world is not None and self.world.place_known:
            self.anchor = (tick.truth or tick.pose, self.world.pose)

    @property
    def frame(self) -> Pose | None:
        """The world model's frame in the picture's; None where the robot has not known its place."""
        if self.anchor is None:
            return None
        there, here = self.anchor
        return compose(there, between(here, Pose()))
