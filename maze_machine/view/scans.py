"""Figures of one scan and of its features: Hough space, minimap, junction, nodes and door, landmarks.

All take plain data in the robot's frame, metres and radians: x forward, y to the left. In the pictures ahead is up.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

Points = NDArray[np.float64]
Point = tuple[float, float]
Segment = tuple[Point, Point]

HIT, ROBOT, FIRST, SECOND, THIRD = "#5b6770", "#1f77b4", "#d62728", "#2ca02c", "#9467bd"


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG."""
    FigureCanvasAgg(figure)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110, metadata={"Software": None})


def _figure(width: float, height: float) -> Figure:
    return Figure(figsize=(width, height), layout="constrained")


def _plan(axes: Axes, points: Points, footprint: Sequence[Point], reach: float) -> None:
    """The hits and the robot seen from above, ahead up, left to the left."""
    axes.plot(-points[:, 1], points[:, 0], ".", color=HIT, markersize=2.5)
    outline = np.asarray(footprint)
    axes.fill(-outline[:, 1], outline[:, 0], color=ROBOT, alpha=0.7)
    axes.arrow(0, 0, 0, 0.25, width=0.02, color=ROBOT)
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-0.6 * reach, 1.4 * reach)
    axes.set_aspect("equal")
    axes.set_xlabel("to the right, m")
    axes.set_ylabel("ahead, m")


def _segment(axes: Axes, segment: Segment, color: str, label: str | None = None) -> None:
    (x0, y0), (x1, y1) = segment
    axes.plot([-y0, -y1], [x0, x1], "-", color=color, linewidth=2.5, solid_capstyle="butt", label=label)


def hough_figure(
    points: Points,
    votes: NDArray[np.intp],
    axes_of_space: tuple[Points, Points],
    maxima: Sequence[Point],
    *,
    area: float,
    footprint: Sequence[Point],
) -> Figure:
    """A scan with its trust area beside its Hough space with the maxima.

    Args:
        points: hits, m, shape (n, 2).
        votes: hits on each line, shape (alphas, ps).
        axes_of_space: the alphas in rad and the ps in m.
        maxima: alpha and p of each maximum, the one with the most votes first.
        area: half the width of the trust area, m.
        footprint: the robot's outline.
    """
    figure = _figure(10, 4.6)
    plan, space = figure.subplots(1, 2)
    _plan(plan, points, footprint, 1.4 * area)
    plan.add_patch(Rectangle((-area, -area), 2 * area, 2 * area, fill=False, linestyle=":", color=ROBOT))
    alphas, ps = axes_of_space
    space.imshow(
        votes.T,
        origin="lower",
        aspect="auto",
        cmap="magma",
        extent=(0.0, 180.0, float(ps[0]), float(ps[-1])),
        interpolation="nearest",
    )
    for number, (alpha, p) in enumerate(maxima):
        color = FIRST if number == 0 else SECOND
        space.plot(math.degrees(alpha), p, "x", color=color, markersize=9, markeredgewidth=2)
        along = np.array([-2 * area, 2 * area])
        x = p * math.cos(alpha) - along * math.sin(alpha)
        y = p * math.sin(alpha) + along * math.cos(alpha)
        plan.plot(-y, x, "--", color=color, linewidth=1)
    plan.set_title("scan, trust area, lines of the maxima")
    space.set_title(f"Hough space, {len(alphas)} by {len(ps)}")
    space.set_xlabel("alpha, degrees")
    space.set_ylabel("p, m")
    return figure


def minimap_figure(cells: NDArray[np.uint8], cell: float, aligned: Points, footprint: Sequence[Point]) -> Figure:
    """A minimap: unknown grey, free white, occupied black, with the hits over it.

    Args:
        cells: 0 unknown, 1 free, 2 occupied; rows ahead, columns to the left, the robot in the middle.
        cell: width of a cell, m.
        aligned: hits in the minimap's frame, m, shape (n, 2).
        footprint: the robot's outline in that frame.
    """
    figure = _figure(5.2, 4.8)
    axes = figure.subplots()
    half = len(cells) * cell / 2
    colors = ListedColormap(["#b9bec3", "#ffffff", "#222222"])
    axes.imshow(
        cells[:, ::-1], origin="lower", cmap=colors, vmin=0, vmax=2, extent=(-half, half, -half, half),
        interpolation="nearest",
    )  # fmt: skip
    _plan(axes, aligned, footprint, half)
    axes.set_ylim(-half, half)
    axes.set_title(f"minimap, cells of {100 * cell:.0f} cm")
    return figure


def junction_figure(
    points: Points,
    footprint: Sequence[Point],
    spans: Mapping[str, Segment],
    boxes: Sequence[Sequence[Point]],
    title: str,
) -> Figure:
    """A junction with its distances and with the boxes that fit into its ways.

    Args:
        points: hits in the frame turned along the walls, m, shape (n, 2).
        footprint: the robot's outline in that frame.
        spans: the distances by their names, each from one point to another.
        boxes: outlines of the boxes.
        title: what it is.
    """
    figure = _figure(6, 5.6)
    axes = figure.subplots()
    _plan(axes, points, footprint, 2.0)
    for box in boxes:
        outline = np.asarray(box)
        axes.fill(-outline[:, 1], outline[:, 0], color=SECOND, alpha=0.3)
    for name, (start, end) in spans.items():
        arrow = {"arrowstyle": "<->", "color": FIRST, "linewidth": 1.4}
        axes.annotate("", xy=(-end[1], end[0]), xytext=(-start[1], start[0]), arrowprops=arrow)
        middle = (-(start[1] + end[1]) / 2, (start[0] + end[0]) / 2)
        is_across = abs(end[1] - start[1]) > abs(end[0] - start[0])
        shift = (-8, -16) if is_across else (5, 3)
        axes.annotate(name, middle, textcoords="offset points", xytext=shift, color=FIRST, fontsize=11)
    axes.set_title(title)
    return figure


def node_figure(
    points: Points,
    footprint: Sequence[Point],
    nodes: Sequence[tuple[int, str, Point]],
    walls: Sequence[Segment],
    door: Segment | None,
) -> Figure:
    """The nodes of a scan with their numbers, the walls between them and a door with its area.

    Args:
        points: hits, m, shape (n, 2).
        footprint: the robot's outline.
        nodes: number, kind (end or corner) and place of each node.
        walls: segments between connected nodes.
        door: the ends of a possible door, or None.
    """
    figure = _figure(6, 5.6)
    axes = figure.subplots()
    _plan(axes, points, footprint, 2.0)
    for segment in walls:
        _segment(axes, segment, "#c7d3dd")
    for number, kind, (x, y) in nodes:
        corner = kind == "corner"
        axes.plot(-y, x, "s" if corner else "o", color=FIRST if corner else THIRD, markersize=7)
        axes.annotate(str(number), (-y, x), textcoords="offset points", xytext=(6, 6))
    if door:
        _segment(axes, door, SECOND, "possible door, and within 1.3 m of it")
        around = _around(door, 1.3)
        axes.plot(-around[:, 1], around[:, 0], ":", color=SECOND)
        axes.legend(loc="lower left", frameon=False)
    axes.set_title("nodes: corners as squares, ends as dots")
    return figure


def _around(segment: Segment, distance: float) -> Points:
    """The outline of all places within a distance of a segment."""
    start, end = np.asarray(segment[0]), np.asarray(segment[1])
    direction = math.atan2(end[1] - start[1], end[0] - start[0])
    turns = np.linspace(direction - math.pi / 2, direction + math.pi / 2, 40)
    first = end + distance * np.stack((np.cos(turns), np.sin(turns)), axis=1)
    second = start - distance * np.stack((np.cos(turns), np.sin(turns)), axis=1)
    return np.concatenate((first, second, first[:1]))


def landmark_figure(
    points: Points, footprint: Sequence[Point], landmarks: Sequence[Segment], title: str, reach: float = 4.0
) -> Figure:
    """Landmarks drawn over the scan that they were found in, their starts red and their ends blue.

    Args:
        points: hits, m, shape (n, 2).
        footprint: the robot's outline.
        landmarks: start and end of each.
        title: what it shows.
        reach: how far to show, m.
    """
    figure = _figure(6, 5.6)
    axes = figure.subplots()
    _plan(axes, points, footprint, reach)
    for segment in landmarks:
        _segment(axes, segment, SECOND)
        (x0, y0), (x1, y1) = segment
        axes.plot(-y0, x0, "o", color=FIRST, markersize=6)
        axes.plot(-y1, x1, "o", color=ROBOT, markersize=4)
    axes.set_title(title)
    return figure
