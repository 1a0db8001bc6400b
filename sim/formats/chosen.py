"""A maze with the start, the exits and the goal that its user has chosen in place of the file's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sim.formats.format import Choices
from sim.maze import Leave, Maze, Point, Segments, Survive
from transport.arithmetic import norm

OPENED = 0.3
"""Walls within this distance of a chosen exit are removed, m: both faces of a wall with the exit at either of them."""
END = 1e-6
"""Walls at its ends stay, m."""
ALONG = 0.9
"""Walls whose angle to the exit has at least this cosine are the wall that the exit leads through."""


def chosen(maze: Maze, choices: Choices) -> Maze:
    """The maze as chosen.

    Chosen exits replace the file's, which are closed, and walls and edges of the unknown are removed along them. A
    thick wall keeps its ends there: nothing leads into it. An exit without a goal means that the robot is to leave.
    """
    if choices.start is not None:
        maze = replace(maze, start=choices.start)
    if choices.exits:
        walls, unknown = np.concatenate([maze.walls, maze.exits]), maze.unknown
        for gate in choices.exits:
            ends = jambs(walls, gate)
            walls, unknown = np.concatenate([opened(walls, gate), ends]), opened(unknown, gate)
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
    kept: list[tuple[float, float, float, float]] = []
    for piece in segments.tolist():
        ax, ay, bx, by = piece
        enters, leaves = _inside(piece, gate)
        if enters >= leaves:
            kept.append((ax, ay, bx, by))
            continue
        dx, dy = bx - ax, by - ay
        if enters > 0.0:
            kept.append((ax, ay, ax + enters * dx, ay + enters * dy))
        if leaves < 1.0:
            kept.append((ax + leaves * dx, ay + leaves * dy, bx, by))
    return np.asarray(kept, dtype=np.float64).reshape(-1, 4)


def jambs(segments: Segments, gate: tuple[Point, Point]) -> Segments:
    """The ends of the wall that a gate leads through: across it at both ends of the gate, shape (2, 4) or (0, 4).

    They reach from face to face of the wall and to the gate, which may lie beside it. A thin wall along the gate has
    none.
    """
    length, (ex, ey) = _direction(gate)
    asides = [0.0]
    for piece in segments.tolist():
        ax, ay, bx, by = piece
        enters, leaves = _inside(piece, gate)
        if enters < leaves and abs((bx - ax) * ex + (by - ay) * ey) >= ALONG * norm(bx - ax, by - ay):
            asides += (_beside(ax + share * (bx - ax), ay + share * (by - ay), gate) for share in (enters, leaves))
    low, high = min(asides), max(asides)
    if high - low < END:
        return np.empty((0, 4))
    feet = (gate[0], (gate[0][0] + length * ex, gate[0][1] + length * ey))
    return np.asarray([(x - low * ey, y + low * ex, x - high * ey, y + high * ex) for x, y in feet])


def _direction(gate: tuple[Point, Point]) -> tuple[float, Point]:
    """The length of a gate, m, and its direction."""
    (gx, gy), (hx, hy) = gate
    length = norm(hx - gx, hy - gy)
    return length, ((hx - gx) / length, (hy - gy) / length)


def _beside(x: float, y: float, gate: tuple[Point, Point]) -> float:
    """How far a point lies to the left of a gate's line, m."""
    _, (ex, ey) = _direction(gate)
    return (y - gate[0][1]) * ex - (x - gate[0][0]) * ey


def _inside(piece: Sequence[float], gate: tuple[Point, Point]) -> tuple[float, float]:
    """From which to which share of its way a segment is removed for a gate; nothing if the first is not smaller."""
    ax, ay, bx, by = piece
    length, (ex, ey) = _direction(gate)
    gx, gy = gate[0]
    along = (ax - gx) * ex + (ay - gy) * ey, (bx - gx) * ex + (by - gy) * ey
    aside = _beside(ax, ay, gate), _beside(bx, by, gate)
    first, last = _within(along, END, length - END), _within(aside, -OPENED, OPENED)
    return max(first[0], last[0]), min(first[1], last[1])


def _within(ends: tuple[float, float], low: float, high: float) -> tuple[float, float]:
    """From which to which share of its way a value is within limits that goes evenly from one end to the other."""
    first, last = ends
    if first == last:
        return (0.0, 1.0) if low <= first <= high else (1.0, 0.0)
    shares = sorted(((low - first) / (last - first), (high - first) / (last - first)))
    return max(shares[0], 0.0), min(shares[1], 1.0)
