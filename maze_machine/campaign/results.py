"""The results file of a campaign: JSON lines, from which a campaign that was interrupted continues.

The first line names the task, then there is one line a job, added as jobs end and put in order once all have.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from maze_machine.campaign.jobs import Job, Record, Setup, mission_of
from maze_machine.errors import FileError
from maze_machine.simulated.world import maze_file
from sim.formats import files_of
from transport.files import append_line, write_text


class _Head(BaseModel):
    """The first line of a results file."""

    model_config = ConfigDict(strict=True)

    setup: dict[str, Any]
    files: dict[str, str]


class _Line(BaseModel):
    """The keys that every other line must have."""

    model_config = ConfigDict(strict=True)

    machine: str
    maze: str
    seed: Annotated[int, Field(ge=0)]
    solved: bool
    refused: str | None = None
    outcome: str | None = None
    reason: str | None = None
    time: float | None = None
    path_length: float | None = None
    clearance: float | None = None
    contacts: list[str] = []

    def is_whole(self) -> bool:
        """Whether a summary can include it."""
        if self.solved:
            return self.time is not None and self.path_length is not None
        return self.refused is not None or (self.outcome is not None and self.reason is not None)


class Results:
    """The results file of a campaign.

    Args to open it: the file, what all jobs share, and the jobs, in order. The file may hold more than these jobs: a
    campaign can grow by machines, mazes and seeds.

    Raises (when it is opened):
        FileError: the file holds results of another setup, of files that have changed since, or no results at all.
        MachineError: one of the machines has faults.
    """

    def __init__(self, file: Path, setup: Setup, jobs: Sequence[Job]) -> None:
        self._file = file
        self._jobs = jobs
        said = asdict(setup)
        if setup.library is None:  # results of sweeps without the option continue
            del said["library"]
        self._setup = json.loads(json.dumps(said))
        self._files = _fingerprints(setup, jobs)
        self._done: dict[Job, Record] = {}
        self._given = 0
        if file.exists():
            if not file.is_file():
                raise FileError(
                    f"{file} is not a regular file", "choose a regular file, so that the sweep can be resumed"
                )
            self._take_up()
        self.write()

    @property
    def open_jobs(self) -> list[Job]:
        """What is still to be done, in order."""
        return [job for job in self._jobs if job not in self._done]

    @property
    def records(self) -> list[Record]:
        """The results there are for the jobs, in order."""
        return [self._done[job] for job in self._jobs if job in self._done]

    def next_in_order(self) -> Iterator[Record]:
        """The results that no earlier call has given, in the order of the jobs, as far as none is missing."""
        while self._given < len(self._jobs) and self._jobs[self._given] in self._done:
            yield self._done[self._jobs[self._given]]
            self._given += 1

    def add(self, record: Record) -> None:
        """Accept one result and write it at once.

        Raises:
            OSError: the disk is full; the file keeps its previous contents.
        """
        self._done[_job_of(record)] = record
        append_line(self._file, _line(record))

    def write(self) -> None:
        """Write the whole file in order: the same bytes, independent of the order of the results.

        Raises:
            OSError: the disk is full; the file keeps its previous contents.
        """
        others = [self._done[job] for job in sorted(self._done.keys() - set(self._jobs))]
        head = {"setup": self._setup, "files": dict(sorted(self._files.items()))}
        write_text(self._file, "".join(map(_line, [head, *self.records, *others])))

    def _take_up(self) -> None:
        try:
            head, records = _contents(self._file)
        except (ValueError, RecursionError):
            raise FileError(
                f"{self._file} holds no results of a campaign, or damaged ones", "give another file"
            ) from None
        self._done = {_job_of(record): record for record in records}
        setup, files = head.setup, head.files
        changed = [name for name, mark in self._files.items() if files.get(name, mark) != mark]
        if setup != self._setup or changed:
            what = f"of {', '.join(changed)} before it was changed" if changed else f"of another setup: {setup}"
            raise FileError(f"{self._file} holds results {what}", "give another file, or remove this one")
        self._files = files | self._files


def records_in(file: Path) -> list[Record]:
    """The results in a file.

    Raises:
        FileError: it holds none.
    """
    try:
        return _contents(file)[1]
    except (ValueError, RecursionError):
        raise FileError(
            f"{file} does not contain the results of a campaign", "give a file that `sweep` has written"
        ) from None


def _contents(file: Path) -> tuple[_Head, list[Record]]:
    """What a results file holds.

    Raises:
        ValueError, RecursionError: no results of a campaign.
    """
    # An interruption may have cut off the last line.
    head, *lines = file.read_text(encoding="utf-8").split("\n")[:-1] or [""]
    found = _Head.model_validate_json(head)
    records = [json.loads(line) for line in lines]
    if not all(_Line.model_validate(record).is_whole() for record in records):
        raise ValueError
    return found, records


def _job_of(record: Record) -> Job:
    return Job(record["machine"], record["maze"], record["seed"])


def _line(value: Record) -> str:
    return json.dumps(value, separators=(",", ":")) + "\n"


def _fingerprints(setup: Setup, jobs: Sequence[Job]) -> dict[str, str]:
    """A hash of each machine, with all its imports, and of each maze, to detect changes."""
    files = {name: mission_of(setup, name).machine.model.files for name in dict.fromkeys(job.machine for job in jobs)}
    files |= {name: tuple(map(str, files_of(maze_file(name)))) for name in dict.fromkeys(job.maze for job in jobs)}
    if setup.maze.objects is not None:
        files[setup.maze.objects] = (setup.maze.objects,)
    return {
        name: sha256(b"\0".join(Path(one).read_bytes() for one in of)).hexdigest()[:16] for name, of in files.items()
    }
