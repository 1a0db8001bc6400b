"""What every section of a robot profile is made of."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]
"""A measure that makes sense."""
NotNegative = Annotated[float, Field(ge=0, le=1e6, allow_inf_nan=False)]
Coordinate = Annotated[float, Field(ge=-10, le=10, allow_inf_nan=False)]
"""A place on a robot, m from its origin."""
Finite = Annotated[float, Field(allow_inf_nan=False)]
Angle = Annotated[float, Field(ge=-6.2832, le=6.2832, allow_inf_nan=False)]
"""A direction, rad, at most a whole turn."""
Point = tuple[Coordinate, Coordinate]
Period = Annotated[float, Field(ge=0.001, le=10, allow_inf_nan=False)]
"""A time from one step to the next, s; shorter or longer ones would never end."""


class Settings(BaseModel):
    """A section of a robot profile: immutable, every key documented, an unknown key refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


ROBOT_NAME = r"^[A-Za-z][A-Za-z0-9_-]*(/[A-Za-z][A-Za-z0-9_-]*)*$"
"""What a robot may be called on a network, as a regular expression."""
_NAME = re.compile(ROBOT_NAME)


def is_network_name(name: str) -> bool:
    """Whether a robot can be called so on a network: letters, digits, - and _, a letter first; parts divided by /."""
    return bool(_NAME.fullmatch(name))
