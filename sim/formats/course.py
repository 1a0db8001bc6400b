"""The JSON file beside a map of the course's simulator: moving objects and the robot's start.

``objects`` are boxes with ``length`` along x, ``width`` along y, ``init_pose`` and ``final_pose`` (x, y, heading),
``velocity``, ``trigger_radius`` and ``repeat``; without velocity a box does not move. ``initial_pose`` is the robot's.
The file's other keys choose noise, speed limits and what the simulator shows; here those are settings of the
simulator, and the keys are not read.
"""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from sim.formats.format import Source
from sim.maze import LARGEST_COORDINATE, Maze, MovingObject, Point, Start
from transport.arithmetic import cos_sin
from transport.messages import Pose
from transport.wording import in_words

LARGEST = 1_000_000
"""The largest file, bytes."""

Coordinate = Annotated[float, Field(ge=-LARGEST_COORDINATE, le=LARGEST_COORDINATE)]
Length = Annotated[float, Field(gt=0, le=LARGEST_COORDINATE)]
Where = tuple[Coordinate, Coordinate, Coordinate]


class _Read(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore")


class _Object(_Read):
    length: Length
    width: Length
    trigger_radius: Annotated[float, Field(ge=0, allow_inf_nan=False)]
    velocity: Annotated[float, Field(ge=0, le=100)]
    repeat: bool
    init_pose: Where
    final_pose: Where


class _Config(_Read):
    objects: Annotated[tuple[_Object, ...], Field(max_length=100)] = ()
    initial_pose: Where | None = None


def furnished(maze: Maze, source: Source) -> Maze:
    """A maze with the objects of such a file in it, and the robot where the file puts it.

    Raises:
        MazeError: the file is malformed.
    """
    if len(source.content) > LARGEST:
        raise source.error(f"is longer than the limit of {LARGEST} bytes")
    try:
        config = _Config.model_validate(json.loads("\n".join(source.lines)))
    except json.JSONDecodeError as error:
        raise source.error(f"is not JSON: {error.msg}", error.lineno, error.colno) from None
    except ValidationError as error:
        raise source.error(in_words(error.errors()[0])) from None
    except (RecursionError, ValueError) as error:
        raise source.error(f"is not JSON: {type(error).__name__}") from None
    objects = tuple(_object(number, said) for number, said in enumerate(config.objects, start=1))
    start = maze.start
    if config.initial_pose is not None:
        start = Start(Pose(*config.initial_pose))
    return replace(maze, objects=maze.objects + objects, start=start)


def _object(number: int, said: _Object) -> MovingObject:
    (x, y, heading), (to_x, to_y, _) = said.init_pose, said.final_pose
    cos, sin = cos_sin(heading)
    length, width = said.length / 2, said.width / 2
    outline: tuple[Point, ...] = tuple(
        (cos * u - sin * v, sin * u + cos * v)
        for u, v in ((length, -width), (length, width), (-length, width), (-length, -width))
    )
    name = f"object{number}"
    if not said.velocity or (x, y) == (to_x, to_y):
        return MovingObject(name, outline, ((x, y),))
    return MovingObject(name, outline, ((x, y), (to_x, to_y)), said.velocity, said.trigger_radius, said.repeat)


def is_config(source: Source) -> bool:
    """Whether a file is a JSON object."""
    return source.content.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")
