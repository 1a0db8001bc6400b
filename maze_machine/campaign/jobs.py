"""Campaigns: machines driven through mazes with many seeds; the results do not depend on the number of processes.

A campaign is a list of independent jobs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from functools import lru_cache
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
from sim.solvability import shortest_way
from transport.world import LockstepRobot

Record = Mapping[str, Any]
"""The result of one job, of JSON values: lengths in m, times in s."""

SUFFIXES = {".maze", ".txt", ".num", ".pgm", ".png", ".yaml"}


@dataclass(frozen=True, slots=True)
class Setup:
    """The settings that all jobs of a campaign share.

    Attributes:
        robot: the robot's profile, a file or a shipped one's name.
        settings: what overrides the profile, each ``section.key=value``.
        time_limit: s on the robot's clock after which a run is aborted; None for no limit but the maze's own.
        maze: the options for all mazes.
        library: what machines may name, as ``MODULE:NAME``; None for that of their projects.
    """

    robot: str = "pico"
    settings: tuple[str, ...] = ()
    time_limit: float | None = None
    maze: MazeWords = AS_THE_FILE_SAYS
    library: str | None = None


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
        mazes: files, names, or folders, which represent all maze files in them.
        seeds: how many.

    Raises:
        FileError: a folder without mazes, or a machine or a maze that does not exist.
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
    # A map's description represents its image.
    images = {file.with_suffix(suffix) for file in files if file.suffix == ".yaml" for suffix in (".pgm", ".png")}
    found = sorted(str(file) for file in files - images)
    if not found:
        raise FileError(f"no maze in the folder {name}", f"mazes are files {', '.join(sorted(SUFFIXES))}")
    return found


def run_job(setup: Setup, job: Job) -> Record:
    """Do one job; it never raises: any error, even a defect of this program, is part of its result."""
    try:
        ending = _drive(setup, job)
    except MazeError as error:
        return {**asdict(job), "solved": False, "refused": str(error)}
    except MachineFault as error:
        return {**asdict(job), "solved": False, "outcome": "fault", "reason": str(error)}
    except Exception as error:
        return crashed(job, f"{type(error).__name__}: {error}")
    return {**asdict(job), **ending}


def crashed(job: Job, reason: str) -> Record:
    """The result of a job whose process died."""
    return {**asdict(job), "solved": False, "outcome": "crashed", "reason": reason}


def _drive(setup: Setup, job: Job) -> dict[str, Any]:
    mission = mission_of(setup, job.machine)
    world = SimulatedWorld(maze_of(setup, job.maze), mission.profile.robot, job.seed)
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
        **_bounds(setup, job.maze),
    }


@lru_cache(maxsize=16)
def _bounds(setup: Setup, name: str) -> dict[str, float]:
    """The length of a maze's shortest way, m, and the time that it takes at the robot's top speed, s.

    Empty where the goal is neither the outside nor a place, or where there is no way.
    """
    robot, maze = load_profile(setup.robot, setup.settings).robot, maze_of(setup, name)
    way = shortest_way(maze, radius=robot.radius)
    return {} if way is None else {"shortest": way, "bound": way / robot.limits.speed}


@lru_cache(maxsize=16)
def mission_of(setup: Setup, machine: str) -> Mission:
    """The mission of all jobs with a machine."""
    profile = load_profile(setup.robot, setup.settings)
    return prepare(machine, profile, time_limit=setup.time_limit, library=setup.library)


@lru_cache(maxsize=16)
def maze_of(setup: Setup, name: str) -> Maze:
    """A maze as the campaign has chosen it."""
    robot = load_profile(setup.robot, setup.settings).robot
    return find_maze(name, setup.maze.choices(), robot=robot)
