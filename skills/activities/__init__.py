"""The motion skills, one module each; importing this package declares them all in the library."""

from skills import chance, strategies
from skills.activities import (
    advance,
    align,
    arc,
    door,
    drive,
    follow_wall,
    make_room,
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
    "door",
    "drive",
    "follow_wall",
    "make_room",
    "pass_corner",
    "reach_corner",
    "rotate",
    "stop",
    "strategies",
]
