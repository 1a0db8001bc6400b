"""What every section of a robot profile is made of."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Point = tuple[float, float]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class Settings(BaseModel):
    """A section of a robot profile: immutable, every key documented, an unknown key refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)
