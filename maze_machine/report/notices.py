"""Immediate messages while a machine drives: that the robot is stopped, and why."""

from __future__ import annotations

import math

from rich.console import Console

from maze_machine.drive.tick import Tick
from transport.messages import Pose

UNMOVED = 2.0
"""How long a robot may ignore commands to move before a message, s."""
SLOW, SLOWLY = 0.05, 0.1
"""Slower commands are ignored, since their motion is hard to detect in this time, m/s and rad/s."""
SHIFT, TURN = 0.01, 0.02
"""The least motion that counts, m and rad."""


class Notices:
    """Prints a line when the loop stops the base, when the base may move again, and when commands have no effect.

    A watcher of ticks.
    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._first: Tick | None = None
        self._blind = False
        self._told: float | None = None
        self._moves = False

    def __call__(self, tick: Tick) -> None:
        """Take in a tick."""
        self._first = self._first or tick
        if bool(tick.blind) != self._blind:
            self._blind = bool(tick.blind)
            self._say(tick, f"the base was stopped: {tick.blind}" if self._blind else "the base may move again")
        if not self._moves:
            self._look_for_movement(tick, self._first.pose)

    def _look_for_movement(self, tick: Tick, start: Pose) -> None:
        """Show once that the robot does not move, if it has never moved since the run began."""
        pose, twist = tick.pose, tick.command.twist
        shifted = math.hypot(pose.x - start.x, pose.y - start.y) > SHIFT
        self._moves = shifted or abs(math.remainder(pose.heading - start.heading, math.tau)) > TURN
        if twist.speed < SLOW and abs(twist.turn) < SLOWLY:
            self._told = None
        elif self._told is None:
            self._told = tick.time
        elif tick.time - self._told > UNMOVED and not self._moves:
            self._moves = True
            way_out = "does the robot subscribe to this topic with this type (link.command, link.command_type)?"
            self._say(tick, f"the robot is commanded to move, but its odometry does not change: {way_out}")

    def _say(self, tick: Tick, what: str) -> None:
        began = tick.time if self._first is None else self._first.time
        self._console.print(f"{tick.time - began:.1f} s: {what}", highlight=False, soft_wrap=True)
