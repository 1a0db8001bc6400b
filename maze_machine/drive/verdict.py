"""A referee's verdict from a robot's side, possibly from another program."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from transport.wording import in_words

_Text = Annotated[str, Field(max_length=1000)]
_Texts = Annotated[list[_Text], Field(max_length=10_000)]
_Size = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]
_Count = Annotated[int, Field(ge=0, lt=2**63)]


class RunVerdict(BaseModel):
    """The fields of a verdict that are used; lengths in m, times in s. Others are passed through."""

    model_config = ConfigDict(frozen=True, extra="allow", strict=True)

    maze: _Text = ""
    seed: _Count = 0
    attempt: _Count = 1
    goal: _Text
    solved: bool
    escaped: bool
    outcome: _Text
    reason: _Text
    line: _Text
    time: _Size
    path_length: _Size
    clearance: _Size | None
    doors_opened: _Texts
    contacts: _Texts
    rings: _Count = 0


def readable(reports: Iterable[Mapping[str, object]]) -> list[dict[str, Any]]:
    """Those verdicts that can be read."""
    return [verdict for verdict, unread in map(read_verdict, reports) if not unread]


def read_verdict(report: Mapping[str, object]) -> tuple[dict[str, Any], str]:
    """A valid verdict, empty if there is none; and why the received one is invalid, or nothing."""
    if not report:
        return {}, ""
    try:
        return RunVerdict.model_validate(dict(report)).model_dump(), ""
    except ValidationError as error:
        return {}, in_words(error.errors()[0])
