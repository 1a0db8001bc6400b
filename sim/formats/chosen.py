"""A maze with the start, the exits and the goal that its user has chosen in place of the file's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sim.formats.format import Choices
from sim.maze import Leave, Maze, Point, Segments, Survive
from transport.arithmetic import norm

OPENED = 0.15
"""Walls within this distance of a chosen exit are removed, m."""
END = 1e-6
"""Walls at its ends stay, m."""


def chosen(maze: Maze, choices: Choices) -> Maze:
    """The maze as chosen.

    Chosen exits replace the file's, which are closed, and walls and edges of the unknown are removed along them.
    An exit without a goal means that the robot is to leave.
    """
    if choices.start is not None:
        maze = replace(maze, start=choices.start)
    if choices.exits:
        walls, unknown = np.concatenate([maze.walls, maze.exits]), maze.unknown
        for gate in choices.exits:
            walls, unknown = opened(walls, gate), opened(unknown, gate)
        exits = np.asarray([[*first, *second] for first, second in choices.exits])
        maze = replace(maze, walls=walls, unknown=unknown, exits=exits, goal=Leave())
    match choices.goal:
        case None:
            return maze
        case Survive(duration):
            return replace(maze, goal=choices.goal, time_limit=max(maze.time_limit, duration))
        case goal:
            return replace(maze, goal=goal)


def opened(segments: Segments, gate: tuple[Point, Point]) -> Segments:
    """Segments without what lies along a gate.

    Args:
        segments: shape (n, 4).
        gate: its two ends, m.

    Returns:
        The parts outside of the rectangle that has the gate's length and reaches `OPENED` to both of its sides, in
        order.
    """
    (gx, gy), (hx, hy) = gate
    length = norm(hx - gx, hy - gy)
    ex, ey = (hx - gx) / length, (hy - gy) / length
    kept: list[tuple[float, float, float, float]] = []
    for ax, ay, bx, by in segments.tolist():
        along = (ax - gx) * ex + (ay - gy) * ey, (bx - gx) * ex + (by - gy) * ey
        aside = (ay - gy) * ex - (ax - gx) * ey, (by - gy) * ex - (bx - gx) * ey
        first, last = _within(along, END, length - END), _within(aside, -OPENED, OPENED)
        enters, leaves = max(first[0], last[0]), min(first[1], last[1])
        if enters >= leaves:
            kept.append((ax, ay, bx, by))
            continue
        dx, dy = bx - ax, by - ay
        if enters > 0.0:
            kept.append((ax, ay, ax + enters * dx, ay + enters * dy))
        if leaves < 1.0:
            kept.append((ax + leaves * dx, ay + leaves * dy, bx, by))
    return np.asarray(kept, dtype=np.float64).reshape(-1, 4)


def _within(ends: tuple[float, float], low: float, high: float) -> tuple[float, float]:
    """From which to which share of its way a value is within limits that goes evenly from one end to the other."""
    first, last = ends
    if first == last:
        return (0.0, 1.0) if low <= first <= high else (1.0, 0.0)
    shares = sorted(((low - first) / (last - first), (high - first) / (last - first)))
    return max(shares[0], 0.0), min(shares[1], 1.0)
