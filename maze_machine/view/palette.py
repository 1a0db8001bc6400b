"""The colours that distinguish states, on the page and in pictures.

Any two of a ground differ in CIELAB by more than 50 for normal sight, by more than 30 under simulated deuteranopia and
protanopia, and by more than 25 under tritanopia (Machado, Oliveira and Fernandes, IEEE TVCG 15(6), 2009). The contrast
of each with its ground is 3:1 or more. A dash pattern goes with each, so that colour is never the only distinction.
"""

from __future__ import annotations

INKS = {
    "light": ("#2200ff", "#22aa00", "#ee33ee", "#662200", "#779966", "#440077", "#bb77aa", "#002233"),
    "dark": ("#5599ff", "#dd6611", "#bbff99", "#7733ff", "#ffdd00", "#aa4488", "#00eeff", "#998866"),
}
"""By the ground that they are for: ``light`` is white, ``dark`` nearly black."""
DASHES: tuple[tuple[int, ...], ...] = ((), (6, 3), (2, 3), (10, 3, 2, 3))
"""Lengths of strokes and gaps, in widths of a thin line."""
DOOR, EXIT = "#662200", "#449966"
"""Of doors and exits on a light ground."""
MAP = "#ff33bb"
"""Of the robot's map on a light ground."""


def style(number: int, ground: str = "light") -> tuple[str, tuple[int, ...]]:
    """The colour and the dash pattern of a state by the order of first entry, from 0."""
    inks = INKS[ground]
    return inks[number % len(inks)], DASHES[(number + number // len(inks)) % len(DASHES)]
