"""Campaigns: machines driven through mazes with many seeds, the same results whoever does the work.

A campaign is a list of jobs, each of which depends on nothing but itself. Its results are a file of JSON lines: a first
line that says what was to be done, then one line a job, added as jobs end and put in order once all have. A campaign
that was interrupted is taken up again from that file.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from hsm import MachineFault
from maze_machine.catalogue.machines import find_machine
from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import Mission, drive, prepare
from maze_machine.errors import FileError
from maze_machine.simulated.choices import AS_THE_FILE_SAYS, MazeWords
from maze_machine.simulated.world import SimulatedWorld, find_maze, maze_file
from sim.maze import Maze, MazeError
from transport.world import LockstepRobot

Record = Mapping[str, Any]
"""The result of one job, of JSON values: lengths in m, times in s."""

SUFFIXES = {".maze", ".txt", ".num", ".pgm", ".png", ".yaml"}


@dataclass(frozen=True, slots=True)
class Setup:
    """What all jobs of a campaign share.

    Attributes:
        robot: the robot's profile, a file or a shipped one's name.
        settings: what overrides the profile, each ``section.key=value``.
        time_limit: s on the robot's clock after which a run is given up; None for no limit but the maze's own.
        maze: what is chosen of all mazes.
    """

    robot: str = "pico"
    settings: tuple[str, ...] = ()
    time_limit: float | None = None
    maze: MazeWords = AS_THE_FILE_SAYS


@dataclass(frozen=True, slots=True, order=True)
class Job:
    """One run: a machine, a maze (each a file or a shipped one's name) and a seed."""

    machine: str
    maze: str
    seed: int


def jobs_of(machines: Iterable[str], mazes: Iterable[str], seeds: int) -> list[Job]:
    """All jobs of a campaign, in order: every machine, in every maze, with every seed from 0.

    Args:
        machines: files or names.
        mazes: files, names, or folders, which stand for all maze files in them.
        seeds: how many.

    Raises:
        FileError: a folder without mazes, or a machine or a maze that is not there.
    """
    found = [maze for name in mazes for maze in _mazes(name)]
    names = list(machines)
    for name in names:
        find_machine(name)
    return [Job(machine, maze, seed) for machine in names for maze in found for seed in range(seeds)]


def _mazes(name: str) -> list[str]:
    path = Path(name)
    if not path.is_dir():
        maze_file(name)
        return [name]
    files = {file for file in path.rglob("*") if file.suffix in SUFFIXES}
    # A map's description stands for its image.
    images = {file.with_suffix(suffix) for file in files if file.suffix == ".yaml" for suffix in (".pgm", ".png")}
    found = sorted(str(file) for file in files - images)
    if not found:
        raise FileError(f"no maze in the folder {name}", f"mazes are files {', '.join(sorted(SUFFIXES))}")
    return found


def run_job(setup: Setup, job: Job) -> Record:
    """Do one job; it never fails: what goes wrong is its result."""
    try:
        ending = _drive(setup, job)
    except MazeError as error:
        return {**asdict(job), "solved": False, "refused": str(error)}
    except MachineFault as error:
        return {**asdict(job), "solved": False, "outcome": "fault", "reason": str(error)}
    return {**asdict(job), **ending}


def _drive(setup: Setup, job: Job) -> dict[str, Any]:
    mission = _mission(setup, job.machine)
    world = SimulatedWorld(_maze(setup, job.maze), mission.profile.robot, job.seed)
    robot = LockstepRobot(world)
    ending = drive(mission, robot, robot)
    report = ending.report
    return {
        "solved": report["solved"],
        "outcome": report["outcome"],
        "reason": report["reason"] if report["solved"] or ending.outcome is None else f"ended in {ending.outcome}",
        "time": report["time"],
        "path_length": report["path_length"],
        "clearance": report["clearance"],
        "doors_opened": report["doors_opened"],
        "contacts": report["contacts"],
    }


@lru_cache(maxsize=16)
def _mission(setup: Setup, machine: str) -> Mission:
    return prepare(machine, load_profile(setup.robot, setup.settings), time_limit=setup.time_limit)


@lru_cache(maxsize=16)
def _maze(setup: Setup, name: str) -> Maze:
    robot = load_profile(setup.robot, setup.settings).robot
    return find_maze(name, setup.maze.choices(), robot=robot)


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
        self._setup = json.loads(json.dumps(asdict(setup)))
        self._files = _fingerprints(setup, jobs)
        self._done: dict[Job, Record] = {}
        if file.exists():
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

    def add(self, record: Record) -> None:
        """Take in one result and write it down at once."""
        self._done[_job_of(record)] = record
        with self._file.open("a", encoding="utf-8") as file:
            file.write(_line(record))

    def write(self) -> None:
        """Write the whole file in order: the same bytes, whatever order the results came in."""
        others = [self._done[job] for job in sorted(self._done.keys() - set(self._jobs))]
        head = {"setup": self._setup, "files": dict(sorted(self._files.items()))}
        fresh = self._file.with_name(self._file.name + ".part")
        fresh.write_text("".join(map(_line, [head, *self.records, *others])), encoding="utf-8")
        fresh.replace(self._file)

    def _take_up(self) -> None:
        lines = self._file.read_text(encoding="utf-8").splitlines(keepends=True)
        try:
            # An interruption may have cut off the last line.
            head, *records = [json.loads(line) for line in lines if line.endswith("\n")]
            setup, files = head["setup"], head["files"]
            self._done = {_job_of(record): record for record in records}
        except (ValueError, KeyError, TypeError):
            raise FileError(f"{self._file} holds no results of a campaign", "give another file") from None
        changed = [name for name, mark in self._files.items() if files.get(name, mark) != mark]
        if setup != self._setup or changed:
            what = f"of {', '.join(changed)} as it was before a change" if changed else f"of another setup: {setup}"
            raise FileError(f"{self._file} holds results {what}", "give another file, or remove this one")
        self._files = files | self._files


def _job_of(record: Record) -> Job:
    return Job(record["machine"], record["maze"], record["seed"])


def _line(value: Record) -> str:
    return json.dumps(value, separators=(",", ":")) + "\n"


def _fingerprints(setup: Setup, jobs: Sequence[Job]) -> dict[str, str]:
    """A mark of the text of each machine, with all that it imports, and of each maze: it tells when one has changed."""
    files = {name: _mission(setup, name).machine.model.files for name in dict.fromkeys(job.machine for job in jobs)}
    files |= {name: (str(maze_file(name)),) for name in dict.fromkeys(job.maze for job in jobs)}
    return {
        name: sha256(b"\0".join(Path(one).read_bytes() for one in of)).hexdigest()[:16] for name, of in files.items()
    }
