"""Maps of mapping tools as the ROS map server reads them: a ``.yaml`` file that describes an image.

Which pixels are walls, free or unknown follows Nav2's map server (nav2_map_server, ``loadMapFromFile``): a pixel's
occupancy is its darkness from 0 to 1, or its lightness where the map is negated; from ``occupied_thresh`` on it is a
wall, up to ``free_thresh`` it is free, anything between and anything transparent is unknown. In the mode ``raw`` the
pixel's value itself is its occupancy in per cent, and more than 100 is unknown. The mode ``scale`` has grades between
the thresholds; here they are unknown.

Frame: the map's own. The image's lower left corner lies at ``origin`` (x, y, yaw); where yaw is zero, columns go along
x.
"""

from __future__ import annotations

import math
import re
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from sim.formats.format import Choices, Format, Grey, Sketch, Source
from sim.formats.image import Picture, decoded, is_image
from sim.formats.raster import PixelFrame, Raster, sketch
from sim.free_space import Flags
from sim.geometry import distances
from sim.maze import Nothing, Start
from transport.arithmetic import cos_sin
from transport.messages import Pose
from transport.wording import in_words

LARGEST_DESCRIPTION = 4_000
"""The longest description, bytes."""
MOST_BRACKETS = 50
"""Nor are those with more brackets: the time that YAML takes grows with the square of their depth."""
SAVED_WALL, SAVED_UNKNOWN, SAVED_FREE = 0, 205, 254
"""The grey values that mapping tools save."""
SAVED_RESOLUTION = 0.05
"""Their default size of a pixel, m."""
ROOM = 0.3
"""The robot starts at the map's origin, or else in its middle, if nothing is nearer than this, m."""

Coordinate = Annotated[float, Field(ge=-1e4, le=1e4, allow_inf_nan=False)]
"""A coordinate, m, or an angle, rad: within 10 km of the origin, like a place in any other format."""
Share = Annotated[float, Field(ge=0, le=1)]


def _lower(word: object) -> object:
    """Nav2's map server reads a mode in any case."""
    return word.lower() if isinstance(word, str) else word


class Description(BaseModel):
    """The contents of the ``.yaml`` file; unlisted keys are ignored."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    image: Annotated[str, Field(min_length=1)]
    resolution: Annotated[float, Field(gt=0, allow_inf_nan=False)]
    origin: Annotated[tuple[Coordinate, ...], Field(min_length=2, max_length=3)]
    occupied_thresh: Share = 0.65
    free_thresh: Share = 0.196
    negate: bool = False
    mode: Annotated[Literal["trinary", "scale", "raw"], BeforeValidator(_lower)] = "trinary"

    @model_validator(mode="after")
    def _in_order(self) -> Description:
        if self.free_thresh > self.occupied_thresh:
            raise ValueError(
                f"`free_thresh` ({self.free_thresh:g}) must not be above `occupied_thresh` ({self.occupied_thresh:g})"
            )
        return self


def recognises(source: Source) -> bool:
    """Whether a file is text with the keys ``image`` and ``resolution`` in it, or is called ``.yaml``."""
    if is_image(source):
        return False
    if source.path.suffix in (".yaml", ".yml"):
        return True
    head = source.content[:LARGEST_DESCRIPTION]
    return all(re.search(rb"(?m)(?:^|[{,])\s*[\"']?" + key + rb"[\"']?\s*:", head) for key in (b"image", b"resolution"))


def read(source: Source, choices: Choices) -> Sketch:
    """A map with its image.

    Raises:
        MazeError: the description is wrong, or the image cannot be read.
    """
    description = describe(source)
    if choices.metres_a_pixel:
        description = description.model_copy(update={"resolution": choices.metres_a_pixel})
    image = Source.of(_image_file(source.path.parent, description.image))
    return _read(image, decoded(image, description.resolution), description, choices)


def image_of(source: Source) -> Path:
    """The image that a description names.

    Raises:
        MazeError: the description is wrong.
    """
    return _image_file(source.path.parent, describe(source).image)


def describe(source: Source) -> Description:
    """The description in a ``.yaml`` file.

    Raises:
        MazeError: it is invalid.
    """
    # Few runs need it, and its import is slow.
    from ruamel.yaml import YAML  # noqa: PLC0415
    from ruamel.yaml.error import YAMLError  # noqa: PLC0415

    if len(source.content) > LARGEST_DESCRIPTION or len(re.findall(rb"[\[{]", source.content)) > MOST_BRACKETS:
        raise source.error(
            f"is not a map's description: those have at most {LARGEST_DESCRIPTION} bytes and few brackets"
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            said: Any = YAML(typ="safe", pure=True).load("\n".join(source.lines))
    except YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        problem = getattr(error, "problem", None) or "cannot be understood"
        raise source.error(f"is not valid YAML: {problem}", mark.line + 1 if mark else None) from None
    except (RecursionError, ValueError) as error:
        raise source.error(f"is not valid YAML: {type(error).__name__}") from None
    if not isinstance(said, dict):
        raise source.error("does not describe a map", hint="`image: map.pgm`, `resolution: 0.05`, `origin: [0, 0, 0]`")
    try:
        return Description.model_validate(said)
    except ValidationError as error:
        raise source.error(in_words(error.errors()[0]), hint="it should describe a map of the ROS map server") from None


def _image_file(folder: Path, named: str) -> Path:
    """The image that a description names; one that has been moved with it is found beside it.

    A path of Windows is read as well.
    """
    if not (folder / named).is_file():
        named = named.replace("\\", "/")
    file = folder / Path(named).expanduser()
    beside = folder / Path(named).name
    return beside if not file.is_file() and beside.is_file() else file


def is_saved(picture: Picture) -> bool:
    """Whether an image has just the values that mapping tools save, the one for free pixels among them."""
    values = set(np.unique(picture.grey).tolist())
    # Outside of what was mapped, some tools leave white.
    white = {255} if SAVED_UNKNOWN in values else set()
    return SAVED_FREE in values and values <= {SAVED_WALL, SAVED_UNKNOWN, SAVED_FREE} | white


def saved_resolution(source: Source) -> float | None:
    """The metres per pixel in an image's comment by the map saver of ROS 1; None if there is none."""
    said = re.search(rb"# CREATOR: \S+ (\d*\.?\d+) m/pix", source.content[:200])
    return float(said[1]) or None if said else None


def read_alone(source: Source, picture: Picture, choices: Choices) -> Sketch:
    """The image of a map whose description is lost; one of the same name beside it is used.

    Without it, the lower left corner is the origin, and a pixel is what the image's comment says or `SAVED_RESOLUTION`.

    Raises:
        MazeError: the description beside it is wrong.
    """
    beside = source.path.with_suffix(".yaml")
    if beside.is_file():
        description = describe(Source.of(beside))
        if Path(description.image).name == source.path.name:
            return read(Source.of(beside), choices)
    resolution = choices.metres_a_pixel or saved_resolution(source) or SAVED_RESOLUTION
    return _read(source, picture, Description(image=source.path.name, resolution=resolution, origin=(0, 0)), choices)


def _read(source: Source, picture: Picture, description: Description, choices: Choices) -> Sketch:
    wall, free = occupied_and_free(picture, description)
    between = ~wall & ~free
    nowhere = np.zeros_like(wall)
    rows, columns = wall.shape
    x, y, yaw = (*description.origin, 0.0)[:3]
    frame = PixelFrame(rows, columns, description.resolution, (0.0, float(rows)), (x, y), cos_sin(yaw))
    match choices.grey:
        case Grey.DOOR:
            raster = Raster(wall, between, nowhere, frame)
        case Grey.SPLIT:
            raster = Raster(wall | (between & (_occupancy(picture, description) >= 0.5)), nowhere, nowhere, frame)
        case _:
            raster = Raster(wall, nowhere, between, frame)
    if not wall.any() and not raster.unknown.any():
        raise source.error("the map has neither walls nor anything unknown", hint="are its thresholds right?")
    drawn = sketch(source, raster, Start(), Nothing())
    return drawn if choices.start else _with_start(drawn, raster)


def _occupancy(picture: Picture, description: Description) -> np.ndarray[Any, np.dtype[np.float64]]:
    if description.mode == "raw":
        return picture.grey / 100.0
    lightness = picture.grey / 255.0
    return lightness if description.negate else 1.0 - lightness


def occupied_and_free(picture: Picture, description: Description) -> tuple[Flags, Flags]:
    """Which pixels are walls and which are free, each of shape (rows, columns)."""
    occupancy = _occupancy(picture, description)
    known = occupancy <= 1.0 if description.mode == "raw" else picture.opaque
    wall = known & (occupancy >= description.occupied_thresh)
    return wall, known & (occupancy <= description.free_thresh) & ~wall


def _with_start(drawn: Sketch, raster: Raster) -> Sketch:
    """The sketch with the robot at the map's origin, where mapping began, or else in the middle and facing up."""
    frame, maze = raster.frame, drawn.maze
    middle = frame.points(np.array([[frame.columns / 2, frame.rows / 2]]))[0]
    places = [Pose(), Pose(float(middle[0]), float(middle[1]), math.pi / 2)]
    for pose in places:
        row, column = (place - 1 for place in drawn.locate((pose.x, pose.y)) if place is not None)
        exact = frame.corner((pose.x, pose.y))
        inside = 0 <= exact[0] < frame.columns and 0 <= exact[1] < frame.rows
        free = not (raster.wall[row, column] or raster.unknown[row, column] or raster.door[row, column])
        if inside and free and float(distances(np.array([[pose.x, pose.y]]), maze.barriers).min()) >= ROOM:
            return replace(drawn, maze=replace(maze, start=Start(pose)))
    return replace(drawn, maze=replace(maze, start=Start(places[1])))


FORMAT = Format("ROS map", (".yaml", ".yml"), recognises, read, None)
