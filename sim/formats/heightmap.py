"""Heightmap images: white is free, black is wall, grey is a door.

Frame: the origin is the centre of the image, x points up, y points left. A pixel is a square; walls are the exact
outlines of the black pixels, so nothing is shifted by a pixel or by half of one. The robot starts at the origin and
faces up.

An image with just the three values that mapping tools write is such a tool's map: see `sim.formats.ros_map`.
"""

from __future__ import annotations

import io
import math

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from sim.formats import ros_map
from sim.formats.format import METRES_A_PIXEL, CannotHoldError, Choices, Format, Grey, Sketch, Source
from sim.formats.image import MOST_PIXELS, decoded, is_image
from sim.formats.raster import PixelFrame, Raster, sketch
from sim.free_space import DistanceGrid
from sim.maze import Leave, Maze, Segments, Start
from transport.arithmetic import cos_sin

WALL_BELOW = 50
"""Pixels darker than this are walls."""
DOOR_UP_TO = 205
"""Pixels from the walls' limit up to this grey, inclusive, are doors; lighter ones are free."""
MIDDLE = 128
"""Where grey is split, pixels darker than this are walls and all others are free."""


def read(source: Source, choices: Choices) -> Sketch:
    """A heightmap image as a maze without exits; those are found from the walls.

    Raises:
        MazeError: the image cannot be decoded, or has no wall or too many doors.
    """
    metres_a_pixel = choices.metres_a_pixel or ros_map.saved_resolution(source) or METRES_A_PIXEL
    picture = decoded(source, metres_a_pixel)
    if choices.grey is None and ros_map.is_saved(picture):
        return ros_map.read_alone(source, picture, choices)
    grey = picture.grey
    split = choices.grey is Grey.SPLIT
    wall = grey < (MIDDLE if split else WALL_BELOW)
    if not wall.any():
        raise source.error("the image has no wall", hint=f"walls are pixels darker than {WALL_BELOW}")
    between = (grey >= WALL_BELOW) & (grey <= DOOR_UP_TO)
    nowhere = np.zeros_like(wall)
    door = nowhere if split or choices.grey is Grey.UNKNOWN else between
    unknown = between if choices.grey is Grey.UNKNOWN else nowhere
    rows, columns = wall.shape
    # A step to the right goes along -y, a step upwards along x.
    frame = PixelFrame(rows, columns, metres_a_pixel, (columns / 2, rows / 2), axis=(0.0, -1.0))
    return sketch(source, Raster(wall, door, unknown, frame), Start())


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
    cos, sin = cos_sin(pose.heading)

    def moved(segments: Segments) -> Segments:
        x, y = (segments.reshape(-1, 2) - [pose.x, pose.y]).T
        return np.stack([cos * x + sin * y, cos * y - sin * x], axis=1).reshape(-1, 4)

    walls = moved(maze.walls)
    leaves = moved(np.asarray([[*door.leaf[0], *door.leaf[1]] for door in maze.doors]).reshape(-1, 4))
    reach = HALF_THICKNESS * metres_a_pixel
    # One white pixel around everything that is black.
    half = np.ceil(np.abs(walls.reshape(-1, 2)).max(axis=0) / metres_a_pixel).astype(int) + 2
    rows, columns = int(2 * half[0]), int(2 * half[1])
    lowest = ((0.5 - half[0]) * metres_a_pixel, (0.5 - half[1]) * metres_a_pixel)
    image = np.full((rows, columns), FREE, dtype=np.uint8)
    for segments, grey in ((leaves, DOOR), (walls, WALL)):
        space = DistanceGrid.on_grid(segments, lowest, (columns, rows), limit=2 * reach, step=metres_a_pixel)
        image[space.clearance.T[::-1, ::-1] <= reach] = grey
    return image


def write(maze: Maze, suffix: str, choices: Choices) -> bytes:
    """A maze as an image file; see `draw`.

    Raises:
        CannotHoldError: the maze has moving objects, several starts, something unknown or another goal than to leave,
            or the image would be too large to be read again.
    """
    if maze.objects or maze.others:
        raise CannotHoldError("it has moving objects or several starts")
    if len(maze.unknown) or maze.goal != Leave():
        raise CannotHoldError("it has something unknown or another goal than to leave")
    metres_a_pixel = choices.metres_a_pixel or METRES_A_PIXEL
    left, bottom, right, top = maze.bounds
    # The start is in the middle of the image.
    pixels = math.prod(2 * max(length, metres_a_pixel) / metres_a_pixel for length in (right - left, top - bottom))
    if pixels > MOST_PIXELS:
        raise CannotHoldError(f"at {metres_a_pixel:g} m a pixel it would have up to {pixels / 1e6:.0f} million pixels")
    buffer = io.BytesIO()
    Image.fromarray(draw(maze, metres_a_pixel)).save(buffer, "PNG" if suffix == ".png" else "PPM")
    return buffer.getvalue()


FORMAT = Format("heightmap", (".png", ".pgm"), is_image, read, write)
