"""The colours that distinguish states, on the page and in pictures.

Any two of a ground differ in CIELAB by more than 20, for normal sight and under simulated deuteranopia (Machado,
Oliveira and Fernandes, IEEE TVCG 15(6), 2009). The contrast of each with its ground is 3:1 or more. A dash pattern
goes with each, so that colour is never the only distinction.
"""

from __future__ import annotations

INKS = {
    "light": ("#0066bb", "#229900", "#ee3399", "#113311", "#550055", "#aa66bb", "#995544", "#002299"),
    "dark": ("#55bbee", "#ee7722", "#00eeaa", "#2288ff", "#009988", "#778844", "#eedd88", "#ffccff"),
}
"""By the ground that they are for: ``light`` is white, ``dark`` nearly black."""
DASHES: tuple[tuple[int, ...], ...] = ((), (6, 3), (2, 3), (10, 3, 2, 3))
"""Lengths of strokes and gaps, in widths of a thin line."""
DOOR, EXIT = "#995544", "#1c7a00"
"""Of doors and exits on a light ground."""
MAP = "#cc2200"
"""Of the robot's map on a light ground."""


def style(number: int, ground: str = "light") -> tuple[str, tuple[int, ...]]:
    """The colour and the dash pattern of a state by the order of first entry, from 0."""
    inks = INKS[ground]
    return inks[number % len(inks)], DASHES[(number + number // len(inks)) % len(DASHES)]
