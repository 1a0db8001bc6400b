"""From a recording to its plot."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from maze_machine.report.run_picture import NOWHERE
from maze_machine.view.run_figure import Scene, Trail
from maze_machine.view.run_plot import RunSeries
from perception.sweep import ScanPoints
from perception.walls import clearance_of, without_own_body
from transport.description import RobotDescription
from transport.recording import RecordedTick, Recording
from transport.wording import printable


def plotted(recording: Recording, robot: RobotDescription) -> tuple[Scene, Trail, RunSeries]:
    """The data of a plot of a recorded run.

    Args:
        recording: the run.
        robot: its outline and laser.
    """
    ticks = recording.ticks
    times = np.array([tick.observation.time for tick in ticks])
    times -= times[0]
    places = [_place(tick.step, tick.observation.odometry.pose.x, tick.observation.odometry.pose.y) for tick in ticks]
    states = [printable(str(tick.step.get("doing", "")))[:80] for tick in ticks]
    regions = list(dict.fromkeys(name for tick in ticks for name in _regions(tick.step)))
    lanes = {name: [_regions(tick.step).get(name, "") for tick in ticks] for name in regions}
    course = RunSeries(
        times,
        np.array([tick.command.twist.speed for tick in ticks]),
        np.array([tick.command.twist.turn for tick in ticks]),
        np.array([_clearance(tick, robot) for tick in ticks]),
        lanes,
    )
    return _scene(recording), Trail(times, np.array(places).reshape(-1, 2), states if any(states) else ()), course


def _clearance(tick: RecordedTick, robot: RobotDescription) -> float:
    sweep = without_own_body(ScanPoints.of(tick.observation.scan, robot.laser.mount), robot.footprint)
    found = clearance_of(sweep.points, robot.footprint)
    return found if np.isfinite(found) else float("nan")


def _regions(step: Any) -> dict[str, str]:
    regions = step.get("regions")
    found = regions if isinstance(regions, dict) else {}
    return {printable(str(name))[:80]: printable(str(state))[:80] for name, state in found.items()}


def _place(step: Any, x: float, y: float) -> tuple[float, float]:
    truth = step.get("truth")
    if isinstance(truth, list) and len(truth) == 3 and all(isinstance(one, int | float) for one in truth):
        return float(truth[0]), float(truth[1])
    return x, y


def _scene(recording: Recording) -> Scene:
    """The maze in the recording, if there is one."""
    try:
        kept = json.loads(recording.run.get("scene", "{}"))
        return Scene(*(_segments(kept.get(name, [])) for name in ("walls", "doors", "exits")))
    except (ValueError, TypeError, AttributeError, RecursionError):
        return NOWHERE


def _segments(rows: Any) -> NDArray[np.float64]:
    return np.array(rows, dtype=np.float64).reshape(-1, 2, 2)
