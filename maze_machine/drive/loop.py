"""The loop that runs a machine on a robot: communicate, prepare, coordinate, act, communicate, log, tick by tick."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import count
from time import perf_counter
from typing import Any, NamedTuple

from hsm import Machine, Macrostep, Supervisor
from hsm.engine.monitoring import Monitor, Violation
from hsm.engine.occurrences import event_text
from maze_machine.drive.operation import NOBODY, Operator
from perception import Perception
from perception.facts import Facts
from skills.chain import MotionChain
from transport.messages import Command, Observation, Pose, Twist
from transport.robot import Robot
from transport.settings import LinkSettings
from transport.trust import Trust

BLINDED = "blinded"
"""The event that the loop sends to a machine when it stops the base because of the sensors."""


class Phases(NamedTuple):
    """Where a tick's time went, s of the wall clock; statistics that nothing decides by.

    Perception is lazy: what it takes falls to the phase that first asks for a fact.
    """

    observe: float
    prepare: float
    coordinate: float
    act: float
    command: float


@dataclass(frozen=True, slots=True)
class Tick:
    """What happened in one tick.

    Attributes:
        index: number of the tick, from 0.
        observation: what the robot sensed.
        step: what the machine did about it.
        configuration: names of all active states, in document order.
        doing: name of the first state whose activity asked for something; where none did, of the first innermost one.
        outcome: how the machine ended, or None while it runs.
        command: what the robot was told.
        violations: properties of the machine that do not hold, and did before.
        phases: where the time went.
        events: the events that somebody outside has sent for this tick.
        variables: variables and parameters after the step, by their full names.
    """

    index: int
    observation: Observation
    step: Macrostep
    configuration: tuple[str, ...]
    doing: str
    outcome: str | None
    command: Command
    violations: tuple[Violation, ...]
    phases: Phases
    events: tuple[str, ...]
    variables: Mapping[str, Any]

    @property
    def blind(self) -> str:
        """Why the loop keeps the base standing; empty where scan and odometry are fresh and credible."""
        return self.observation.link.blind

    @property
    def time(self) -> float:
        """The tick's time on the robot's clock, s."""
        return self.observation.time

    @property
    def pose(self) -> Pose:
        """Where the odometry sees the robot."""
        return self.observation.odometry.pose


def ticks(
    robot: Robot,
    machine: Machine[Facts, Command],
    parameters: Mapping[str, Any],
    perception: Perception,
    chain: MotionChain,
    *,
    settings: LinkSettings,
    operator: Operator = NOBODY,
) -> Iterator[Tick]:
    """Run a machine on a robot, tick by tick, until the machine ends.

    Where scan or odometry are too old or refused, the base is stopped, whatever the machine wants, and its activities
    wait; the machine goes on, and hears of it by the event ``blinded``. Once both have been good for a while, the
    activities go on where they were.

    The last phase, log, is what the caller does with a tick. Whoever calls closes the robot, which stops it, in every
    case: at the end, on a fault, and when a run is given up by closing the iterator.

    Args:
        robot: the robot, in this process or elsewhere.
        machine: the machine.
        parameters: the machine's parameters, in SI units.
        perception: makes facts of observations.
        chain: shapes what the activities want into what the base is sent.
        settings: when sensor data are too old.
        operator: who sends events to the machine.

    Raises:
        MachineFault: a signal, an activity or an action failed, and the machine does not handle it.
        LinkError: the robot is out of reach.
    """
    supervisor: Supervisor[Facts, Command] | None = None
    trust = Trust(settings)
    hears_it = machine.model.events is None or BLINDED in machine.model.events
    for index in count():
        began = perf_counter()
        seeing = not trust.reason
        observation = trust.judged(robot.observe())  # communicate
        observed = perf_counter()
        blind = trust.reason
        sent = tuple(event_text(machine.model, one) for one in operator.events(index, observation.time))
        happened = (BLINDED, *sent) if blind and seeing and hears_it else sent
        facts = perception.facts(observation)  # prepare
        prepared = perf_counter()
        if supervisor is None:  # coordinate
            supervisor = machine.start(parameters, facts=facts, time=observation.time)
            monitor = Monitor(supervisor)
        step = supervisor.step(observation.time, happened, facts=facts)
        coordinated = perf_counter()
        effects = () if blind else supervisor.act(facts)  # act
        command = chain.stop(facts) if blind else chain.shape(merged(effect for _, effect in effects), facts)
        acted = perf_counter()
        robot.command(command)  # communicate
        commanded = perf_counter()
        phases = Phases(
            observed - began, prepared - observed, coordinated - prepared, acted - coordinated, commanded - acted
        )
        violations = monitor.look(facts, step)
        active = tuple(sorted(supervisor.configuration, key=machine.indices.__getitem__))
        innermost = (name for name in active if not machine.model.states[machine.indices[name]].children)
        doing = next((state for state, _ in effects), None) or next(innermost, "")
        yield Tick(
            index,
            observation,
            step,
            active,
            doing,
            supervisor.outcome,
            command,
            violations,
            phases,
            sent,
            supervisor.variables,
        )  # log
        if supervisor.outcome is not None:
            return


def merged(commands: Iterable[Command]) -> Command:
    """One command from what the active activities want.

    At most one of them holds the base, which the checker sees to; the others ask for no motion, so twists add up.
    """
    forward = left = turn = 0.0
    ring = False
    for command in commands:
        forward += command.twist.forward
        left += command.twist.left
        turn += command.twist.turn
        ring = ring or command.ring
    return Command(Twist(forward, left, turn), ring)
