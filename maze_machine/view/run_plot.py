"""A run as a figure: the path by state, speed and clearance over time, and a lane of states for each region."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from maze_machine.view.palette import INKS
from maze_machine.view.run_figure import Scene, Trail, draw_scene, draw_trail, state_styles, stretches
from transport.files import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LONGEST_NAME = 24
"""A longer name is cut in a lane, characters."""


@dataclass(frozen=True, slots=True, eq=False)
class RunSeries:
    """A run over time.

    Attributes:
        times: s from its beginning, shape (n,).
        speeds: how fast the robot was commanded to drive, m/s, shape (n,).
        turns: how fast it was commanded to turn, rad/s, shape (n,).
        clearances: distance from its outline to the nearest hit, m, shape (n,); NaN where nothing was hit.
        lanes: for each region its state at each time, n names.
    """

    times: NDArray[np.float64]
    speeds: NDArray[np.float64]
    turns: NDArray[np.float64]
    clearances: NDArray[np.float64]
    lanes: Mapping[str, Sequence[str]]


def save_plot(file: Path, scene: Scene, trail: Trail, course: RunSeries, title: str = "") -> None:
    """Draw a run into an image file; its suffix (.svg, .png, .pdf, .jpg) says which format.

    Raises:
        OSError: the file cannot be written.
    """
    lanes = max(len(course.lanes), 1)
    figure = Figure(figsize=(11.0, 8.5 + 0.35 * lanes), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    plan, speed, clearance, states = figure.subplots(4, 1, height_ratios=[10, 2.2, 2.2, 0.9 * lanes])
    draw_scene(plan, scene)
    draw_trail(figure, plan, trail)
    plan.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
    plan.set_title(title, fontsize=10, loc="left")
    _curves(speed, clearance, course)
    _lanes(states, course, trail.states)
    for axes in (speed, clearance):
        axes.sharex(states)
        axes.tick_params(labelbottom=False)
    with replacing(file) as written:
        figure.savefig(written, format=file.suffix.removeprefix(".") or "png", bbox_inches="tight")


def _curves(speed: Axes, clearance: Axes, course: RunSeries) -> None:
    first, second, third = INKS["light"][:3]
    speed.plot(course.times, course.speeds, color=first, label="speed [m/s]")
    speed.plot(course.times, course.turns, color=second, linestyle=(0, (3, 1.5)), label="turn [rad/s]")
    clearance.plot(course.times, course.clearances, color=third, label="clearance [m]")
    clearance.set_ylim(bottom=0.0)
    for axes in (speed, clearance):
        axes.grid(visible=True, color="0.9")
        axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=8, frameon=False)


def _lanes(axes: Axes, course: RunSeries, drawn: Sequence[str]) -> None:
    """A bar for each region where it is active, in the path's colours; a stretch is named where its name fits."""
    end = float(course.times[-1]) if len(course.times) else 1.0
    everywhere = [state for lane in course.lanes.values() for state in lane if state]
    styles = state_styles([*drawn, *everywhere])
    for row, (_, states) in enumerate(course.lanes.items()):
        for name, first, last in stretches(states):
            if not name:
                continue
            begin, wide = float(course.times[first]), float(course.times[last] - course.times[first])
            axes.broken_barh([(begin, wide)], (row - 0.4, 0.3), color=styles[name][0])
            shown = name.rpartition(".")[2][:LONGEST_NAME]
            if wide > 0.011 * end * len(shown):
                axes.text(begin + 0.004 * end, row + 0.25, shown, fontsize=7, va="center")
            axes.plot([begin, begin], [row - 0.4, row + 0.45], color="0.6", linewidth=0.6)
    axes.set_yticks(range(len(course.lanes)), [name[:LONGEST_NAME] for name in course.lanes])
    axes.set(xlim=(0.0, end), ylim=(len(course.lanes) - 0.4, -0.6), xlabel="time [s]")
