"""The result of a run, as text and as JSON values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from maze_machine.drive.mission import Ending
from maze_machine.drive.verdict import readable


@dataclass(frozen=True, slots=True)
class Result:
    """A finished run.

    Attributes:
        machine: the machine's name.
        parameters: the machine's parameters, SI units.
        ending: how it, or its last attempt, ended.
        files: the files written, by kind (``picture``, ``trace``, ``recording``).
        attempts: the referee's verdict on each attempt, in order; empty if only one was requested.
        link: counters of the link to the robot: overruns, dropped messages and the like.
    """

    machine: str
    parameters: Mapping[str, Any]
    ending: Ending
    files: Mapping[str, Path] = field(default_factory=dict)
    link: Mapping[str, int] = field(default_factory=dict)
    attempts: Sequence[Mapping[str, Any]] = ()

    @property
    def solved(self) -> bool:
        """Whether the robot has reached its goal; without a referee, whether the machine reached a final state."""
        return self.ending.solved

    def as_json(self) -> dict[str, Any]:
        """JSON values; lengths in m, times in s."""
        ending = self.ending
        return {
            "solved": self.solved,
            "machine": self.machine,
            "parameters": dict(self.parameters),
            "outcome": ending.outcome,
            "ended_by": ending.reason,
            "ticks": ending.ticks,
            "duration": ending.duration,
            "longest_tick": ending.longest_tick,
            "verdict": dict(ending.report) or None,
            "attempts": readable(self.attempts),
            "at_rest": ending.at_rest,
            "violations": list(ending.violations),
            "broken": list(ending.broken),
            "link": dict(self.link),
            "files": {kind: str(path) for kind, path in self.files.items()},
        }

    @property
    def line(self) -> str:
        """The result as one line."""
        ending, report = self.ending, self.ending.report
        outcome = f"the machine ended in `{ending.outcome}`" if ending.outcome else ending.reason
        if not report:
            return f"{self.machine}: {outcome} after {ending.duration:.1f} s"
        verdict = f"failed: {report['reason']} ({outcome})"
        if self.solved:
            verdict = "out of the maze" if report["escaped"] else f"{report['reason']} ({outcome})"
        return f"{self.machine} in {report['maze']}, seed {report['seed']}: {verdict} after {report['time']:.1f} s"

    def lines(self) -> list[str]:
        """The result for a person."""
        report = self.ending.report
        told: dict[str, object] = {f"attempt {one['attempt']}": one["line"] for one in readable(self.attempts)}
        if report:
            clearance = report["clearance"]
            told |= {
                "judged": report["goal"],
                "time": f"{report['time']:.1f} s",
                "path length": f"{report['path_length']:.2f} m",
                "smallest distance to a wall": "none was near" if clearance is None else f"{clearance:.3f} m",
                "doors opened": ", ".join(report["doors_opened"]) or "none",
            }
        if not self.ending.at_rest:
            told["base"] = "it is not confirmed that it has stopped"
        if self.ending.unread:
            told["verdict"] = f"cannot be read: {self.ending.unread}"
        if self.link.get("overruns"):
            told["longest tick"] = f"{self.ending.longest_tick:.3f} s"
        counted = {name: count for name, count in self.link.items() if count}
        told |= counted | dict(self.files)
        return [
            self.line,
            *(f"  {name:<28} {value}" for name, value in told.items()),
            *self.ending.broken,
            *self.ending.violations,
        ]
