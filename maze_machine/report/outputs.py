"""What a run shows and leaves behind while it goes on: progress, a trace, a recording, a live page."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from maze_machine.drive.loop import Tick
from maze_machine.drive.mission import Mission, Watcher
from maze_machine.drive.replay import described, keeper, reasoned
from maze_machine.drive.trace import TraceWriter
from maze_machine.errors import UsageError
from maze_machine.report.progress import Progress
from maze_machine.simulated.world import SimulatedWorld
from transport.recording import Recorder


@dataclass(frozen=True, slots=True)
class Outputs:
    """What was asked for of one attempt.

    Attributes:
        trace: file for the trace.
        recording: file for the recording.
        live: port of the live page, 0 for any that is free.
    """

    trace: Path | None = None
    recording: Path | None = None
    live: int | None = None

    def of_attempt(self, number: int) -> Outputs:
        """The same for an attempt; each after the first has files of its own, such as ``trace-2.jsonl``."""
        trace, recording = (file and numbered(file, number) for file in (self.trace, self.recording))
        return Outputs(trace, recording, self.live)

    @property
    def files(self) -> dict[str, Path]:
        """The files that are written, by kind."""
        asked = {"trace": self.trace, "recording": self.recording}
        return {kind: path for kind, path in asked.items() if path is not None}

    @contextmanager
    def watchers(self, mission: Mission, machine: str, world: SimulatedWorld | None) -> Iterator[list[Watcher]]:
        """The watchers of a run, for as long as the block runs.

        Args:
            mission: the run.
            machine: the machine's file, or the name of a shipped one.
            world: where it takes place, if that is in this process.

        Raises:
            OSError: a file cannot be written.
            RecordingError: the recording cannot be written.
            UsageError: the port is taken.
        """
        with ExitStack() as stack:
            found: list[Watcher] = []
            if self.trace is not None:
                file = stack.enter_context(self.trace.open("w", encoding="utf-8", newline="\n"))
                found.append(TraceWriter(file, mission))
            if self.recording is not None:
                # Nothing is lost where time waits for the disk.
                patience = 60.0 if world else 0.0
                recorder = Recorder(
                    self.recording, mission.profile.robot.name, described(mission, machine), patience=patience
                )
                stack.callback(_tell_lost, recorder)
                found.append(keeper(stack.enter_context(recorder), mission))
            if self.live is not None:
                found.append(stack.enter_context(shown_live(self.live, mission, world)))
            found.append(stack.enter_context(Progress(Console(stderr=True))))
            yield found


def numbered(file: Path, attempt: int) -> Path:
    """A file's name for an attempt: the same for the first one, with ``-2`` for the second."""
    return file if attempt == 1 else file.with_stem(f"{file.stem}-{attempt}")


def _tell_lost(recorder: Recorder) -> None:
    if recorder.lost:
        print(f"the recording lacks {recorder.lost} ticks: the disk was too slow for it", file=sys.stderr)


@contextmanager
def shown_live(port: int, mission: Mission, world: SimulatedWorld | None) -> Iterator[Watcher]:
    """A watcher that shows each tick on a page of its own; its address is told on standard error.

    Raises:
        UsageError: the port is taken.
    """
    # The page is wanted seldom, and its server takes a while to import.
    from maze_machine.view.live import LivePage  # noqa: PLC0415
    from maze_machine.view.page import frame, head  # noqa: PLC0415

    scene = None
    if world is not None:
        maze = world.maze
        doors = [[*one, *other] for one, other in (door.leaf for door in maze.doors)]
        scene = {"walls": maze.barriers.tolist(), "exits": maze.exits.tolist(), "doors": doors}
    try:
        page = LivePage(head(mission.machine.name, mission.profile.robot, scene), port)
    except OSError as error:
        raise UsageError(f"--live {port}: {error.strerror}", "0 takes any port that is free") from None

    def show(tick: Tick) -> None:
        step = {**reasoned(mission.machine, tick), "doing": tick.doing}
        page.publish(frame(tick.observation, tick.command, step, world.pose(tick.index) if world else None))

    with page:
        print(f"live page: {page.address}", file=sys.stderr, flush=True)
        yield show
