"""The record of one tick: one value for the trace, the recording, the page, the network and the pictures."""

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
"""Every how many beams of a scan one is shown."""


class Phases(NamedTuple):
    """The time of each phase of a tick, s of the wall clock; statistics that influence no decision.

    Perception is lazy: its time counts for the phase that first uses a fact.
    """

    observe: float
    prepare: float
    coordinate: float
    act: float
    command: float
    watch: float

    @property
    def thinking(self) -> float:
        """What the controller itself took: all but waiting for the robot, s."""
        return self.prepare + self.coordinate + self.act + self.watch


@dataclass(frozen=True)
class Tick:
    """The record of one tick; descriptions are computed once, on first use.

    Attributes:
        index: number of the tick, from 0.
        observation: the sensor data.
        report: the step of the machine.
        leading: name of the first state whose activity requested an effect; empty if none did.
        command: the command to the robot.
        phases: the time of each phase.
        events: the external events of this tick.
        truth: the true pose of the robot, in the frame of the maze; None if unknown.
        facts: the results of perception; None if they are not kept.
        place: what the robot knows of its place on its map: known, doubtful or lost; empty if it keeps no map.
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
    place: str = ""

    @property
    def step(self) -> Macrostep:
        """The engine's record of the step."""
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
        """Properties and assumptions of the machine that are newly violated."""
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
        """The pose of the robot by odometry."""
        return self.observation.odometry.pose

    @cached_property
    def doing(self) -> str:
        """The state that represents the tick: that whose activity requested an effect, or the first innermost one."""
        states, indices = self.report.machine.model.states, self.report.machine.indices
        innermost = (name for name in self.configuration if not states[indices[name]].children)
        return self.leading or next(innermost, "")

    @cached_property
    def line(self) -> TickLine:
        """The sensed, decided and commanded values: the same for the same run, in one process or over the network."""
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
        if report.violated:
            line["violated"] = report.violated
        if report.broken:
            line["broken"] = report.broken
        return line

    @cached_property
    def json(self) -> TickJson:
        """The full JSON values of the tick: the trace line, and details for watchers."""
        report, truth = self.report, self.truth
        really = {} if truth is None else {"truth": [truth.x, truth.y, truth.heading]}
        mapped = {"place": self.place} if self.place else {}
        more = {
            "doing": self.doing,
            "fired": [one.index for one in report.transitions],
            "regions": report.regions,
            "activities": report.activities,
            "outcomes": [list(one) for one in report.outcomes],
            "variables": report.values,
            "why": report.why,
        }
        return cast(TickJson, {**self.line, **more, **really, **mapped})


def shown_ranges(scan: Scan) -> list[int]:
    """Some beams of a scan for a picture: whole centimetres, -1 where a beam hit nothing."""
    ranges = scan.ranges[::STRIDE]
    hit = np.isfinite(ranges) & (ranges >= scan.geometry.range_min)
    centimetres: list[int] = np.where(hit, np.round(np.where(hit, ranges, 0.0) * 100), -1).astype(int).tolist()
    return centimetres
