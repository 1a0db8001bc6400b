"""Statecharts in SCXML, the W3C's XML for statecharts: read into machines and written from them.

It reads everything that has a counterpart in this engine: states of all kinds, history, transitions of both types with
event descriptors, ``In()`` conditions, ``raise``, and ``send`` and ``cancel`` to the chart itself in logical time. A
chart that names its data model, ``ecmascript`` or ``python``, has data, ``assign``, ``if``, ``foreach``, events with
data, the system variables and the ``...expr`` attributes. Its expressions are a safe subset of those of that language.
It may invoke other charts. Features that need another process (events over HTTP), or more of those languages, are
refused by name.
"""

from __future__ import annotations

from pathlib import Path

from hsm.engine.machine import Machine, build
from hsm.interchange.scxml.differences import differences
from hsm.interchange.scxml.reader import read_file, read_text
from hsm.interchange.scxml.writer import write_text

__all__ = ["differences", "load", "read_file", "read_text", "write_text"]


def load(path: str | Path) -> Machine:
    """The machine that an SCXML file describes.

    Raises:
        MachineError: the file cannot be read, is not well-formed, or uses an unsupported feature; the error has all
            diagnostics.
    """
    return build(read_file(path))
