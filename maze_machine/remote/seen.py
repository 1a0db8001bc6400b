"""What perception found, as a machine elsewhere says it: read strictly, since a page draws it."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

LARGEST = 400
"""The most cells along a side of a minimap."""
MOST = 20_000
"""The most points of a map, or of anything else."""

_Point = tuple[FiniteFloat, FiniteFloat]
_Triple = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
_Line = tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore", strict=True)


class _Minimap(_Part):
    size: Annotated[int, Field(ge=0, le=LARGEST)]
    cell: FiniteFloat
    turn: FiniteFloat
    rows: Annotated[tuple[Annotated[str, Field(max_length=LARGEST)], ...], Field(max_length=LARGEST)]


class _Map(_Part):
    poses: Annotated[tuple[_Point, ...], Field(max_length=MOST)]
    points: Annotated[tuple[_Point, ...], Field(max_length=MOST)]
    ellipse: _Triple
    knowledge: Annotated[str, Field(max_length=100)] = ""


class _Sights(_Part):
    """The keys of ``maze_machine.drive.sights.sights``, and where the robot was."""

    at: _Triple
    pose: _Triple
    landmarks: Annotated[tuple[_Line, ...], Field(max_length=MOST)] = ()
    nodes: Annotated[tuple[tuple[FiniteFloat, FiniteFloat, str], ...], Field(max_length=MOST)] = ()
    ways: Annotated[tuple[tuple[_Point, ...], ...], Field(max_length=100)] = ()
    door: _Line | None = None
    minimap: _Minimap | None = None
    map: _Map | None = None


def read_sights(answer: bytes) -> dict[str, Any]:
    """What an answer says; empty where it is invalid, or says nothing."""
    try:
        return _Sights.model_validate_json(answer).model_dump(exclude_none=True, mode="json")
    except ValidationError:
        return {}
