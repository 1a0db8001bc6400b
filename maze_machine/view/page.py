"""The page that shows a run: the robot in its surroundings, its states, its transitions; by itself or live.

A page is one HTML file without any other. It is made of a head, which says what does not change, and of frames, one a
tick; both are JSON values:

    head    {"title", "period", "footprint": [[x, y], ...], "laser": {"angle_min", "step", "x", "y", "heading"},
             "walls": [[x1, y1, x2, y2], ...], "doors": ..., "exits": ...}
    frame   {"time", "pose": [x, y, heading], "states": [...], "doing", "taken": [...], "reasons": [...],
             "twist": [forward, left, turn], "ranges": [...]}

Lengths are metres and angles radians, in the frame of the walls where there are walls and in that of the odometry where
there are none; ``ranges`` are whole centimetres, negative where a beam hit nothing.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from transport.description import RobotDescription
from transport.messages import Command, Observation, Pose

TEMPLATE = Path(__file__).with_name("page.html")
STRIDE = 8
"""Every this many beams are shown."""

PageFrame = Mapping[str, Any]


def head(
    title: str, robot: RobotDescription, scene: Mapping[str, Sequence[Sequence[float]]] | None = None
) -> PageFrame:
    """What does not change during a run.

    Args:
        title: what the page is called.
        robot: shape and laser.
        scene: ``walls``, ``doors`` and ``exits`` as lists of x1, y1, x2, y2; None where they are not known: the page
            then draws what the laser has seen.
    """
    laser = robot.laser
    return {
        "title": title,
        "period": robot.period,
        "footprint": robot.footprint,
        "laser": {
            "angle_min": laser.angle_min,
            "step": laser.geometry().angle_increment * STRIDE,
            "x": laser.mount_x,
            "y": laser.mount_y,
            "heading": laser.mount_heading,
        },
        **(scene or {"walls": [], "doors": [], "exits": []}),
    }


def frame(observation: Observation, command: Command, step: Mapping[str, Any], pose: Pose | None = None) -> PageFrame:
    """One tick.

    Args:
        observation: what the robot sensed.
        command: what it was commanded.
        step: ``states``, ``taken`` and, where they are known, ``doing`` and ``reasons``.
        pose: where the robot really was, in the frame of the walls; None for the odometry.
    """
    ranges = observation.scan.ranges[::STRIDE]
    hit = np.isfinite(ranges) & (ranges >= observation.scan.geometry.range_min)
    shown = pose or observation.odometry.pose
    return {
        "time": round(observation.time, 3),
        "pose": [round(shown.x, 4), round(shown.y, 4), round(shown.heading, 4)],
        "states": list(step.get("states", ())),
        "doing": step.get("doing", ""),
        "taken": list(step.get("taken", ())),
        "reasons": [one["reason"] for one in step.get("why", ()) if step.get("taken")],
        "twist": [round(command.twist.forward, 3), round(command.twist.left, 3), round(command.twist.turn, 3)],
        "ranges": np.where(hit, np.round(np.where(hit, ranges, 0.0) * 100), -1).astype(int).tolist(),
    }


def replay_page(head: PageFrame, frames: Iterable[PageFrame]) -> str:
    """A page that shows a whole run and needs nothing else."""
    return _page({"head": head, "frames": list(frames), "live": False})


def live_page(head: PageFrame) -> str:
    """A page that asks the server that it came from for its frames."""
    return _page({"head": head, "frames": [], "live": True})


def _page(data: Mapping[str, Any]) -> str:
    # In a script element, only the sequence "</" could end the data early.
    text = json.dumps(data, separators=(",", ":")).replace("</", "<\\/")
    return TEMPLATE.read_text(encoding="utf-8").replace("/*DATA*/null", text)
