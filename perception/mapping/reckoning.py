"""What odometry says of a movement, and how far from it the robot may really have got."""

from __future__ import annotations

from dataclasses import dataclass, field

from perception.mapping.frames import between, compose
from perception.mapping.settings import ReckoningSettings
from transport.arithmetic import norm
from transport.messages import Pose


@dataclass(slots=True)
class Reckoning:
    """The steps of odometry since some moment.

    Attributes:
        settings: how far odometry may be off.
        moved: the robot as seen from where it was then.
        way: how far it has driven, m.
        turned: how far it has turned, to either side, rad.
        unmeasured: for how many ticks it is not known how it moved.
    """

    settings: ReckoningSettings
    moved: Pose = field(default_factory=Pose)
    way: float = 0.0
    turned: float = 0.0
    unmeasured: int = 0

    def move(self, step: Pose | None) -> None:
        """Add a step; None where it is not known."""
        if step is None:
            self.unmeasured += 1
            return
        self.moved = compose(self.moved, step)
        self.way += norm(step.x, step.y)
        self.turned += abs(step.heading)

    def allows(self, moved: Pose) -> bool:
        """Whether the robot may have moved so: nothing but odometry's errors lies between. Else it was carried."""
        settings, off = self.settings, between(self.moved, moved)
        place = settings.place + settings.place_way * self.way + settings.most_step * self.unmeasured
        turn = settings.turn + settings.turn_way * self.way + settings.turn_turn * self.turned
        return norm(off.x, off.y) <= place and abs(off.heading) <= turn + settings.most_turn * self.unmeasured
