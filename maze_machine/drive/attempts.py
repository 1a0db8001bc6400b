"""Attempts: a mission begun again at the start after it has failed, as the challenge grants it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Protocol

from maze_machine.drive.mission import Ending, Mission, TickWatcher, drive
from maze_machine.drive.operation import NOBODY, Operator
from maze_machine.drive.path_recorder import PathRecorder
from perception import Perception
from transport.messages import Pose
from transport.robot import Robot
from transport.world import Refereed


class RefereedRobot(Robot, Refereed, Protocol):
    """A robot whose referee it knows."""


class KeptRobot:
    """A robot for several attempts: on release it is left to its owner."""

    def __init__(self, robot: RefereedRobot) -> None:
        self._robot = robot

    def __getattr__(self, name: str) -> Any:
        """All but closing it is the robot's own."""
        return getattr(self._robot, name)

    def close(self) -> None:
        """Nothing: in lockstep a world stands still that nobody commands."""


WatchersOf = Callable[[int], AbstractContextManager[Sequence[TickWatcher]]]
"""Who watches an attempt, given its number, for as long as it lasts."""


@dataclass(frozen=True, slots=True)
class Attempt:
    """An attempt that is over.

    Attributes:
        number: counted from 1.
        robot: what drove, let go.
        ending: how it ended.
        trail: where it went.
    """

    number: int
    robot: RefereedRobot
    ending: Ending
    trail: PathRecorder


def attempts(
    mission: Mission,
    robot: Callable[[], RefereedRobot],
    watchers: WatchersOf,
    most: int = 1,
    try_again: Callable[[], bool] = lambda: False,
    *,
    operator: Operator = NOBODY,
    truth: Callable[[int], Pose] | None = None,
) -> Iterator[Attempt]:
    """Drive a mission until the robot is out or no attempt is left.

    Each attempt begins with a fresh machine and a fresh memory. Where another one is granted after a success, it is for
    practice: then the junctions that the robot has marked are known.

    Args:
        mission: what to do; an attempt that reaches its time limit is the last one.
        robot: takes hold of the robot for an attempt.
        watchers: who watches an attempt.
        most: how many to make at most.
        try_again: puts the robot, which has been stopped, back to the start, if another attempt is granted.
        operator: who sends events to the machine, and may end the run.
        truth: where the robot really is at a tick of the present attempt, if anybody knows.

    Yields:
        Each attempt, before the next one begins.

    Raises:
        MachineFault: a signal, an activity or an action failed, and the machine does not handle it.
        LinkError: the robot is out of reach.
    """
    perception = Perception(mission.profile.robot, mission.profile.perception)
    for number in range(1, most + 1):
        trail = PathRecorder()
        with watchers(number) as watching:
            driven = robot()
            ending = drive(mission, driven, driven, [trail, *watching], perception, operator=operator, truth=truth)
        yield Attempt(number, driven, ending, trail)
        if number == most or ending.limited or operator.ended or not try_again():
            return
        known = perception.world.from_the_start() if ending.report.get("solved") else None
        perception = Perception(mission.profile.robot, mission.profile.perception, known)
