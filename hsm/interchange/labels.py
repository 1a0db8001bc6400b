"""The labels of lines in a picture that Graphviz has laid out: moved until they cross no border of a state.

Graphviz keeps a label away from states, but not from the borders of the states around them, nor from other labels. A
label that crosses a border or lies on another label is moved to the nearest place where it crosses none and covers
neither a state nor another label.
"""

from __future__ import annotations

from collections.abc import Iterator
from heapq import nsmallest
from typing import Any, NamedTuple

DISTANCES = (260.0, 700.0)
"""The longest way that a label is moved, points; the second where the first reaches no free place."""
TRIES = 3000
"""The number of places that are tried for a label, the nearest first."""
_GLYPH = 0.62
"""The mean width of a character, as a part of the font's size; fonts differ, so this is on the wide side."""
_LINE = 1.2
"""The height of a line, likewise."""
_GAP = 2.0
"""Between a label and what it must not touch, points."""


class Box(NamedTuple):
    """A rectangle, in points."""

    left: float
    bottom: float
    right: float
    top: float

    def touches(self, other: Box) -> bool:
        """Whether they have points in common."""
        return (
            self.left < other.right and other.left < self.right and self.bottom < other.top and other.bottom < self.top
        )

    def within(self, other: Box) -> bool:
        """Whether it lies in another one."""
        return (
            other.left <= self.left
            and self.right <= other.right
            and other.bottom <= self.bottom
            and self.top <= other.top
        )

    def moved(self, right: float, up: float) -> Box:
        """The same elsewhere."""
        return Box(self.left + right, self.bottom + up, self.right + right, self.top + up)


def settle(graph: Any) -> None:
    """Move the labels of the edges of a graph that has been laid out.

    Args:
        graph: a graph of pygraphviz with positions, which are changed.
    """
    paper = _box(graph.graph_attr["bb"])
    borders = [_box(one.graph_attr["bb"]) for one in _clusters(graph) if one.graph_attr["bb"]]
    filled = [box for one in graph.nodes() if (box := _node(one)) is not None]
    filled += [box for one in _clusters(graph) if (box := _title(one)) is not None]
    labels = [(edge, box) for edge in graph.edges() if (box := _label(edge)) is not None]
    kept: list[Box] = []
    moving = list[tuple[Any, Box]]()
    for edge, box in labels:
        if _crosses(box, borders) or any(map(box.touches, kept)):
            moving.append((edge, box))
        else:
            kept.append(box)
    for edge, box in moving:
        right, up = _way_out(box, paper, borders, [*filled, *kept])
        kept.append(box.moved(right, up))
        x, y = (float(one) for one in edge.attr["lp"].split(","))
        edge.attr["lp"] = f"{x + right:.2f},{y + up:.2f}"


def _crosses(box: Box, borders: list[Box]) -> bool:
    return any(box.touches(one) and not box.within(one) for one in borders)


def _way_out(box: Box, paper: Box, borders: list[Box], filled: list[Box]) -> tuple[float, float]:
    """The shortest way to a free place, right and up; nothing if there is none."""
    for most in DISTANCES:
        near = Box(box.left - most, box.bottom - most / 2, box.right + most, box.top + most / 2)
        lines, covered = ([one for one in boxes if one.touches(near)] for boxes in (borders, filled))
        across = _shifts(box.left, box.right, [x for one in (*lines, *covered) for x in (one.left, one.right)], most)
        along = _shifts(box.bottom, box.top, [y for one in (*lines, *covered) for y in (one.bottom, one.top)], most / 2)
        ways = ((right, up) for right in across for up in along)
        for right, up in nsmallest(TRIES, ways, key=lambda way: (abs(way[0]) + 2 * abs(way[1]), way)):
            there = box.moved(right, up)
            if there.within(paper) and not _crosses(there, lines) and not any(map(there.touches, covered)):
                return right, up
    return 0.0, 0.0


def _shifts(low: float, high: float, lines: list[float], most: float) -> set[float]:
    """No shift, and those of a limited length that bring an interval to either side of each line."""
    beside = [shift for line in lines for shift in (line - high - _GAP, line - low + _GAP)]
    return {0.0, *(round(one, 2) for one in beside if abs(one) <= most)}


def _clusters(graph: Any) -> Iterator[Any]:
    for one in graph.subgraphs_iter():
        if str(one.name).startswith("cluster"):
            yield one
        yield from _clusters(one)


def _node(node: Any) -> Box | None:
    if not node.attr["pos"] or node.attr["style"] == "invis":
        return None
    return _around(node.attr["pos"], 36 * float(node.attr["width"]), 36 * float(node.attr["height"]))


def _title(cluster: Any) -> Box | None:
    """The text of a state with states in it."""
    attributes = dict(cluster.graph_attr)
    if not attributes.get("lp"):
        return None
    return _around(attributes["lp"], 36 * float(attributes["lwidth"]), 36 * float(attributes["lheight"]))


def _label(edge: Any) -> Box | None:
    text = str(edge.attr["label"] or "").strip()
    if not text or not edge.attr["lp"]:
        return None
    lines = text.replace(r"\n", r"\l").removesuffix(r"\l").split(r"\l")
    size = float(edge.attr["fontsize"] or 11)
    wide, high = _GLYPH * size * max(map(len, lines)) / 2, _LINE * size * len(lines) / 2
    return _around(edge.attr["lp"], wide, high)


def _around(middle: str, wide: float, high: float) -> Box:
    """The box around a middle; its half width and half height are given."""
    x, y = (float(one) for one in middle.split(","))
    return Box(x - wide, y - high, x + wide, y + high)


def _box(text: str) -> Box:
    return Box(*(float(one) for one in text.split(",")))
