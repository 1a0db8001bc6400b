"""Walls, doors and the unknown of a maze that is drawn in pixels, in whatever frame its format has."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.formats.format import Sketch, Source, TextPlace
from sim.formats.image import MOST_EDGES, areas, outlines
from sim.free_space import Flags
from sim.geometry import distances
from sim.maze import Goal, Leave, Maze, MazeDoor, Point, Segments, Start, merge_collinear
from transport.arithmetic import halfway

DOOR_SLOT = 0.06
"""A door slides along a wall if it is as near to it as this, m."""
MOST_DOORS = 100
"""In images with more grey areas, grey does not mean doors."""


@dataclass(frozen=True, slots=True)
class PixelFrame:
    """From pixel corners (column, row) to metres.

    Attributes:
        rows: of the image.
        columns: of the image.
        metres_a_pixel: edge of a pixel, m.
        anchor: column and row of the corner that lies at ``origin``.
        origin: where the anchor lies in the maze, m.
        axis: direction in the maze of a step from column to column; a unit vector. A step from row to row, downwards,
            points to the right of it.
    """

    rows: int
    columns: int
    metres_a_pixel: float
    anchor: Point
    origin: Point = (0.0, 0.0)
    axis: Point = (1.0, 0.0)

    def points(self, corners: NDArray[np.float64]) -> NDArray[np.float64]:
        """Corners of pixels, shape (n, 2): column and row, as points of the maze, m, the same shape."""
        along = (corners[:, 0] - self.anchor[0]) * self.metres_a_pixel
        up = (self.anchor[1] - corners[:, 1]) * self.metres_a_pixel
        (ex, ey), (x, y) = self.axis, self.origin
        return np.stack([x + along * ex - up * ey, y + along * ey + up * ex], axis=1)

    def segments(self, pixels: Segments) -> Segments:
        """Segments between corners of pixels as segments in the maze, shape (n, 4)."""
        return np.hstack([self.points(pixels[:, :2]), self.points(pixels[:, 2:])])

    def pixel(self, point: Point) -> TextPlace:
        """Row and column, from 1, of the pixel at a point of the maze, or of the nearest one."""
        column, row = self.corner(point)
        row, column = math.floor(row), math.floor(column)
        return min(max(row, 0), self.rows - 1) + 1, min(max(column, 0), self.columns - 1) + 1

    def corner(self, point: Point) -> Point:
        """Column and row, with fractions, of a point of the maze."""
        (ex, ey), dx, dy = self.axis, point[0] - self.origin[0], point[1] - self.origin[1]
        along, up = dx * ex + dy * ey, dy * ex - dx * ey
        return self.anchor[0] + along / self.metres_a_pixel, self.anchor[1] - up / self.metres_a_pixel


@dataclass(frozen=True, slots=True, eq=False)
class Raster:
    """The kind of each pixel; all other pixels are free. All of shape (rows, columns).

    Attributes:
        wall: walls.
        door: doors, one for each connected piece.
        unknown: unknown pixels.
        frame: where they are.
    """

    wall: Flags
    door: Flags
    unknown: Flags
    frame: PixelFrame


def sketch(source: Source, raster: Raster, start: Start, goal: Goal | None = None) -> Sketch:
    """The maze in a raster.

    Args:
        source: where it comes from.
        raster: the pixels.
        start: where the robot is placed.
        goal: the goal, by default to leave.

    Raises:
        MazeError: there is no wall, there are too many doors, or the areas are frayed as in a photograph.
    """
    frame = raster.frame
    walls = _merged(source, outlines(raster.wall), frame)
    maze = Maze(
        name=source.path.stem,
        walls=walls,
        start=start,
        doors=_doors(source, raster, walls),
        unknown=_merged(source, outlines(raster.unknown, ~raster.wall & ~raster.unknown), frame),
        goal=goal or Leave(),
    )
    return Sketch(maze, frame.pixel, may_be_closed=True)


def _merged(source: Source, edges: Segments, frame: PixelFrame) -> Segments:
    if len(edges) > MOST_EDGES:
        raise source.error(
            f"the outline of its areas has {len(edges)} pixels; the limit is {MOST_EDGES}",
            hint="is it a photograph, or noise?",
        )
    return frame.segments(merge_collinear(edges))


def _doors(source: Source, raster: Raster, walls: Segments) -> tuple[MazeDoor, ...]:
    pieces = areas(raster.door)
    if len(pieces) > MOST_DOORS:
        raise source.error(
            f"the image has {len(pieces)} grey areas, each of which would be a door; the limit is {MOST_DOORS}",
            hint="`--grey unknown` for the map of a mapping tool, `--grey split` for an image with soft edges",
        )
    leaves = [_towards_wall(_axis(rows, columns, raster.frame), walls) for rows, columns in pieces]
    return tuple(MazeDoor(f"door{number}", leaf) for number, leaf in enumerate(leaves, start=1))


def _towards_wall(leaf: tuple[Point, Point], walls: Segments) -> tuple[Point, Point]:
    """The ends of a door in such an order that it slides along more of a wall; as they are if both sides are equal."""
    if len(walls) == 0:
        return leaf
    (ax, ay), (bx, by) = leaf
    part = np.linspace(0.1, 1.0, 10)[:, None]
    ahead, back = ([bx, by] + part * [bx - ax, by - ay], [ax, ay] - part * [bx - ax, by - ay])
    near = [int((distances(points, walls).min(axis=1) < DOOR_SLOT).sum()) for points in (ahead, back)]
    return leaf if near[0] >= near[1] else (leaf[1], leaf[0])


def _axis(rows: NDArray[np.intp], columns: NDArray[np.intp], frame: PixelFrame) -> tuple[Point, Point]:
    """The two ends of a door: the area's principal axis, as long as the area's corners reach along it."""
    centres = frame.points(np.stack([columns + 0.5, rows + 0.5], axis=1))
    middle = centres.mean(axis=0)
    spread = centres - middle
    along, across = spread[:, 0], spread[:, 1]
    twice = float((along * along).sum() - (across * across).sum()), 2.0 * float((along * across).sum())
    direction = np.array(halfway(*twice))
    direction[np.abs(direction) < 1e-9] = 0.0
    corners = np.concatenate([frame.points(np.stack([columns + i, rows + j], axis=1)) for i in (0, 1) for j in (0, 1)])
    reach = ((corners - middle) * direction).sum(axis=1)
    first, second = middle + reach.min() * direction, middle + reach.max() * direction
    return (float(first[0]), float(first[1])), (float(second[0]), float(second[1]))
