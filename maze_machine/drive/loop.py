"""The loop that runs a machine on a robot: communicate, prepare, coordinate, act, communicate, watch, log."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import count
from time import perf_counter
from typing import Any

from hsm import Machine, Supervisor
from hsm.engine.monitoring import Monitor
from hsm.engine.occurrences import event_text
from hsm.interchange.reports import StepReport
from maze_machine.drive.operation import NOBODY, Operator
from maze_machine.drive.tick import Phases, Tick
from perception import Perception
from perception.facts import Facts
from skills.chain import MotionChain
from transport.messages import Command, Pose, Twist
from transport.robot import Robot
from transport.settings import LinkSettings
from transport.trust import Trust

BLINDED = "blinded"
"""The event that the loop sends to a machine when it stops the base because of bad sensor data."""


def ticks(
    robot: Robot,
    machine: Machine[Facts, Command],
    parameters: Mapping[str, Any],
    perception: Perception,
    chain: MotionChain,
    *,
    settings: LinkSettings,
    operator: Operator = NOBODY,
    truth: Callable[[int], Pose] | None = None,
) -> Iterator[Tick]:
    """Run a machine on a robot, tick by tick, until the machine ends.

    If scan or odometry are too old or refused, the base is stopped, whatever the machine wants, and its activities
    wait; the machine continues, and receives it by the event ``blinded``. Once both have been good for a while, the
    activities continue where they were. When the robot gets lost on its map, or finds itself again, the machine
    receives the events ``lost`` and ``found``.

    The last phase, log, belongs to the caller. The caller closes the robot, which stops it, in every
    case: at the end, on a fault, and when the iterator is closed early.

    Args:
        robot: the robot, in this process or elsewhere.
        machine: the machine.
        parameters: the machine's parameters, in SI units.
        perception: makes facts of observations.
        chain: turns the velocity that the activities request into the one that is sent to the base.
        settings: when sensor data are too old.
        operator: sends events to the machine.
        truth: the true pose of the robot at a tick, if known; it is only passed on and influences no decision.

    Raises:
        MachineFault: a signal, an activity or an action failed, and the machine does not handle it.
        LinkError: the robot cannot be reached.
    """
    supervisor: Supervisor[Facts, Command] | None = None
    trust = Trust(settings)
    hears = machine.model.events
    machine.warm_up()
    for index in count():
        began = perf_counter()
        seeing = not trust.reason
        observation = trust.judged(robot.observe())  # communicate
        observed = perf_counter()
        blind = trust.reason
        sent = tuple(event_text(machine.model, one) for one in operator.events(index, observation.time))
        facts = perception.facts(observation)  # prepare
        noticed = (BLINDED, *facts.world.events) if blind and seeing else facts.world.events
        happened = (*(one for one in noticed if hears is None or one in hears), *sent)
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
        violations = monitor.look(facts, step)  # watch
        phases = Phases(
            observed - began,
            prepared - observed,
            coordinated - prepared,
            acted - coordinated,
            commanded - acted,
            perf_counter() - commanded,
        )
        report = StepReport(machine, step, supervisor.outcome, supervisor.variables, supervisor.arguments, violations)
        leading = next((state for state, _ in effects), "")
        really = None if truth is None else truth(index)
        place = "" if facts.world.surveyor is None else facts.world.surveyor.knowledge.value
        yield Tick(index, observation, report, leading, command, phases, sent, really, facts, place)  # log
        if supervisor.outcome is not None:
            return


def merged(commands: Iterable[Command]) -> Command:
    """One command from the requests of the active activities.

    The checker ensures that at most one of them uses the base; the others request no motion, so twists can be added.
    """
    forward = left = turn = 0.0
    ring, goal = False, None
    for command in commands:
        forward += command.twist.forward
        left += command.twist.left
        turn += command.twist.turn
        ring = ring or command.ring
        goal = goal or command.goal
    return Command(Twist(forward, left, turn), ring, goal=goal)
