"""What happened in one tick: one value for the trace, the recording, the page, the network and the pictures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np

from hsm import Macrostep
from hsm.engine.monitoring import Violation
from hsm.interchange.reports import StepReport
from maze_machine.drive.tick_json import TickJson, TickLine
from perception.facts import Facts
from transport.messages import Command, Observation, Pose, Scan

STRIDE = 8
"""Every this many beams of a scan are shown."""


class Phases(NamedTuple):
    """Where a tick's time went, s of the wall clock; statistics that nothing decides by.

    Perception is lazy: what it takes falls to the phase that first asks for a fact.
    """

    observe: float
    prepare: float
    coordinate: float
    act: float
    command: float


@dataclass(frozen=True)
class Tick:
    """What happened in one tick; how it is described is computed when it is asked for, and once.

    Attributes:
        index: number of the tick, from 0.
        observation: what the robot sensed.
        report: what the machine did about it.
        leading: name of the first state whose activity asked for something; empty where none did.
        command: what the robot was commanded.
        phases: where the time went.
        events: the events that somebody outside has sent for this tick.
        truth: where the robot really was, in the frame of the maze; None where nobody knows.
        facts: what perception made of the observation; None where it is not kept.
    """

    index: int
    observation: Observation
    report: StepReport
    leading: str
    command: Command
    phases: Phases
    events: tuple[str, ...] = ()
    truth: Pose | None = None
    facts: Facts | None = None

    @property
    def step(self) -> Macrostep:
        """What the engine says of the step."""
        return self.report.step

    @property
    def configuration(self) -> tuple[str, ...]:
        """Names of all active states, in document order."""
        return self.report.states

    @property
    def outcome(self) -> str | None:
        """How the machine ended, or None while it runs."""
        return self.report.outcome

    @property
    def violations(self) -> tuple[Violation, ...]:
        """Properties of the machine that do not hold, and did before."""
        return self.report.violations

    @property
    def variables(self) -> Mapping[str, Any]:
        """Variables and parameters after the step, by their full names."""
        return self.report.variables

    @property
    def blind(self) -> str:
        """Why the loop keeps the base stopped; empty where scan and odometry are fresh and credible."""
        return self.observation.link.blind

    @property
    def time(self) -> float:
        """The tick's time on the robot's clock, s."""
        return self.observation.time

    @property
    def pose(self) -> Pose:
        """Where the odometry sees the robot."""
        return self.observation.odometry.pose

    @cached_property
    def doing(self) -> str:
        """The one state that names the tick: that whose activity asked for something, or the first innermost one."""
        states, indices = self.report.machine.model.states, self.report.machine.indices
        innermost = (name for name in self.configuration if not states[indices[name]].children)
        return self.leading or next(innermost, "")

    @cached_property
    def line(self) -> TickLine:
        """What was sensed, decided and commanded: the same for the same run, wherever the robot is."""
        pose, twist, report = self.pose, self.command.twist, self.report
        line: TickLine = {
            "tick": self.index,
            "stamp": self.observation.stamp,
            "states": list(report.states),
            "taken": list(report.taken),
            "pose": [pose.x, pose.y, pose.heading],
            "twist": [twist.forward, twist.left, twist.turn],
            "ring": self.command.ring,
        }
        if (goal := self.command.goal) is not None:
            line["goal"] = [goal.x, goal.y, goal.heading]
        if self.events:
            line["events"] = list(self.events)
        if report.sent:
            line["sent"] = list(report.sent)
        if self.blind:
            line["blind"] = self.blind
        if report.outcome is not None:
            line["outcome"] = report.outcome
        if report.violations:
            line["violated"] = report.violated
        return line

    @cached_property
    def json(self) -> TickJson:
        """All that is said of the tick, as JSON values: the line, and what somebody who watches wants to know."""
        report, truth = self.report, self.truth
        really = {} if truth is None else {"truth": [truth.x, truth.y, truth.heading]}
        more = {
            "doing": self.doing,
            "fired": [one.index for one in report.transitions],
            "regions": report.regions,
            "activities": report.activities,
            "outcomes": [list(one) for one in report.outcomes],
            "variables": report.values,
            "why": report.why,
        }
        return cast(TickJson, {**self.line, **more, **really})


def shown_ranges(scan: Scan) -> list[int]:
    """Some beams of a scan for a picture: whole centimetres, -1 where a beam hit nothing."""
    ranges = scan.ranges[::STRIDE]
    hit = np.isfinite(ranges) & (ranges >= scan.geometry.range_min)
    centimetres: list[int] = np.where(hit, np.round(np.where(hit, ranges, 0.0) * 100), -1).astype(int).tolist()
    return centimetres
