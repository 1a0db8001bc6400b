"""A recorded run as a robot."""

from __future__ import annotations

from collections.abc import Mapping

from transport.messages import Command, Observation
from transport.recording.values import Recording
from transport.robot import LinkError


class ReplayRobot:
    """A robot that replays a recorded run, independent of its commands.

    Attributes:
        finished: the last observation has been answered.
    """

    def __init__(self, recording: Recording) -> None:
        self.finished = not recording.ticks
        self._ticks = recording.ticks
        self._next = 0

    def observe(self) -> Observation:
        """The next recorded observation, as it was.

        Raises:
            LinkError: the recording has ended.
        """
        if self._next >= len(self._ticks):
            raise LinkError("the recording has ended")
        return self._ticks[self._next].observation

    def command(self, command: Command) -> None:
        """Continue to the next observation."""
        del command
        self._next += 1
        self.finished = self._next >= len(self._ticks)

    def report(self) -> Mapping[str, object]:
        """Nothing: the referee is not recorded."""
        return {}

    def close(self) -> None:
        """Nothing to release."""
