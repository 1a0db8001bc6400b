"""The base class of all sections of a robot profile."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from transport.arithmetic import power

Positive = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]
"""A plausible length."""
NotNegative = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]
Coordinate = Annotated[float, Field(ge=-10, le=10, allow_inf_nan=False)]
"""A place on a robot, m from its origin."""
Finite = Annotated[float, Field(allow_inf_nan=False)]
Angle = Annotated[float, Field(ge=-6.2832, le=6.2832, allow_inf_nan=False)]
"""A direction, rad, at most a whole turn."""
Point = tuple[Coordinate, Coordinate]
Period = Annotated[float, Field(ge=0.001, le=10, allow_inf_nan=False)]
"""A time from one step to the next, s; shorter or longer ones would never end."""


def _topic(name: str) -> str:
    if len(name) > LONGEST_NAME or not _TOPIC.fullmatch(name):
        raise ValueError(f"must be a ROS name, such as `scan` or `/front/scan`, of at most {LONGEST_NAME} characters")
    return name


_TOPIC = re.compile(r"/?[A-Za-z_][A-Za-z0-9_-]*(/[A-Za-z_][A-Za-z0-9_-]*)*")
LONGEST_NAME = 100
"""The longest name on a network, in characters."""
Topic = Annotated[str, AfterValidator(_topic)]
"""The name of a topic, service or action of ROS."""


class Settings(BaseModel):
    """A section of a robot profile: immutable, every key documented, an unknown key refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    @model_validator(mode="before")
    @classmethod
    def _no_flag_for_a_number(cls, values: object) -> object:
        """``true`` would be read as 1."""
        for name, value in values.items() if isinstance(values, dict) else ():
            field = cls.model_fields.get(name)
            if field is not None and isinstance(value, bool) and field.annotation in (int, float):
                raise ValueError(f"must have a number for `{name}`, not {str(value).lower()}")
        return values


@dataclass(frozen=True, slots=True)
class Grows:
    """Marks a number that is given for the default robot and grows with the robot.

    Attributes:
        size: with which power of the robot's radius it grows.
        speed: with which power of its largest speed.
    """

    size: int = 0
    speed: int = 0


Length = Annotated[Positive, Grows(size=1)]
"""A length, m, that is given for the default robot and grows with the radius of the robot."""
Speed = Annotated[Positive, Grows(speed=1)]
"""A speed, m/s, that is given for the default robot and grows with the largest speed of the robot."""

_Section = TypeVar("_Section", bound=BaseModel)


def grown(section: _Section, size: float, speed: float) -> _Section:
    """A section for a robot of another size and speed: what is marked to grow does, all else stays.

    Nor does a value grow that was given, not left at its default.

    Args:
        section: as it is for the default robot.
        size: radius of the robot, as a multiple of the default robot's.
        speed: its largest speed, as a multiple.
    """
    changed: dict[str, object] = {}
    for name, field in type(section).model_fields.items():
        value = getattr(section, name)
        if isinstance(value, BaseModel):
            changed[name] = grown(value, size, speed)
        for mark in field.metadata:
            if isinstance(mark, Grows) and name not in section.model_fields_set:
                changed[name] = value * power(size, mark.size) * power(speed, mark.speed)
    return section.model_copy(update=changed)


ROBOT_NAME = r"^[A-Za-z][A-Za-z0-9_-]*(/[A-Za-z][A-Za-z0-9_-]*)*$"
"""The form of a robot's name on a network, as a regular expression."""
_NAME = re.compile(ROBOT_NAME)


def is_network_name(name: str) -> bool:
    """Whether this is a valid robot name on a network, at most `LONGEST_NAME` long.

    It consists of letters, digits, - and _, a letter first, and parts are divided by /.
    """
    return len(name) <= LONGEST_NAME and bool(_NAME.fullmatch(name))
