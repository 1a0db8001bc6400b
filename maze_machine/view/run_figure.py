"""A picture of a run: the maze seen from above and the path of the robot."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from numpy.typing import NDArray

from maze_machine.view.palette import DOOR, EXIT, MAP, style
from transport.files import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LINES_OF_LEGEND = 24
"""How many states are distinguished by colour and dashes; with more, the path shows time instead."""
MAP_POINTS = 20_000
"""At most about this many points of a map are drawn."""
ENLARGED = 10
"""Ellipses are drawn this many times as large as they are: places are known within millimetres."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """The static parts, in metres in the frame of the maze.

    Attributes:
        walls: segments, shape (n, 2, 2): end points, each x and y.
        doors: segments of the closed doors, shape (m, 2, 2).
        exits: segments to be crossed, shape (k, 2, 2).
    """

    walls: NDArray[np.float64]
    doors: NDArray[np.float64]
    exits: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Trail:
    """The path of the robot.

    Attributes:
        times: seconds, shape (n,), increasing.
        positions: metres in the frame of the maze, shape (n, 2).
        states: the active state at each time; empty if unknown.
    """

    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    states: Sequence[str] = ()


class Spread(NamedTuple):
    """An ellipse: its middle and half axes, m, and the direction of the first axis, rad."""

    x: float
    y: float
    first: float
    second: float
    direction: float


@dataclass(frozen=True, slots=True, eq=False)
class SeenMap:
    """The robot's map, in metres in the frame of the picture.

    Attributes:
        points: on walls, shape (n, 2).
        way: where they were seen from, shape (k, 2).
        spreads: one standard deviation of some of these places.
    """

    points: NDArray[np.float64]
    way: NDArray[np.float64]
    spreads: Sequence[Spread]


def save_picture(file: Path, scene: Scene, trail: Trail, title: str = "", seen: SeenMap | None = None) -> None:
    """Draw a run into an image file; its suffix (.png, .svg, .pdf, .jpg) says which format.

    Args:
        file: the image.
        scene: walls, doors and exits.
        trail: the path.
        title: above it.
        seen: the robot's map, drawn over the walls; None where it has none.

    Raises:
        OSError: the file cannot be written.
    """
    width, height = _extent(scene, trail, seen)
    figure = Figure(figsize=_size(width, height), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    draw_scene(axes, scene)
    if seen is not None:
        draw_map(axes, seen)
    draw_trail(figure, axes, trail)
    axes.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axes.set_title(title, fontsize=10, loc="left", wrap=True)
    with replacing(file) as written:
        figure.savefig(written, format=file.suffix.removeprefix(".") or "png", bbox_inches="tight")


def draw_scene(axes: Axes, scene: Scene) -> None:
    """Draw walls, doors and exits."""
    axes.add_collection(LineCollection(list(scene.walls), colors="0.15", linewidths=1.6, capstyle="round"))
    if len(scene.doors):
        doors = LineCollection(list(scene.doors), colors=DOOR, linewidths=4.5, label="door")
        axes.add_collection(doors)
    if len(scene.exits):
        exits = LineCollection(list(scene.exits), colors=EXIT, linewidths=2.5, linestyles=":", label="exit")
        axes.add_collection(exits)
    axes.autoscale_view()


def draw_map(axes: Axes, seen: SeenMap) -> None:
    """The robot's map: what it saw of the walls, from where, and how well it knows those places."""
    every = max(1, len(seen.points) // MAP_POINTS)
    axes.plot(*seen.points[::every].T, ".", color=MAP, markersize=1.5, zorder=2.5, label="map: walls")
    axes.plot(*seen.way.T, color=MAP, linewidth=0.7, zorder=2.5, label="map: where they were seen from")
    ellipses = [
        Ellipse((one.x, one.y), 4 * ENLARGED * one.first, 4 * ENLARGED * one.second, angle=math.degrees(one.direction))
        for one in seen.spreads
    ]
    label = f"map: 2 standard deviations, x {ENLARGED}"
    rings = PatchCollection(ellipses, facecolor="none", edgecolor=MAP, linewidth=0.7, zorder=2.5)
    axes.add_collection(rings)
    axes.plot([], [], "o", markerfacecolor="none", markeredgecolor=MAP, markersize=7, label=label)


def draw_trail(figure: Figure, axes: Axes, trail: Trail) -> None:
    """The path, coloured by state if there are few, otherwise by time; a circle marks its beginning."""
    if not len(trail.positions):
        return
    names = list(dict.fromkeys(trail.states))
    if 0 < len(names) <= LINES_OF_LEGEND:
        styles = {name: (colour, _dashes(dash)) for name, (colour, dash) in state_styles(trail.states).items()}
        ways = LineCollection(
            [trail.positions[first : last + 1] for _, first, last in stretches(trail.states)],
            colors=[styles[name][0] for name, _, _ in stretches(trail.states)],
            linestyles=[styles[name][1] for name, _, _ in stretches(trail.states)],
            linewidths=2.0,
            joinstyle="round",
        )
        for name, (colour, dashes) in styles.items():
            axes.plot([], [], color=colour, linestyle=dashes, label=name)
    else:
        scale = Normalize(float(trail.times[0]), float(trail.times[-1]))
        pieces = list(np.stack([trail.positions[:-1], trail.positions[1:]], axis=1))
        ways = LineCollection(pieces, cmap="viridis", norm=scale, linewidths=2.0, capstyle="round")
        ways.set_array(trail.times[1:])
        figure.colorbar(ScalarMappable(scale, "viridis"), ax=axes, label="time [s]", shrink=0.6)
    axes.add_collection(ways)
    x, y = trail.positions[0]
    axes.plot([x], [y], "o", color="white", markeredgecolor="black", markersize=9, label="start of the path", zorder=3)
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8, frameon=False)


def state_styles(states: Sequence[str]) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Colour and dash pattern of each state, in the order in which they were entered."""
    return {name: style(number) for number, name in enumerate(dict.fromkeys(states))}


def _dashes(pattern: tuple[int, ...]) -> tuple[int, tuple[float, ...] | None]:
    """A dash pattern for matplotlib, in widths of a line of 2 points."""
    return 0, tuple(one / 2 for one in pattern) or None


def stretches(states: Sequence[str]) -> list[tuple[str, int, int]]:
    """Runs of the same state: its name, the index where it begins, and the one where the next begins or all ends."""
    begins = [index for index, state in enumerate(states) if index == 0 or state != states[index - 1]]
    ends = [*begins[1:], len(states) - 1]
    return [(states[begin], begin, end) for begin, end in zip(begins, ends, strict=True)]


def _extent(scene: Scene, trail: Trail, seen: SeenMap | None) -> tuple[float, float]:
    """Width and height of everything visible, m."""
    mapped = np.empty((0, 2)) if seen is None else seen.points
    points = np.concatenate([scene.walls.reshape(-1, 2), trail.positions.reshape(-1, 2), mapped])
    if not len(points):
        return 1.0, 1.0
    width, height = np.ptp(points, axis=0)
    return float(width), float(height)


def _size(width: float, height: float) -> tuple[float, float]:
    """Inches of the figure: ten on the longer side, with room for the legend."""
    scale = 9.0 / max(width, height, 1e-6)
    return max(width * scale, 3.0) + 2.2, max(height * scale, 2.5) + 0.8
