"""Recognises files that are not machines, so that one message names what they are and which command reads them."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple


class Foreign(NamedTuple):
    """A kind of file that is not a machine.

    Attributes:
        kind: what it is, for a person.
        advice: what to do instead.
    """

    kind: str
    advice: str


_WRITE = "write the machine as text: `maze-machine new FOLDER` creates one to start from"
_RECORDING = "`maze-machine replay`, `view` and `plot` read recordings"
_IMAGE = "a picture of a maze is given with `--maze`"

_MAGIC = (
    (b"\x89MCAP", Foreign("a recording (MCAP)", _RECORDING)),
    (b"SQLite format 3\x00", Foreign("a database (SQLite), such as a rosbag2 recording", _RECORDING)),
    (b"\x89PNG", Foreign("a picture (PNG)", _IMAGE)),
    (b"\xff\xd8\xff", Foreign("a picture (JPEG)", _IMAGE)),
    (b"%PDF-", Foreign("a document (PDF)", _WRITE)),
    (b"PK\x03\x04", Foreign("an archive (ZIP)", "unpack it first")),
    (b"\x1f\x8b", Foreign("an archive (gzip)", "unpack it first")),
)
_MARKUP = (
    (b"<scxml", Foreign("a statechart in SCXML", "turn it into a machine: `maze-machine import {}`")),
    (b"<BehaviorTree", Foreign("a behaviour tree of BehaviorTree.CPP", f"`import` reads SCXML only: {_WRITE}")),
    (b"<html", Foreign("a page in HTML", "give the path of a file that ends in `.maze-machine`")),
)
_XML = Foreign("a file in XML", f"`maze-machine import` reads statecharts in SCXML; otherwise {_WRITE}")
_CHART = Foreign("a statechart in JSON, as XState has it", f"`import` reads SCXML only: export it as that, or {_WRITE}")
_JSON = Foreign("a file in JSON", "give the path of a file that ends in `.maze-machine`")
_PYTHON = Foreign("a program in Python", _WRITE)


def foreign(content: bytes, name: str | Path) -> Foreign | None:
    """What a file is that is certainly not a machine; None of one that may be meant as a machine.

    Args:
        content: all of it.
        name: its path, which the advice quotes.
    """
    kind = _kind(content, Path(name).suffix)
    return None if kind is None else kind._replace(advice=kind.advice.format(name))


def _kind(content: bytes, suffix: str) -> Foreign | None:
    for magic, kind in _MAGIC:
        if content.startswith(magic):
            return kind
    begin = content.removeprefix(b"\xef\xbb\xbf").lstrip()
    if begin.startswith(b"<"):
        return next((kind for tag, kind in _MARKUP if tag in content), _XML)
    if begin.startswith((b'{"', b"{\n", b"{ ", b'[{"')) and b'"' in begin:
        return _CHART if b'"states"' in begin else _JSON
    return _PYTHON if suffix == ".py" else None
