"""Output during a run: progress, a trace, a recording."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from time import time_ns

from rich.console import Console

from maze_machine.drive.mission import Mission, TickWatcher
from maze_machine.drive.replay import Keeper, described
from maze_machine.drive.trace import TraceWriter
from maze_machine.report.notices import Notices
from maze_machine.report.pages import said_of
from maze_machine.report.progress import ProgressDisplay
from maze_machine.simulated.world import SimulatedWorld
from sim.occupancy import occupancy
from transport.description import RobotDescription
from transport.files import Stream
from transport.recording import RecordedScene, Recorder, RecordingError
from transport.recording.drawings import Grid


@dataclass(frozen=True, slots=True)
class Outputs:
    """The requested outputs of one attempt.

    Attributes:
        trace: file for the trace.
        recording: file for the recording.
        dated: whether the recording's stamps begin at the current date, instead of the robot's clock.
        quiet: whether nothing is printed while the run goes on.
    """

    trace: Path | None = None
    recording: Path | None = None
    dated: bool = False
    quiet: bool = False

    def of_attempt(self, number: int) -> Outputs:
        """The same for an attempt; each after the first has files of its own, such as ``trace-2.jsonl``."""
        trace, recording = (file and numbered(file, number) for file in (self.trace, self.recording))
        return replace(self, trace=trace, recording=recording)

    @property
    def files(self) -> dict[str, Path]:
        """The files that are written, by kind."""
        asked = {"trace": self.trace, "recording": self.recording}
        return {kind: path for kind, path in asked.items() if path is not None}

    @contextmanager
    def watchers(
        self,
        mission: Mission,
        machine: str,
        world: SimulatedWorld | None,
        losses: list[str],
        more: Sequence[TickWatcher] = (),
    ) -> Iterator[list[TickWatcher]]:
        """The watchers of a run, for as long as the block runs.

        A disk error while the robot drives does not end the run: the file is abandoned, and the loss is recorded.

        Args:
            mission: the run.
            machine: the machine's file, or the name of a shipped one.
            world: the simulation, if it is in this process.
            losses: receives a sentence for each incomplete file.
            more: watchers of all attempts.

        Raises:
            OSError: a file cannot be begun.
            RecordingError: the recording cannot be begun.
        """
        with ExitStack() as stack:
            found: list[TickWatcher] = []
            if self.trace is not None:
                found.append(TraceWriter(stack.enter_context(text_stream(self.trace, losses)), mission))
            if self.recording is not None:
                # Nothing is lost if simulated time waits for the disk.
                patience = 60.0 if world else 0.0
                name, said = mission.profile.robot.name, described(mission, machine, said_of(mission, world))
                setting = setting_of(mission.profile.robot, world, dated=self.dated)
                recorder = Recorder(self.recording, name, said, setting=setting, patience=patience)
                stack.callback(_finish, recorder, losses)
                found.append(Keeper(recorder))
            console = Console(stderr=True, quiet=self.quiet)
            found += [stack.enter_context(ProgressDisplay(console)), Notices(console)]
            found += more
            yield found


def setting_of(robot: RobotDescription, world: SimulatedWorld | None, *, dated: bool) -> RecordedScene:
    """The constant entries of a recording: the robot's outline and laser, the map, and the start of the run."""
    grid = None
    if world is not None:
        cells, resolution, (x, y) = occupancy(world.maze)
        grid = Grid(cells, resolution, x, y)
    return RecordedScene(robot.footprint, robot.laser.mount, grid, time_ns() if dated else 0)


def numbered(file: Path, attempt: int) -> Path:
    """A file's name for an attempt: the same for the first one, with ``-2`` for the second."""
    return file if attempt == 1 else file.with_stem(f"{file.stem}-{attempt}")


def kind_of(kind: str, attempt: int) -> str:
    """The key of a file in the result of an attempt: its kind for the first one, such as ``map 2`` for the second."""
    return kind if attempt == 1 else f"{kind} {attempt}"


class TextStream:
    """Writes a text line by line until the disk fails; the rest is dropped."""

    def __init__(self, stream: Stream) -> None:
        self._stream = stream
        self.failure: OSError | None = None

    def write(self, text: str) -> None:
        """Write more."""
        if self.failure is not None:
            return
        try:
            self._stream.write(text.encode())
        except OSError as error:
            self.failure = error

    def finish(self) -> None:
        """Move the file to its place."""
        try:
            self._stream.close()
        except OSError as error:
            self.failure = error


@contextmanager
def text_stream(path: Path, losses: list[str]) -> Iterator[TextStream]:
    """A text file that is written while something runs.

    Args:
        path: its name.
        losses: receives a sentence if it could not be completed.

    Raises:
        OSError: it cannot be begun.
    """
    stream = Stream(path)
    text = TextStream(stream)
    try:
        yield text
    finally:
        text.finish()
        if text.failure is not None:
            losses.append(f"{path} is not complete: {text.failure.strerror}")


def _finish(recorder: Recorder, losses: list[str]) -> None:
    try:
        recorder.close()
    except RecordingError as error:
        losses.append(str(error))
        return
    if recorder.lost:
        print(f"the recording lacks {recorder.lost} ticks: the disk was too slow for it", file=sys.stderr)
