"""What is wrong with a value is told in words, without a library's own."""

from enum import StrEnum
from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from transport.wording import in_words


class Colour(StrEnum):
    RED = "red"


class Inner(BaseModel):
    size: Annotated[float, Field(gt=0, le=10)] = 1.0


class Sample(BaseModel):
    model_config = ConfigDict(extra="forbid")
    speed: Annotated[float, Field(ge=0, lt=5)] = 0.0
    finite: Annotated[float, Field(allow_inf_nan=False)] = 0.0
    count: int = 0
    on: bool = False
    name: str = ""
    keys: Literal["bridge", "rmw"] = "bridge"
    colour: Colour = Colour.RED
    inner: Inner = Inner()
    place: tuple[float, float] = (0.0, 0.0)
    must: int
    code: Annotated[str, Field(pattern="^[0-9]+$")] = "1"

    @field_validator("name")
    @classmethod
    def _no_slash(cls, name: str) -> str:
        if "/" in name:
            raise ValueError("holds a slash")
        return name


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"speed": -1}, "`speed` must be at least 0, not -1"),
        ({"speed": 7.5}, "`speed` must be less than 5, not 7.5"),
        ({"speed": "fast"}, "`speed` must be a number, not 'fast'"),
        ({"speed": [1]}, "`speed` must be a number, not [1]"),
        ({"finite": float("inf")}, "`finite` must be a finite number, not inf"),
        ({"count": "1.5"}, "`count` must be a whole number, not '1.5'"),
        ({"count": 1.5}, "`count` must be a whole number, not 1.5"),
        ({"on": "maybe"}, "`on` must be true or false, not 'maybe'"),
        ({"name": 3}, "`name` must be a text, not 3"),
        ({"name": "a/b"}, "`name` holds a slash"),
        ({"keys": "ros"}, "`keys` must be one of 'bridge' or 'rmw', not 'ros'"),
        ({"colour": "blue"}, "`colour` must be one of 'red', not 'blue'"),
        ({"inner": {"size": 0}}, "`inner.size` must be more than 0, not 0"),
        ({"inner": {"size": 11}}, "`inner.size` must be at most 10, not 11"),
        ({"inner": 3}, "`inner` must be a section, not 3"),
        ({"place": 3}, "`place` must be several values, not 3"),
        ({"place": (1, "x")}, "`place.1` must be a number, not 'x'"),
        ({"sped": 1}, "`sped` is not known"),
        ({"code": "x"}, "`code` must match ^[0-9]+$, not 'x'"),
    ],
)
def test_a_finding_is_one_sentence(given, told):
    with pytest.raises(ValidationError) as caught:
        Sample.model_validate({"must": 1, **given})
    assert in_words(caught.value.errors()[0]) == told


def test_what_is_missing_is_told():
    with pytest.raises(ValidationError) as caught:
        Sample.model_validate({})
    assert in_words(caught.value.errors()[0]) == "`must` is missing"
