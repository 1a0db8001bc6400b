"""The trace of a run: one JSON line per tick, the same bytes for the same run, in one process or over the network.

The first line names the machine and its parameters, each further one shows a tick (``tick_json.TickLine``):

    {"tick": 0, "stamp": 100000000, "states": ["maze", "maze.straight"], "taken": ["start -> maze (line 21)"],
     "pose": [x, y, heading], "twist": [forward, left, turn], "ring": false}

``stamp`` is the observation's time in ns; ``pose`` is odometry, in metres and radians; ``twist`` is the command, in m/s
and rad/s. Floats are written so that reading them back gives the same bits. ``events`` are the external events of this
tick. ``blind`` is the reason if the loop keeps the base stopped. ``outcome`` is the final state if the machine has
ended; ``violated`` names properties of the machine that do not hold from this tick on, ``broken`` its assumptions.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Protocol

from maze_machine.drive.mission import Mission
from maze_machine.drive.tick import Tick


def trace_head(mission: Mission) -> dict[str, Any]:
    """The first line of a trace."""
    return {"machine": mission.machine.name, "parameters": dict(mission.parameters)}


class SupportsWrite(Protocol):
    """What takes a text."""

    def write(self, text: str, /) -> object:
        """Take a part of it."""
        ...


class TraceWriter:
    """Writes a trace to an open text file; a watcher of ticks."""

    def __init__(self, file: SupportsWrite, mission: Mission) -> None:
        self._file = file
        self._write(trace_head(mission))

    def __call__(self, tick: Tick) -> None:
        """Write one tick."""
        self._write(tick.line)

    def _write(self, line: Mapping[str, Any]) -> None:
        self._file.write(json.dumps(line, separators=(",", ":")) + "\n")
