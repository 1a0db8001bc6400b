"""Attempts: a mission restarted at the start after a failure, as the challenge allows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

from maze_machine.drive.map_recorder import MapRecorder
from maze_machine.drive.mission import Ending, Mission, TickWatcher, drive
from maze_machine.drive.operation import NOBODY, Operator
from maze_machine.drive.path_recorder import PathRecorder
from perception import Perception, WorldModel
from transport.messages import Pose
from transport.robot import Robot
from transport.world import Refereed


class RefereedRobot(Robot, Refereed, Protocol):
    """A robot with a referee."""


class KeptRobot:
    """A robot for several attempts: release returns it to its owner."""

    def __init__(self, robot: RefereedRobot) -> None:
        self._robot = robot

    def __getattr__(self, name: str) -> Any:
        """Everything except closing is delegated to the robot."""
        return getattr(self._robot, name)

    def close(self) -> None:
        """Does nothing: in lockstep the world waits for commands."""


WatchersOf = Callable[[int], AbstractContextManager[Sequence[TickWatcher]]]
"""The watchers of an attempt, by its number, while it lasts."""


@dataclass(frozen=True, slots=True)
class Attempt:
    """A finished attempt.

    Attributes:
        number: counted from 1.
        robot: the robot, released.
        ending: how it ended.
        trail: its path.
        map: what the robot knows of the maze.
    """

    number: int
    robot: RefereedRobot
    ending: Ending
    trail: PathRecorder
    map: MapRecorder


def attempts(
    mission: Mission,
    robot: Callable[[], RefereedRobot],
    watchers: WatchersOf,
    most: int = 1,
    try_again: Callable[[], bool] = lambda: False,
    *,
    operator: Operator = NOBODY,
    truth: Callable[[int], Pose] | None = None,
    memory: Callable[[], WorldModel | None] = lambda: None,
    own_map: Callable[[], WorldModel | None] = lambda: None,
) -> Iterator[Attempt]:
    """Drive a mission until the robot has left the maze or no attempt remains.

    Each attempt begins with a fresh machine and a fresh memory. An attempt after a success is for practice: it knows
    the junctions that the robot has marked.

    Args:
        mission: what to do; an attempt that reaches its time limit is the last one.
        robot: acquires the robot for an attempt.
        watchers: the watchers of an attempt.
        most: the largest number of attempts.
        try_again: puts the stopped robot back to the start, if another attempt is allowed.
        operator: sends events to the machine, and may end the run.
        truth: the true pose of the robot at a tick of the current attempt, if known.
        memory: what the robot knows when it begins, such as a map from a file; None for nothing.
        own_map: a memory in which to make a map where the machine makes none; None to make none.

    Yields:
        Each attempt, before the next one begins.

    Raises:
        MachineFault: a signal, an activity or an action failed, and the machine does not handle it.
        LinkError: the robot cannot be reached.
    """
    perception = Perception(mission.profile.robot, mission.profile.perception, memory())
    for number in range(1, most + 1):
        trail, mapped = PathRecorder(), MapRecorder(own_map())
        with watchers(number) as watching:
            driven = robot()
            watched: list[TickWatcher] = [trail, mapped, *watching]
            ending = drive(mission, driven, driven, watched, perception, operator=operator, truth=truth)
        yield Attempt(number, driven, ending, trail, mapped)
        if number == most or ending.limited or operator.ended or not try_again():
            return
        known = perception.world.from_the_start() if ending.report.get("solved") else memory()
        perception = Perception(mission.profile.robot, mission.profile.perception, known)
