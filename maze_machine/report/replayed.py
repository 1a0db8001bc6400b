"""The result of a replay, as text and as JSON values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from maze_machine.drive.mission import Ending
from maze_machine.drive.replay import Difference, fired
from maze_machine.drive.tick import Tick
from transport.recording import Recording
from transport.wording import printable


class Transitions:
    """A watcher of ticks that keeps every transition that fires, with the values that made it fire."""

    def __init__(self) -> None:
        self.found: list[tuple[float, str]] = []

    def __call__(self, tick: Tick) -> None:
        """Take note of a tick."""
        if tick.step.transitions:
            self.found += [(tick.time, line) for line in fired(tick)]


@dataclass(frozen=True, slots=True)
class Replayed:
    """A finished replay.

    Attributes:
        machine: the machine's name.
        recording: the recording.
        ending: how it ended.
        difference: its first difference from the recorded run, if any.
        transitions: time, s, and words of each transition that fired; shown where no run was recorded.
    """

    machine: str
    recording: Recording
    ending: Ending
    difference: Difference | None
    transitions: Sequence[tuple[float, str]]

    def as_json(self) -> dict[str, Any]:
        """JSON values; times in s."""
        report = {"ticks": self.ending.ticks, "complete": self.recording.complete}
        if self.recording.own:
            found = self.difference
            parts = found and {"tick": found.tick, "recorded": found.recorded, "replayed": found.replayed}
            return {"same": found is None, **report, "difference": parts}
        return {
            **report,
            "outcome": self.ending.outcome,
            "topics": asdict(self.recording.topics),
            "skipped": self.recording.skipped,
            "transitions": [{"time": time, "transition": words} for time, words in self.transitions],
        }

    def lines(self) -> list[str]:
        """The replay for a person."""
        cut = "" if self.recording.complete else " (the recording was cut off)"
        ticks = len(self.recording.ticks)
        if self.recording.own:
            head = f"{self.machine} on {ticks} recorded ticks{cut}: "
            first, *rest = self.difference.lines() if self.difference else ["no difference"]
            return [head + first, *rest]
        topics, ending = self.recording.topics, self.ending
        how = f"ended in `{ending.outcome}`" if ending.outcome else "still active at the end"
        skipped = f", {self.recording.skipped} messages could not be decoded" if self.recording.skipped else ""
        shown = printable(f"{topics.scan} and {topics.odometry}")
        head = f"{self.machine} on {ticks} ticks of {shown}{cut}: {how}{skipped}"
        return [head, *(f"{time:9.2f} s  {words}" for time, words in self.transitions)]
