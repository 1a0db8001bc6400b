"""Heightmap images (PNG, PGM): white is free, black is wall, grey is a door.

Frame: the origin is the centre of the image, x points up, y points left. A pixel is a square; walls are the exact
outlines of the black pixels, so nothing is shifted by a pixel or by half of one. The robot starts at the origin and
faces up.
"""

from __future__ import annotations

import io
import math

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from sim.formats.format import CannotHoldError, Format, Place, Scale, Sketch, Source
from sim.free_space import Flags, FreeSpace, flood
from sim.geometry import distances
from sim.maze import Door, Maze, Point, Segments, merge_collinear

WALL_BELOW = 50
"""Pixels darker than this are walls."""
DOOR_UP_TO = 205
"""Pixels from the walls' limit up to this grey, inclusive, are doors; lighter ones are free."""

DOOR_SLOT = 0.06
"""A door slides along a wall if it is as near to it as this, m."""


def recognises(source: Source) -> bool:
    """Whether a file is a PNG or a PGM image."""
    return source.content.startswith((b"\x89PNG\r\n\x1a\n", b"P5", b"P2"))


def read(source: Source, scale: Scale) -> Sketch:
    """A heightmap image as a maze without exits; those are found from the walls.

    Raises:
        MazeError: the image cannot be decoded, or has neither wall nor door.
    """
    try:
        with Image.open(io.BytesIO(source.content)) as image:
            grey = np.asarray(_on_white(image))
    except (UnidentifiedImageError, Image.DecompressionBombError, OSError, ValueError, SyntaxError) as error:
        raise source.error(f"the image cannot be decoded: {error}") from None
    wall = grey < WALL_BELOW
    if not wall.any():
        raise source.error("the image has no wall", hint=f"walls are pixels darker than {WALL_BELOW}")
    frame = _Frame(grey.shape[0], grey.shape[1], scale.metres_a_pixel)
    walls = frame.segments(merge_collinear(outlines(wall)))
    doors = tuple(_doors((grey >= WALL_BELOW) & (grey <= DOOR_UP_TO), frame, walls))
    return Sketch(Maze(name=source.path.stem, walls=walls, doors=doors), frame.pixel)


def _on_white(image: Image.Image) -> Image.Image:
    if image.has_transparency_data:
        white = Image.new("RGBA", image.size, "white")
        white.alpha_composite(image.convert("RGBA"))
        return white.convert("L")
    if image.mode.startswith("I"):
        deep = np.asarray(image, dtype=np.int64)
        return Image.fromarray((deep >> 8 if deep.max() > 255 else deep).astype(np.uint8))
    return image.convert("L")


def outlines(mask: Flags) -> Segments:
    """The edges between marked and other pixels; the outside of the image counts as not marked.

    Args:
        mask: shape (rows, columns).

    Returns:
        Segments in pixels: column and row of the corners, one pixel long each, shape (n, 4).
    """
    padded = np.pad(mask, 1)
    rows, columns = np.nonzero(padded[1:, :] != padded[:-1, :])
    level = np.stack([columns - 1, rows, columns, rows], axis=1)
    rows, columns = np.nonzero(padded[:, 1:] != padded[:, :-1])
    upright = np.stack([columns, rows - 1, columns, rows], axis=1)
    return np.concatenate([level, upright]).astype(np.float64)


class _Frame:
    """From pixel corners (column, row) to metres."""

    def __init__(self, rows: int, columns: int, metres_a_pixel: float) -> None:
        self._rows, self._columns, self._scale = rows, columns, metres_a_pixel

    def points(self, corners: NDArray[np.float64]) -> NDArray[np.float64]:
        x = (self._rows / 2 - corners[:, 1]) * self._scale
        y = (self._columns / 2 - corners[:, 0]) * self._scale
        return np.stack([x, y], axis=1)

    def pixel(self, point: Point) -> Place:
        row = math.floor(self._rows / 2 - point[0] / self._scale)
        column = math.floor(self._columns / 2 - point[1] / self._scale)
        return min(max(row, 0), self._rows - 1) + 1, min(max(column, 0), self._columns - 1) + 1

    def segments(self, pixels: Segments) -> Segments:
        return np.hstack([self.points(pixels[:, :2]), self.points(pixels[:, 2:])])


def _doors(grey: Flags, frame: _Frame, walls: Segments) -> list[Door]:
    doors: list[Door] = []
    remaining = grey.copy()
    while remaining.any():
        seed = np.zeros_like(remaining)
        row, column = np.argwhere(remaining)[0]
        seed[row, column] = True
        blob = _connected(remaining, seed)
        remaining &= ~blob
        doors.append(Door(f"door{len(doors) + 1}", _towards_wall(_axis(blob, frame), walls)))
    return doors


def _towards_wall(leaf: tuple[Point, Point], walls: Segments) -> tuple[Point, Point]:
    """The ends of a door in such an order that it slides along more of a wall; as they are if both sides are equal."""
    (ax, ay), (bx, by) = leaf
    part = np.linspace(0.1, 1.0, 10)[:, None]
    ahead, back = ([bx, by] + part * [bx - ax, by - ay], [ax, ay] - part * [bx - ax, by - ay])
    near = [int((distances(points, walls).min(axis=1) < DOOR_SLOT).sum()) for points in (ahead, back)]
    return leaf if near[0] >= near[1] else (leaf[1], leaf[0])


def _connected(mask: Flags, seed: Flags) -> Flags:
    """The pixels of the mask that hang together with the seed by an edge or a corner."""
    blob = seed
    while True:
        padded = np.pad(blob, 1)
        grown = np.zeros_like(padded)
        for rows in (-1, 0, 1):
            for columns in (-1, 0, 1):
                grown |= np.roll(padded, (rows, columns), axis=(0, 1))
        touched = flood(mask, grown[1:-1, 1:-1]) >= 0
        if (touched == blob).all():
            return blob
        blob = touched


def _axis(blob: Flags, frame: _Frame) -> tuple[Point, Point]:
    """The two ends of a door: the blob's principal axis, as long as the blob's corners reach along it."""
    rows, columns = np.nonzero(blob)
    centres = frame.points(np.stack([columns + 0.5, rows + 0.5], axis=1))
    middle = centres.mean(axis=0)
    spread = centres - middle
    angle = 0.5 * math.atan2(
        2.0 * float((spread[:, 0] * spread[:, 1]).sum()),
        float((spread[:, 0] ** 2).sum() - (spread[:, 1] ** 2).sum()),
    )
    direction = np.array([math.cos(angle), math.sin(angle)])
    direction[np.abs(direction) < 1e-9] = 0.0
    corners = np.concatenate([frame.points(np.stack([columns + i, rows + j], axis=1)) for i in (0, 1) for j in (0, 1)])
    from_middle = corners - middle
    reach = from_middle[:, 0] * direction[0] + from_middle[:, 1] * direction[1]
    first, second = middle + reach.min() * direction, middle + reach.max() * direction
    return (float(first[0]), float(first[1])), (float(second[0]), float(second[1]))


WALL, DOOR, FREE = 0, 120, 255
HALF_THICKNESS = 1.0
"""Walls are drawn so that pixels are black whose centres are as near to them as this, in pixels."""


def draw(maze: Maze, metres_a_pixel: float) -> NDArray[np.uint8]:
    """A maze as a heightmap, moved so that the robot starts at the image's centre and faces up.

    Args:
        maze: a maze without moving objects, which an image cannot hold.
        metres_a_pixel: edge of a pixel, m.

    Returns:
        Grey values, shape (rows, columns).
    """
    pose = maze.start.pose
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)

    def moved(segments: Segments) -> Segments:
        x, y = (segments.reshape(-1, 2) - [pose.x, pose.y]).T
        return np.stack([cos * x + sin * y, cos * y - sin * x], axis=1).reshape(-1, 4)

    walls = moved(maze.walls)
    leaves = moved(np.asarray([[*door.leaf[0], *door.leaf[1]] for door in maze.doors]).reshape(-1, 4))
    reach = HALF_THICKNESS * metres_a_pixel
    # One white pixel about everything that is black.
    half = np.ceil(np.abs(walls.reshape(-1, 2)).max(axis=0) / metres_a_pixel).astype(int) + 2
    rows, columns = int(2 * half[0]), int(2 * half[1])
    lowest = ((0.5 - half[0]) * metres_a_pixel, (0.5 - half[1]) * metres_a_pixel)
    image = np.full((rows, columns), FREE, dtype=np.uint8)
    for segments, grey in ((leaves, DOOR), (walls, WALL)):
        space = FreeSpace.on_grid(segments, lowest, (columns, rows), limit=2 * reach, step=metres_a_pixel)
        image[space.clearance.T[::-1, ::-1] <= reach] = grey
    return image


def write(maze: Maze, suffix: str, scale: Scale) -> bytes:
    """A maze as an image file; see `draw`.

    Raises:
        CannotHoldError: the maze has moving objects or several starts.
    """
    if maze.objects or maze.others:
        raise CannotHoldError("it has moving objects or several starts")
    buffer = io.BytesIO()
    Image.fromarray(draw(maze, scale.metres_a_pixel)).save(buffer, "PNG" if suffix == ".png" else "PPM")
    return buffer.getvalue()


FORMAT = Format("heightmap", (".png", ".pgm"), recognises, read, write)
