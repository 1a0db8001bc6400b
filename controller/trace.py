"""The trace of a run: one JSON line a tick, the same bytes for the same run, wherever the robot is.

The first line names the machine and its parameters, each further one tells a tick:

    {"tick": 0, "stamp": 100000000, "states": ["maze", "maze.straight"], "taken": ["start -> maze (line 21)"],
     "pose": [x, y, heading], "twist": [forward, left, turn], "ring": false}

``stamp`` is the observation's time in ns; ``pose`` is odometry, in metres and radians; ``twist`` is the command, in m/s
and rad/s. Floats are written so that reading them back gives the same bits.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, TextIO

from controller.loop import Tick
from hsm import Machine
from hsm.model import Transition


class TraceWriter:
    """Writes a trace to an open text file, line by line."""

    def __init__(self, file: TextIO, machine: Machine, parameters: Mapping[str, Any]) -> None:
        self._file = file
        self._machine = machine
        self._write({"machine": machine.model.name, "parameters": dict(parameters)})

    def __call__(self, tick: Tick) -> None:
        """Write one tick."""
        pose, twist = tick.pose, tick.command.twist
        line: dict[str, Any] = {
            "tick": tick.index,
            "stamp": tick.observation.stamp,
            "states": tick.configuration,
            "taken": [self._described(transition) for transition in tick.step.transitions],
            "pose": [pose.x, pose.y, pose.heading],
            "twist": [twist.forward, twist.left, twist.turn],
            "ring": tick.command.ring,
        }
        if tick.outcome is not None:
            line["outcome"] = tick.outcome
        self._write(line)

    def _described(self, transition: Transition) -> str:
        states = self._machine.model.states
        source = states[transition.source].name
        targets = ", ".join(states[target].name for target in transition.targets)
        place = f" (line {transition.place.line})" if transition.place else ""
        return f"{source} -> {targets}{place}" if targets else f"{source}{place}"

    def _write(self, line: Mapping[str, Any]) -> None:
        self._file.write(json.dumps(line, separators=(",", ":")) + "\n")
