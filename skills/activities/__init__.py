"""The motion skills, one module each; importing this package declares them all in the library."""

from skills import chance, strategies
from skills.activities import (
    advance,
    align,
    arc,
    cross_space,
    door,
    drive,
    drive_to,
    explore,
    follow_wall,
    make_room,
    move,
    pass_corner,
    reach_corner,
    rotate,
    stop,
)

__all__ = [
    "advance",
    "align",
    "arc",
    "chance",
    "cross_space",
    "door",
    "drive",
    "drive_to",
    "explore",
    "follow_wall",
    "make_room",
    "move",
    "pass_corner",
    "reach_corner",
    "rotate",
    "stop",
    "strategies",
]
