"""The colours of states and marks for eyes that see fewer of them; computed, so no browser is needed."""

import re
from itertools import combinations
from pathlib import Path

import pytest

import maze_machine.view
from maze_machine.view.palette import DASHES, DOOR, EXIT, INKS, MAP

SIGHTS = {
    "all colours": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "deuteranopia": ((0.367322, 0.860646, -0.227968), (0.280085, 0.672501, 0.047413), (-0.011820, 0.042940, 0.968881)),
    "protanopia": ((0.152286, 1.052583, -0.204868), (0.114503, 0.786281, 0.099216), (-0.003882, -0.048116, 1.051998)),
    "tritanopia": ((1.255528, -0.076749, -0.178779), (-0.078411, 0.930809, 0.147602), (0.004733, 0.691367, 0.303900)),
}
"""Machado, Oliveira and Fernandes 2009, severity 1, on linear RGB."""
STATES = {"all colours": 50.0, "deuteranopia": 30.0, "protanopia": 30.0, "tritanopia": 25.0}
MARKS = dict.fromkeys(SIGHTS, 25.0)
GROUNDS = ("light", "dark")


def page_colours():
    """The colours of the page's style, for a light and for a dark ground."""
    text = (Path(maze_machine.view.__file__).parent / "page.css").read_text(encoding="utf-8")
    blocks = re.findall(r":root \{(.*?)\}", text, re.DOTALL)
    return dict(zip(GROUNDS, (dict(re.findall(r"--([\w-]+): (#\w{6})", block)) for block in blocks), strict=True))


@pytest.mark.parametrize("sight", SIGHTS)
@pytest.mark.parametrize("ground", GROUNDS)
def test_colours_of_states_and_of_marks_differ_for_every_sight(ground, sight):
    marks = [page_colours()[ground][name] for name in ("wall", "door", "exit", "hit", "robot", "mark", "flash")]
    assert smallest_difference(INKS[ground], sight) > STATES[sight]
    assert smallest_difference(marks, sight) > MARKS[sight]


@pytest.mark.parametrize("sight", SIGHTS)
def test_what_a_path_picture_marks_differs_for_every_sight(sight):
    assert smallest_difference((DOOR, EXIT, MAP, "#000000"), sight) > MARKS[sight]


def test_two_colours_that_are_one_for_some_eyes_are_found():
    assert smallest_difference(("#7a5c00", "#1c7a00"), "deuteranopia") < 5


@pytest.mark.parametrize("ground", GROUNDS)
def test_colours_have_contrast_with_their_ground(ground):
    style = page_colours()[ground]
    for ink in (*INKS[ground], *(style[name] for name in ("door", "exit", "hit", "robot", "mark", "flash"))):
        assert contrast(ink, style["paper"]) >= 3.0, ink


def test_a_dash_pattern_goes_with_each_colour():
    assert len(set(DASHES)) == 4


def smallest_difference(inks, sight):
    """The smallest CIELAB distance of any two colours."""
    seen = [lab(through(sight, linear(ink))) for ink in inks]
    return min(
        sum((a - b) ** 2 for a, b in zip(one, other, strict=True)) ** 0.5 for one, other in combinations(seen, 2)
    )


def linear(ink):
    parts = [int(ink[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    return [one / 12.92 if one <= 0.04045 else ((one + 0.055) / 1.055) ** 2.4 for one in parts]


def through(sight, colour):
    rows = SIGHTS[sight]
    return [min(1.0, max(0.0, sum(a * b for a, b in zip(row, colour, strict=True)))) for row in rows]


def lab(colour):
    red, green, blue = colour
    x = (0.4124564 * red + 0.3575761 * green + 0.1804375 * blue) / 0.95047
    y = 0.2126729 * red + 0.7151522 * green + 0.0721750 * blue
    z = (0.0193339 * red + 0.1191920 * green + 0.9503041 * blue) / 1.08883
    a, b, c = (one ** (1 / 3) if one > 0.008856 else 7.787 * one + 16 / 116 for one in (x, y, z))
    return 116 * b - 16, 500 * (a - b), 200 * (b - c)


def contrast(one, other):
    light = [0.2126 * r + 0.7152 * g + 0.0722 * b for r, g, b in map(linear, (one, other))]
    return (max(light) + 0.05) / (min(light) + 0.05)
