"""The file of a map: its fields, its text, and what makes it damaged.

It is JSON, laid out so that people can read it: the grid is a drawing, each keyframe and each link is a line. All is in
one frame, the map's, in metres and radians, x forward and y left.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from perception.mapping.information import Symmetric
from transport.files import read_at_most, write_text
from transport.wording import in_words, printable

FORMAT: Literal["maze-machine map"] = "maze-machine map"
VERSION: Literal[2] = 2
"""Of the files that are written; those of version 1, without junctions, are read, too."""
LARGEST = 64 * 1024 * 1024
"""A larger file is refused, bytes."""
FARTHEST = 1e5
"""No place is farther from the origin of the map, m."""
FINEST = 1e-6
"""No point is known better than this, m."""
MOST_CELLS = 4_000_000
"""The grid has no more cells than this."""
AROUND = 10.0
"""A place farther than this from the grid is not on the map, m."""
WALL, FREE, UNKNOWN = "#", ".", " "
"""The characters of the grid's drawing."""

Number = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False)]
Place = tuple[Number, Number]
Placed = tuple[Number, Number, Number]
"""x and y, m, and heading, rad."""
Marks = Annotated[int, Field(ge=0, le=1_000)]
Entry = Annotated[float, Field(ge=-1e15, le=1e15, allow_inf_nan=False)]


class MapError(ValueError):
    """A file that is not a map, or a damaged one; the message names the file and the fault."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class DoorPart(_Part):
    """A dead end that may be a door.

    Attributes:
        right: the end at the right hand of someone who faces it from inside.
        left: the other end.
    """

    right: Place
    left: Place


class JunctionPart(_Part):
    """A junction with its marks, as Tremaux's algorithm makes them.

    Attributes:
        place: of the robot when it was there last.
        marks: at the ways from it towards +x, +y, -x and -y.
    """

    place: Placed
    marks: tuple[Marks, Marks, Marks, Marks]


class GridPart(_Part):
    """Where the robot can drive, as a drawing.

    Attributes:
        cell: width of a cell, m.
        corner: column and row of the lower left cell, counted from the cell whose corner is the origin.
        rows: the cells, the row with the largest y first, columns along x: `#` a wall, `.` free, a space unknown.
    """

    cell: Annotated[float, Field(gt=0.005, le=10.0, allow_inf_nan=False)]
    corner: tuple[
        Annotated[int, Field(ge=-1_000_000, le=1_000_000)], Annotated[int, Field(ge=-1_000_000, le=1_000_000)]
    ]
    rows: Annotated[tuple[Annotated[str, Field(max_length=20_000)], ...], Field(max_length=20_000)]

    @field_validator("rows")
    @classmethod
    def _drawn(cls, rows: tuple[str, ...]) -> tuple[str, ...]:
        for number, row in enumerate(rows, 1):
            if len(row) != len(rows[0]):
                raise ValueError(f"has a row {number} of {len(row)} cells, where the first has {len(rows[0])}")
            if wrong := set(row) - {WALL, FREE, UNKNOWN}:
                raise ValueError(f"has {min(wrong)!r} in row {number}, where a cell is '#', '.' or a space")
        if rows and len(rows) * len(rows[0]) > MOST_CELLS:
            raise ValueError(f"has {len(rows) * len(rows[0])} cells, more than {MOST_CELLS}")
        return rows


class KeyframePart(_Part):
    """What was seen from one place.

    Attributes:
        pose: of the robot there.
        points: on walls, seen from there: x, y, direction of the wall's normal towards the robot, rad, and standard
            deviation of the point's place across the wall, m.
    """

    pose: Placed
    points: Annotated[
        tuple[tuple[Number, Number, Number, Annotated[float, Field(ge=FINEST, le=10.0, allow_inf_nan=False)]], ...],
        Field(max_length=20_000),
    ]


class LinkPart(_Part):
    """A measurement of one keyframe seen from another.

    Attributes:
        first: number of the keyframe from which it is seen, from 0.
        second: number of the one that is seen.
        pose: the second one in the frame of the first.
        information: the inverse of its covariance, with axes of the second one's frame: xx, xy, xt, yy, yt, tt.
    """

    first: Annotated[int, Field(ge=0)]
    second: Annotated[int, Field(ge=0)]
    pose: Placed
    information: tuple[Entry, Entry, Entry, Entry, Entry, Entry]

    @field_validator("information")
    @classmethod
    def _definite(cls, entries: tuple[float, ...]) -> tuple[float, ...]:
        if not Symmetric(*entries).definite:
            raise ValueError("must be that of a measurement: positive along every axis")
        return entries


class MapDocument(_Part):
    """A map as a file holds it.

    Attributes:
        format: what kind of file it is.
        version: of the format.
        robot: where the robot was when the map was saved; null where it did not know.
        way_out: a place outside, beyond where the robot has left the maze; null where it has not.
        doors: the dead ends that may be doors.
        junctions: those that the robot has marked on its way out, in the order in which it came to them; none where it
            has marked none, or has not left the maze.
        grid: where the robot can drive.
        keyframes: what was seen, in the order in which it was.
        steps: the link from each keyframe to the next.
        loops: the links between keyframes that show the same place.
    """

    format: Literal["maze-machine map"]
    version: Literal[1, 2]
    robot: Placed | None
    way_out: Place | None
    doors: Annotated[tuple[DoorPart, ...], Field(max_length=10_000)]
    junctions: Annotated[tuple[JunctionPart, ...], Field(max_length=10_000)] = ()
    grid: GridPart
    keyframes: Annotated[tuple[KeyframePart, ...], Field(min_length=1, max_length=50_000)]
    steps: Annotated[tuple[LinkPart, ...], Field(max_length=50_000)]
    loops: Annotated[tuple[LinkPart, ...], Field(max_length=200_000)]

    @model_validator(mode="after")
    def _linked(self) -> Self:
        count = len(self.keyframes)
        if len(self.steps) != count - 1:
            raise ValueError(f"the map has {count} keyframes and {len(self.steps)} steps, where {count - 1} join them")
        for number, step in enumerate(self.steps):
            if (step.first, step.second) != (number, number + 1):
                raise ValueError(f"`steps.{number}` must lead from keyframe {number} to {number + 1}")
        for name, (x, y) in self._places():
            if not self.covers(x, y):
                raise ValueError(f"`{name}` is far from all that the grid shows")
        for number, loop in enumerate(self.loops):
            if not loop.first < loop.second < count:
                raise ValueError(f"`loops.{number}` must lead from a keyframe to a later one, below {count}")
        return self

    def _places(self) -> Iterator[tuple[str, Place]]:
        """All places on the map, by the names of their fields."""
        for number, keyframe in enumerate(self.keyframes):
            yield f"keyframes.{number}", keyframe.pose[:2]
        for number, junction in enumerate(self.junctions):
            yield f"junctions.{number}", junction.place[:2]
        for number, door in enumerate(self.doors):
            yield f"doors.{number}.right", door.right
            yield f"doors.{number}.left", door.left
        if self.robot is not None:
            yield "robot", self.robot[:2]
        if self.way_out is not None:
            yield "way_out", self.way_out

    def covers(self, x: float, y: float) -> bool:
        """Whether a place is within the grid's drawing, or less than `AROUND` outside of it."""
        rows, (column, line), cell = self.grid.rows, self.grid.corner, self.grid.cell
        wide = len(rows[0]) if rows else 0
        left, low = column * cell - AROUND, line * cell - AROUND
        right, high = (column + wide) * cell + AROUND, (line + len(rows)) * cell + AROUND
        return left <= x <= right and low <= y <= high


def read_map(path: Path) -> MapDocument:
    """Read the file of a map.

    Raises:
        MapError: it is not a map, of another version, damaged or too large.
        OSError: it cannot be read, or is not a regular file.
    """
    content = read_at_most(path, LARGEST + 1)
    if len(content) > LARGEST:
        raise MapError(f"{path}: the map is larger than {LARGEST // 1024 // 1024} MiB")
    return parsed(content, str(path))


def parsed(content: bytes, name: str) -> MapDocument:
    """The map in the content of a file.

    Args:
        content: of the file.
        name: of the file, for the message.

    Raises:
        MapError: it is not a map, of another version, or damaged.
    """
    try:
        return MapDocument.model_validate_json(content)
    except ValidationError as error:
        raise MapError(f"{name}: {_fault(content, error)}") from None


def _fault(content: bytes, error: ValidationError) -> str:
    """What is wrong with a file, in one sentence."""
    found = error.errors(include_url=False)[0]
    if found["type"] == "json_invalid":
        reason = printable(str(found["ctx"]["error"]))
        return f"this is not a map, or a damaged one: {reason}" if FORMAT.encode() in content[:200] else _no_map()
    wrong = {one["loc"][:1]: one for one in error.errors(include_url=False)}
    if ("format",) in wrong or (not found["loc"] and found["type"] == "model_type"):
        return _no_map()
    if (version := wrong.get(("version",))) is not None and version["type"] != "missing":
        other = printable(repr(version["input"]))[:40]
        return f"the map is of version {other}, and this program reads versions 1 and {VERSION}"
    return f"the map is damaged: {in_words(found)}"


def _no_map() -> str:
    return "this is not a map (`maze-machine run --save-map FILE` writes one)"


def text_of(document: MapDocument) -> str:
    """The text of a map's file; reading it gives the map again, and writing that the same text."""
    said = document.model_dump(mode="json")
    grid, lists = said["grid"], ("doors", "junctions", "keyframes", "steps", "loops")
    lines = [f" {json.dumps(key)}: {json.dumps(said[key])}," for key in ("format", "version", "robot", "way_out")]
    drawing = _block("rows", grid["rows"], "  ")
    lines += [' "grid": {', f'  "cell": {grid["cell"]}, "corner": {json.dumps(grid["corner"])},', f"{drawing} }},"]
    blocks = [_block(key, said[key], " ") for key in lists]
    return "\n".join(["{", *lines, ",\n".join(blocks), "}", ""])


def _block(key: str, items: list[Any], indent: str) -> str:
    """A list with an item a line."""
    if not items:
        return f'{indent}"{key}": []'
    body = ",\n".join(f"{indent} {json.dumps(item)}" for item in items)
    return f'{indent}"{key}": [\n{body}]'


def write_map(path: Path, document: MapDocument) -> None:
    """Write a map's file, complete or not at all.

    Raises:
        OSError: it cannot be written.
    """
    write_text(path, text_of(document))
