"""The referee: holds a robot to the challenge's rules and says how it did, as data and as a line."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from sim.geometry import Points, crosses, distances, outline_distance
from sim.maze import Maze, Segments
from sim.settings import Rules
from sim.world import Contact
from transport.messages import Command, Pose

STILL_DISTANCE = 0.01
"""A robot that stays within this distance of where it was, m ..."""
STILL_ANGLE = 0.02
"""... and within this angle, rad, stands still."""


class Outcome(StrEnum):
    """How an attempt stands or ended."""

    RUNNING = "still inside"
    ESCAPED = "escaped"
    TOUCHED = "touched something"
    STOOD_STILL = "stood still for too long"
    OUT_OF_TIME = "ran out of time"


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the referee says of one attempt.

    Attributes:
        outcome: how the attempt stands or ended.
        reason: the outcome in words, with place and time where they matter.
        time: simulated time since the attempt began, s.
        path_length: how far the robot's origin travelled, m.
        clearance: smallest distance between the robot's outline and anything solid, m; zero if it touched something.
        doors_opened: names of the doors that it made open, in order.
        contacts: what it touched, in order.
        rings: how often it rang.
    """

    outcome: Outcome
    reason: str
    time: float
    path_length: float
    clearance: float
    doors_opened: tuple[str, ...] = ()
    contacts: tuple[Contact, ...] = ()
    rings: int = 0

    @property
    def escaped(self) -> bool:
        """Whether the robot is out by the rules."""
        return self.outcome is Outcome.ESCAPED

    @property
    def finished(self) -> bool:
        """Whether the attempt is over."""
        return self.outcome is not Outcome.RUNNING

    def line(self) -> str:
        """The verdict as one line."""
        head = (
            "escaped" if self.escaped else f"failed: {self.reason}" if self.finished else f"unfinished: {self.reason}"
        )
        doors = len(self.doors_opened)
        return (
            f"{head} after {self.time:.1f} s, path {self.path_length:.2f} m, "
            f"smallest clearance {self.clearance:.3f} m, {doors} door{'' if doors == 1 else 's'} opened"
        )


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
    """Watches one robot's attempt."""

    def __init__(self, maze: Maze, rules: Rules, pose: Pose, began: float = 0.0) -> None:
        self._rules = rules
        self._time_limit = maze.time_limit
        self._gates = maze.exits.tolist()
        self._crossed = [False] * len(self._gates)
        self._began = began
        self._pose = self._anchor = pose
        self._anchor_time = began
        self._verdict = Verdict(Outcome.RUNNING, "still inside", 0.0, 0.0, math.inf)

    @property
    def verdict(self) -> Verdict:
        """How the attempt stands."""
        return self._verdict

    def rang(self, opened: tuple[str, ...]) -> None:
        """The robot rang and made these doors open."""
        if self._verdict.finished:
            return
        new = tuple(name for name in opened if name not in self._verdict.doors_opened)
        self._verdict = replace(
            self._verdict, rings=self._verdict.rings + 1, doors_opened=self._verdict.doors_opened + new
        )

    def watch(self, time: float, pose: Pose, corners: Points, solids: Segments, contacts: tuple[Contact, ...]) -> None:
        """Take note of where the robot is after a tick.

        Args:
            time: simulated time, s.
            pose: the robot's true pose.
            corners: its footprint in the world, m.
            solids: all that it could touch, shape (n, 4).
            contacts: what it touched during the tick.
        """
        if self._verdict.finished:
            return
        before, self._pose = self._pose, pose
        clearance = 0.0 if contacts else self._clearance(pose, corners, solids)
        self._verdict = replace(
            self._verdict,
            time=time - self._began,
            path_length=self._verdict.path_length + math.hypot(pose.x - before.x, pose.y - before.y),
            clearance=min(self._verdict.clearance, clearance),
            contacts=self._verdict.contacts + contacts,
        )
        self._note_motion(time, pose)
        outcome, reason = self._judge(time, before, corners)
        self._verdict = replace(self._verdict, outcome=outcome, reason=reason)

    def _clearance(self, pose: Pose, corners: Points, solids: Segments) -> float:
        """The distance to what is near enough to lower the smallest clearance; infinite if nothing is."""
        origin = np.array([[pose.x, pose.y]])
        radius = float(np.hypot(corners[:, 0] - pose.x, corners[:, 1] - pose.y).max())
        near = solids[distances(origin, solids)[0] < self._verdict.clearance + radius]
        return outline_distance(corners, near)

    def _note_motion(self, time: float, pose: Pose) -> None:
        moved = math.hypot(pose.x - self._anchor.x, pose.y - self._anchor.y) > STILL_DISTANCE
        turned = abs(math.remainder(pose.heading - self._anchor.heading, math.tau)) > STILL_ANGLE
        if moved or turned:
            self._anchor, self._anchor_time = pose, time

    def _judge(self, time: float, before: Pose, corners: Points) -> tuple[Outcome, str]:
        verdict = self._verdict
        if verdict.contacts and self._rules.contact_fails:
            return Outcome.TOUCHED, str(verdict.contacts[0])
        if self._out(before, corners):
            return Outcome.ESCAPED, "the whole robot is across the exit"
        if time - self._anchor_time >= self._rules.still_limit - 1e-9:
            return Outcome.STOOD_STILL, f"stood still for {self._rules.still_limit:g} s"
        if time >= self._time_limit - 1e-9:
            return Outcome.OUT_OF_TIME, f"ran out of the {self._time_limit:g} s"
        return Outcome.RUNNING, "still inside"

    def _out(self, before: Pose, corners: Points) -> bool:
        now = self._pose
        for index, gate in enumerate(self._gates):
            passed = crosses((before.x, before.y), (now.x, now.y), gate)
            self._crossed[index] = passed > 0 or (self._crossed[index] and passed == 0)
            if self._crossed[index]:
                ax, ay, bx, by = gate
                side = (bx - ax) * (corners[:, 1] - ay) - (by - ay) * (corners[:, 0] - ax)
                if float(side.min()) > 0.0:
                    return True
        return False
