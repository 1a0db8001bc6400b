"""The motion skills, one module each; importing this package declares them all in the library."""

from skills.activities import advance, align, arc, door, drive, follow_wall, pass_corner, reach_corner, rotate, stop

__all__ = ["advance", "align", "arc", "door", "drive", "follow_wall", "pass_corner", "reach_corner", "rotate", "stop"]
