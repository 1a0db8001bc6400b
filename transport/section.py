"""What every section of a robot profile is made of."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Point = tuple[float, float]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class Settings(BaseModel):
    """A section of a robot profile: immutable, every key documented, an unknown key refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)


ROBOT_NAME = r"^[A-Za-z][A-Za-z0-9_-]*(/[A-Za-z][A-Za-z0-9_-]*)*$"
"""What a robot may be called on a network, as a regular expression."""
_NAME = re.compile(ROBOT_NAME)


def is_network_name(name: str) -> bool:
    """Whether a robot can be called so on a network: letters, digits, - and _, a letter first; parts divided by /."""
    return bool(_NAME.fullmatch(name))
