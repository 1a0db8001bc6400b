"""What odometry says of a movement, and how far from it the robot may really have got."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from perception.mapping.frames import between, compose
from perception.mapping.settings import ReckoningSettings
from transport.arithmetic import norm
from transport.messages import Pose


@dataclass(frozen=True, slots=True)
class Slip:
    """How far scans have lately had to correct odometry, from one that fitted to the next.

    Attributes:
        way: in position, m.
        turn: in heading, rad.
    """

    way: float = 0.0
    turn: float = 0.0

    def corrected(self, by: Pose, settings: ReckoningSettings) -> Slip:
        """The largest of these corrections and a new one, where older ones count less."""
        fading = settings.fading
        return Slip(max(norm(by.x, by.y), fading * self.way), max(abs(by.heading), fading * self.turn))


@dataclass(slots=True)
class Reckoning:
    """The steps of odometry since some moment.

    Attributes:
        settings: how far odometry may be off.
        slip: how far off it has been before.
        moved: the robot as seen from where it was then.
        way: how far it has driven, m.
        turned: how far it has turned, to either side, rad.
        measured: for how many ticks it has moved as measured.
        unmeasured: for how many ticks it is not known how it moved.
    """

    settings: ReckoningSettings
    slip: Slip = field(default_factory=Slip)
    moved: Pose = field(default_factory=Pose)
    way: float = 0.0
    turned: float = 0.0
    measured: int = 0
    unmeasured: int = 0

    def move(self, step: Pose | None) -> None:
        """Add a step; None where it is not known."""
        if step is None:
            self.unmeasured += 1
            return
        self.measured += 1
        self.moved = compose(self.moved, step)
        self.way += norm(step.x, step.y)
        self.turned += abs(step.heading)

    def allows(self, moved: Pose) -> bool:
        """Whether the robot may have moved so: nothing but odometry's errors lies between. Else it was carried."""
        settings, off = self.settings, between(self.moved, moved)
        # Wheels that slip err at random: the error grows with the root of the time.
        slips = settings.slips * math.sqrt(self.measured)
        place = settings.place + settings.place_way * self.way + settings.most_step * self.unmeasured
        turn = settings.turn + settings.turn_way * self.way + settings.turn_turn * self.turned
        place, turn = place + slips * self.slip.way, turn + slips * self.slip.turn
        return norm(off.x, off.y) <= place and abs(off.heading) <= turn + settings.most_turn * self.unmeasured
