"""The interface between a controller and a robot, in one process or over a network."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from transport.messages import Command, Observation


class LinkError(Exception):
    """The robot cannot be reached, or no longer; the message says what was tried and how to fix it."""


class NoAnswerError(LinkError):
    """No robot of that name answers on a network that is there."""


class Robot(Protocol):
    """A robot that is observed and commanded in turns: in memory, over a network or in hardware.

    In lockstep, a command advances the world to the next observation. In real time, ``observe`` waits for the next
    period and returns the newest data.
    """

    def observe(self) -> Observation:
        """The newest observation.

        Raises:
            LinkError: no data arrived from the robot within the link's time limit.
        """
        ...

    def command(self, command: Command) -> None:
        """Send a command in answer to the last observation.

        Raises:
            LinkError: the command could not be passed.
        """
        ...

    def close(self) -> None:
        """Stop the robot and release it; a second call does nothing."""
        ...


@runtime_checkable
class Halting(Protocol):
    """A robot that moves on by itself, and can be watched until it is at rest."""

    def halt(self) -> bool:
        """Keep it stopped until its odometry shows it at rest; whether it did so within a time limit."""
        ...
