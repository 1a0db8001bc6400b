"""A mission: a machine prepared for a robot, and the result of driving it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, Protocol, runtime_checkable

import hsm
from hsm import Library, Machine
from hsm.engine.monitoring import Violation
from maze_machine.arguments.parameters import parameter_values
from maze_machine.catalogue.library import chosen_library, robot_library
from maze_machine.catalogue.machines import find_machine
from maze_machine.catalogue.profile import Profile
from maze_machine.drive.loop import ticks
from maze_machine.drive.operation import NOBODY, Operator
from maze_machine.drive.tick import Tick
from maze_machine.drive.verdict import read_verdict
from maze_machine.errors import UsageError
from perception import Perception
from perception.facts import Facts
from skills.chain import MotionChain
from transport.messages import Command, Pose
from transport.robot import Halting, Robot
from transport.world import Refereed

TickWatcher = Callable[[Tick], object]
"""A watcher of ticks: a trace, a progress display, a recording, a live page."""


@runtime_checkable
class EndWatcher(Protocol):
    """A watcher of ticks that also receives the end of the run."""

    def end(self, ending: Ending) -> object:
        """Receive the end; the robot has been stopped and released by then."""
        ...


@dataclass(frozen=True, slots=True)
class Mission:
    """A machine, the robot's profile, and the parameters of this run.

    Attributes:
        machine: the checked machine.
        profile: the settings of the robot.
        parameters: the machine's parameters, in SI units.
        time_limit: the run is ended after that many seconds on the robot's clock; None for no limit.
        library: what the machine was checked against.
    """

    machine: Machine[Facts, Command]
    profile: Profile
    parameters: Mapping[str, Any] = field(default_factory=dict)
    time_limit: float | None = None
    library: Library[Facts, Command] = field(default_factory=robot_library)


@dataclass(frozen=True, slots=True)
class Ending:
    """How a mission ended.

    Attributes:
        outcome: the final state that the machine reached, or None.
        reason: what ended it, in words.
        ticks: number of ticks.
        duration: time on the robot's clock, s.
        elapsed: time on the wall clock, s.
        longest_tick: how long the slowest tick took on the wall clock, without what waits for the robot, s.
        report: the referee's verdict, of JSON values; empty where there is no referee.
        limited: whether the mission's time limit ended it.
        violations: properties of the machine that did not hold, in words, with time and place.
        broken: its assumptions that did not hold, likewise: no proof speaks of the run from there on.
        unread: why the referee's verdict cannot be read, if it cannot.
        at_rest: whether the robot was seen at rest at the end; a world that waits for its controller is.
    """

    outcome: str | None
    reason: str
    ticks: int
    duration: float
    elapsed: float
    longest_tick: float
    report: Mapping[str, Any]
    limited: bool = False
    violations: tuple[str, ...] = ()
    unread: str = ""
    broken: tuple[str, ...] = ()
    at_rest: bool = True

    @property
    def solved(self) -> bool:
        """Whether the robot has reached its goal; without a referee, whether the machine reached a final state."""
        return bool(self.report["solved"]) if self.report else self.outcome is not None

    def as_json(self) -> dict[str, Any]:
        """How it ended, for display: ``line`` is a one-line summary, ``lines`` the full text."""
        ended = f"ended in {self.outcome}" if self.outcome else self.reason
        words = str(self.report["line"]) if "line" in self.report else ended
        lines = [words, self.reason, *self.broken, *self.violations]
        told = {"line": words, "reason": self.reason, "lines": lines}
        return {**told, "solved": self.solved, "outcome": self.outcome, "at_rest": self.at_rest}


def prepare(
    name: str,
    profile: Profile,
    parameters: Iterable[tuple[str, str]] = (),
    time_limit: float | None = None,
    library: str | None = None,
) -> Mission:
    """Load a machine for a robot.

    Args:
        name: a .maze-machine file, or the name of a machine of the project or of a shipped one.
        profile: the robot's profile; its section for the machine sets parameters too.
        parameters: names and values of parameters as text; they override the profile's.
        time_limit: s, or None.
        library: what the machine may name, as ``MODULE:NAME``; by default that of its project.

    Raises:
        FileError: there is no such machine.
        MachineError: the machine has faults.
        UsageError: a parameter is unknown or has a value that is not of its type, or the machine has members.
    """
    path = find_machine(name)
    names = chosen_library(library, path, lambda: robot_library(profile.skills, profile.robot))
    machine = hsm.load(path, names)
    if members := machine.model.members:
        reason = f"machine {machine.name} has members ({', '.join(members)}), and each needs its own robot"
        raise UsageError(
            reason, ("run the machine of each member on its robot, and connect them with --tell ROBOT@ENDPOINT")
        )
    written = {**profile.machines.get(machine.model.name, {}), **dict(parameters)}
    values = parameter_values(machine.model, written, names.enumerations)
    return Mission(machine, profile, values, time_limit, names)


def mission_ticks(
    mission: Mission,
    robot: Robot,
    perception: Perception | None = None,
    *,
    operator: Operator = NOBODY,
    truth: Callable[[int], Pose] | None = None,
) -> Iterator[Tick]:
    """The ticks of a mission, as ``drive.loop.ticks`` gives them; the caller closes the robot.

    Args:
        mission: what to do; the caller enforces its time limit.
        robot: the robot.
        perception: as for ``drive``.
        operator: sends events to the machine.
        truth: the true pose of the robot at a tick, if known.

    Raises:
        MachineFault: a signal, an activity or an action failed, and the machine does not handle it.
        LinkError: the robot cannot be reached.
    """
    profile = mission.profile
    perception = perception or Perception(profile.robot, profile.perception)
    chain = MotionChain(profile.robot, profile.skills)
    machine, parameters = mission.machine, mission.parameters
    return ticks(robot, machine, parameters, perception, chain, settings=profile.link, operator=operator, truth=truth)


def drive(
    mission: Mission,
    robot: Robot,
    referee: Refereed | None = None,
    watchers: Sequence[TickWatcher] = (),
    perception: Perception | None = None,
    *,
    operator: Operator = NOBODY,
    truth: Callable[[int], Pose] | None = None,
) -> Ending:
    """Run a mission on a robot to its end; the robot is stopped and released in every case.

    Args:
        mission: what to do.
        robot: the robot.
        referee: may end the run and has the verdict: a simulated robot itself, or None.
        watchers: called with each tick, after its command has been sent; an ``EndWatcher`` with the end, too.
        perception: the perception of the mission, if it should keep its memory; by default a new one.
        operator: sends events to the machine, and may end the run.
        truth: the true pose of the robot at a tick, if known.

    Raises:
        MachineFault: a signal, an activity or an action failed, and the machine does not handle it.
        LinkError: the robot cannot be reached.
    """
    began = perf_counter()
    first = last = None
    violations: list[Violation] = []
    limited = False
    longest_tick = 0.0
    reason = "the machine ended"
    with closing(robot):
        for tick in mission_ticks(mission, robot, perception, operator=operator, truth=truth):
            first, last = first or tick, tick
            longest_tick = max(longest_tick, tick.phases.thinking)
            violations.extend(tick.violations)
            for watch in watchers:
                watch(tick)
            if referee is not None and referee.finished:
                reason = "the referee ended the run"
                break
            if operator.ended:
                reason = operator.ended
                break
            limited = mission.time_limit is not None and tick.time - first.time >= mission.time_limit
            if limited:
                reason = f"the time limit of {mission.time_limit:g} s was reached"
                break
        at_rest = not isinstance(robot, Halting) or robot.halt()
        report, unread = read_verdict({} if referee is None else referee.report())
    assert first is not None
    assert last is not None
    elapsed = perf_counter() - began
    duration = last.time - first.time
    ending = Ending(
        last.outcome,
        reason,
        last.index + 1,
        duration,
        elapsed,
        longest_tick,
        report,
        limited,
        tuple(str(one) for one in violations if not one.assumed),
        unread,
        tuple(str(one) for one in violations if one.assumed),
        at_rest,
    )
    for watch in watchers:
        if isinstance(watch, EndWatcher):
            watch.end(ending)
    return ending
