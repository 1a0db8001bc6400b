"""The referee: judges a robot by the rules and the maze's goal; its verdict is data and a line of text."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from sim.body import Body
from sim.doors import SlidingDoor
from sim.geometry import Points, crosses, distances, outline_near, placed
from sim.maze import LEAVE, Goal, Leave, Maze, Nothing, Reach, Segments, Survive
from sim.settings import Rules
from sim.world import Contact, PhysicalWorld
from transport.arithmetic import cos_sin, distance_between, norm
from transport.messages import Command, Pose

STILL_DISTANCE = 0.01
"""A robot that stays within this distance of where it was, m ..."""
STILL_ANGLE = 0.02
"""... and within this angle, rad, stands still."""


class AttemptOutcome(StrEnum):
    """The state of an attempt, or how it ended."""

    RUNNING = "still inside"
    ESCAPED = "escaped"
    REACHED = "reached the goal"
    SURVIVED = "touched nothing to the end"
    TOUCHED = "touched something"
    STOOD_STILL = "stood still for too long"
    OUT_OF_TIME = "ran out of time"


SUCCESSES = (AttemptOutcome.ESCAPED, AttemptOutcome.REACHED, AttemptOutcome.SURVIVED)
"""The outcomes in which the robot has reached its goal."""


@dataclass(frozen=True, slots=True)
class RefereeReport:
    """The referee's verdict on one attempt.

    Attributes:
        outcome: the state of the attempt, or how it ended.
        reason: the outcome in words, with place and time where they matter.
        time: simulated time since the attempt began, s.
        path_length: how far the robot's origin travelled, m.
        clearance: smallest distance between the robot's outline and anything solid, m; zero if it touched something.
        doors_opened: names of the doors that it rang open, in order.
        contacts: what it touched, in order.
        rings: how often it rang.
        attempt: which attempt it was, counted from 1.
        goal: the goal.
    """

    outcome: AttemptOutcome
    reason: str
    time: float
    path_length: float
    clearance: float
    doors_opened: tuple[str, ...] = ()
    contacts: tuple[Contact, ...] = ()
    rings: int = 0
    attempt: int = 1
    goal: Goal = LEAVE

    @property
    def escaped(self) -> bool:
        """Whether the robot is out by the rules."""
        return self.outcome is AttemptOutcome.ESCAPED

    @property
    def solved(self) -> bool:
        """Whether the robot has reached its goal; without a goal, whether it has touched nothing."""
        if isinstance(self.goal, Nothing):
            return self.outcome in (AttemptOutcome.RUNNING, AttemptOutcome.SURVIVED) and not self.contacts
        return self.outcome in SUCCESSES

    @property
    def finished(self) -> bool:
        """Whether the attempt is over."""
        return self.outcome is not AttemptOutcome.RUNNING

    def line(self) -> str:
        """The verdict as one line."""
        head = self.outcome.value if self.outcome in SUCCESSES else f"failed: {self.reason}"
        if not self.finished:
            head = "touched nothing" if self.solved else f"unfinished: {self.reason}"
        doors = len(self.doors_opened)
        return (
            f"{head} after {self.time:.1f} s, path {self.path_length:.2f} m, "
            f"smallest clearance {self.clearance:.3f} m, {doors} door{'' if doors == 1 else 's'} opened"
        )


_UNDER_WAY = {
    Leave: "still inside",
    Reach: "not yet at the goal",
    Survive: "the time is not over",
    Nothing: "touched nothing so far",
}
"""The state of an attempt in progress, by its goal."""


def may_open(rules: Rules, corners: Points, origin: Pose, command: Command, doorway: Segments) -> str:
    """Why a door does not open for a robot that rings; empty if it does.

    Args:
        rules: the rules in force.
        corners: the robot's footprint in the world, m.
        origin: the robot's pose.
        command: what it commands together with the ring.
        doorway: the shut door, shape (1, 4).
    """
    if rules.lax_door:
        away = float(distances(np.array([[origin.x, origin.y]]), doorway).min())
        return "" if away <= 1.0 else f"the robot is {away:.2f} m from the door, farther than 1.00 m"
    if command.twist.speed > 0.0 or command.twist.turn != 0.0:
        return "the commanded velocity is not zero"
    away = float(distances(corners, doorway).max())
    if away > rules.door_reach:
        return f"a part of the robot is {away:.2f} m from the door, farther than {rules.door_reach:.2f} m"
    return ""


class Referee:
    """Watches one attempt of one robot."""

    def __init__(self, maze: Maze, rules: Rules, pose: Pose, began: float = 0.0, attempt: int = 1) -> None:
        """Args: the maze, the rules, the robot's pose now, the time, and which attempt this is, counted from 1."""
        self.attempt = attempt
        self._rules = rules
        self._goal = maze.goal
        self._time_limit = maze.time_limit
        self._gates = maze.exits.tolist()
        self._crossed = [False] * len(self._gates)
        self._began = self._time = began
        self._pose = self._anchor = pose
        self._anchor_time = began
        self._path_length = 0.0
        self._clearance = math.inf
        self._contacts: tuple[Contact, ...] = ()
        self._rings = 0
        self._rung: list[SlidingDoor] = []
        self._outcome, self._reason = AttemptOutcome.RUNNING, _UNDER_WAY[type(maze.goal)]

    @property
    def finished(self) -> bool:
        """Whether the attempt is over."""
        return self._outcome is not AttemptOutcome.RUNNING

    @property
    def verdict(self) -> RefereeReport:
        """The state of the attempt."""
        return RefereeReport(
            self._outcome,
            self._reason,
            self._time - self._began,
            self._path_length,
            self._clearance,
            tuple(door.door.name for door in self._rung if door.has_opened),
            self._contacts,
            self._rings,
            self.attempt,
            self._goal,
        )

    def rang(self, doors: Iterable[SlidingDoor]) -> None:
        """The robot rang; these doors must open."""
        if not self.finished:
            self._rings += 1
            self._rung += [door for door in doors if door not in self._rung]

    def carried(self, pose: Pose) -> None:
        """The robot was carried elsewhere: that does not count as driving or as leaving."""
        self._pose = pose
        self._crossed = [False] * len(self._gates)

    def watch(self, time: float, pose: Pose, world: PhysicalWorld, name: str, contacts: tuple[Contact, ...]) -> None:
        """Record the pose of the robot after a tick.

        Args:
            time: simulated time, s.
            pose: the robot's true pose.
            world: where it is.
            name: which robot it is.
            contacts: what it touched during the tick.
        """
        if self.finished:
            return
        before, self._pose, self._time = self._pose, pose, time
        self._path_length += norm(pose.x - before.x, pose.y - before.y)
        self._contacts += contacts
        base = world.bases[name]
        if contacts:
            self._clearance = 0.0
        else:
            self._clearance = min(self._clearance, self._distance_if_smaller(pose, world, base, name))
        moved = norm(pose.x - self._anchor.x, pose.y - self._anchor.y) > STILL_DISTANCE
        turned = abs(math.remainder(pose.heading - self._anchor.heading, math.tau)) > STILL_ANGLE
        if moved or turned:
            self._anchor, self._anchor_time = pose, time
        self._outcome, self._reason = self._judge(before, base)

    def _distance_if_smaller(self, pose: Pose, world: PhysicalWorld, base: Body, name: str) -> float:
        """The robot's distance to what is solid if it may be the smallest so far; otherwise infinity."""
        reach = self._clearance + base.radius
        if world.room(name) > reach:
            return math.inf
        return outline_near(base.outline, (pose.x, pose.y, *cos_sin(pose.heading)), world.around(name), reach + 1e-6)

    def _judge(self, before: Pose, base: Body) -> tuple[AttemptOutcome, str]:
        if self._contacts and self._rules.contact_fails:
            return AttemptOutcome.TOUCHED, str(self._contacts[0])
        done = self._done(before, base)
        if done is not None:
            return done
        if isinstance(self._goal, Nothing):
            return self._ended_at_leisure()
        if self._time - self._anchor_time >= self._rules.still_limit - 1e-9:
            return AttemptOutcome.STOOD_STILL, f"stood still for {self._rules.still_limit:g} s"
        if self._time >= self._time_limit - 1e-9:
            return AttemptOutcome.OUT_OF_TIME, f"ran out of the {self._time_limit:g} s"
        return AttemptOutcome.RUNNING, _UNDER_WAY[type(self._goal)]

    def _ended_at_leisure(self) -> tuple[AttemptOutcome, str]:
        """The outcome and its reason without a goal."""
        if self._time < self._time_limit - 1e-9:
            return AttemptOutcome.RUNNING, _UNDER_WAY[Nothing]
        if self._contacts:
            return AttemptOutcome.TOUCHED, str(self._contacts[0])
        return AttemptOutcome.SURVIVED, f"touched nothing in the {self._time_limit:g} s"

    def _done(self, before: Pose, base: Body) -> tuple[AttemptOutcome, str] | None:
        """The outcome and its reason if the goal is reached now."""
        match self._goal:
            case Leave() if self._out(before, base):
                return AttemptOutcome.ESCAPED, "the whole robot is across the exit"
            case Reach(place, radius) if distance_between(place, (self._pose.x, self._pose.y)) <= radius:
                return AttemptOutcome.REACHED, f"the robot is within {radius:g} m of the goal"
            case Survive(duration) if self._time - self._began >= duration - 1e-9:
                if self._contacts:
                    return AttemptOutcome.TOUCHED, str(self._contacts[0])
                return AttemptOutcome.SURVIVED, f"touched nothing for {duration:g} s"
        return None

    def _out(self, before: Pose, base: Body) -> bool:
        """Whether the robot's origin went out through an exit and all of its outline has followed."""
        now = self._pose
        for index, gate in enumerate(self._gates):
            passed = crosses((before.x, before.y), (now.x, now.y), gate)
            self._crossed[index] = passed > 0 or (self._crossed[index] and passed == 0)
            if self._crossed[index]:
                ax, ay, bx, by = gate
                corners = placed(base.outline, now)
                side = (bx - ax) * (corners[:, 1] - ay) - (by - ay) * (corners[:, 0] - ax)
                if float(side.min()) > 0.0:
                    return True
        return False
