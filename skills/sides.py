"""The two sides of the robot, as a machine names them."""

from __future__ import annotations

from enum import StrEnum


class Side(StrEnum):
    """Left or right of the robot."""

    LEFT = "left"
    RIGHT = "right"

    @property
    def sign(self) -> int:
        """+1 for left, -1 for right: the sign of that side's y and of a turn to it."""
        return 1 if self is Side.LEFT else -1
