"""Following a wall."""

from __future__ import annotations

from hsm.model.types import Length, Speed
from skills.activities.drive import Drive
from skills.library import LIBRARY
from skills.motion import not_negative
from skills.passage import Passage, off_the_walls
from skills.sides import Side


@LIBRARY.activity("follow_wall", outcomes=("blocked",), holds=("base",))
class FollowWall(Drive):
    """Drive along the wall on one side, at a distance that a virtual spring with a dead zone controls.

    In a corridor narrower than twice the distance the robot drives in the middle; if there is no wall to follow, it
    drives straight on. A distance of zero means the robot's usual one. Outcomes: `blocked` when the robot makes no
    progress.
    """

    def __init__(self, side: Side = Side.RIGHT, speed: Speed = 0.5, distance: Length = 0.0) -> None:
        super().__init__(speed)
        self._side = side
        self._distance = not_negative("distance", distance) or self.settings.wall.distance

    def _aside(self, passage: Passage) -> float:
        wall = passage.bound(self._side.sign)
        if wall > self.settings.wall.reach or passage.width < 2 * self._distance:
            return off_the_walls(passage, self.settings)
        return self._side.sign * (wall - self._distance)
