"""A robot in real time, seen from its controller: the newest data of each period, and their age."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

from transport.arithmetic import norm
from transport.clock import Clock, MonotonicClock, Pace
from transport.description import RobotDescription
from transport.driver import RobotDriver
from transport.messages import STOP, Command, LinkStatus, Observation, Odometry, wrap_angle
from transport.robot import LinkError
from transport.senses import Senses
from transport.settings import LinkSettings
from transport.timeline import Timeline

HALT = 3.0
"""How long a robot is watched until it is at rest, s."""
SLOW, SLOW_TURN = 0.02, 0.05
"""A robot that is not faster is at rest, m/s and rad/s: the noise of odometry."""
_FIRST = 0.02
"""The interval of checks for the first data, s."""


class RealtimeRobot:
    """A robot that moves on whether or not it is commanded.

    Attributes:
        dropped: how many messages were dropped, by reason.
        clock_faults: how often the robot's clock misbehaved, by what it did.
        reconnects: how often data came again after they had been stale.
    """

    def __init__(
        self, driver: RobotDriver, description: RobotDescription, settings: LinkSettings, clock: Clock | None = None
    ) -> None:
        self.reconnects = 0
        self._driver, self._description, self._settings = driver, description, settings
        self._clock = clock or MonotonicClock()
        self._pace = Pace(description.period, self._clock)
        self._senses = Senses(description.laser)
        self._timeline = Timeline(settings.stale)
        self._answers = 0
        self._stale = False

    @property
    def dropped(self) -> Counter[str]:
        """How many messages were dropped, by reason."""
        return self._driver.dropped + self._senses.dropped

    @property
    def clock_faults(self) -> Counter[str]:
        """How often the robot's clock misbehaved, by what it did."""
        return self._timeline.faults

    @property
    def finished(self) -> bool:
        """Whether a referee has ended the episode; never on hardware."""
        return self._driver.finished

    def report(self) -> Mapping[str, object]:
        """The referee's verdict so far; empty on hardware.

        Raises:
            LinkError: the robot's side no longer answers.
        """
        return self._driver.report()

    @property
    def overruns(self) -> int:
        """How many periods the controller missed because it was too slow."""
        return self._pace.overruns

    def ready(self) -> None:
        """Wait until scan and odometry are available, fresh and plausible; the robot does not move before.

        Raises:
            LinkError: they are not within the time limit; the message says what is wrong with them.
        """
        deadline = self._clock.now() + self._settings.connect
        while not self._complete():
            if self._clock.now() >= deadline:
                raise LinkError(f"cannot drive {self._description.name!r}: {self._missing()}")
            self._clock.wait(_FIRST)
            self._senses.take(self._driver.sense(), self._clock.now())
        self._pace = Pace(self._description.period, self._clock)

    def observe(self) -> Observation:
        """Wait for the next period, and return the newest data.

        The observation's stamp is the robot's own as long as its clock runs: see :class:`transport.timeline.Timeline`.

        Raises:
            LinkError: the robot has not been heard for too long.
        """
        self._pace.wait()
        sensed, now = self._driver.sense(), self._clock.now()
        self._senses.take(sensed, now)
        scan, odometry = self._senses.scan, self._senses.odometry
        if scan is None or odometry is None or self._senses.silent(now, self._settings.silence):
            raise LinkError(f"{self._description.name!r} {self._lost()}")
        self._answers = max(scan.stamp, odometry.stamp)
        fresh = sensed.scan is not None or sensed.odometry is not None
        stamp = self._timeline.tick(self._answers, now, fresh=fresh)
        return Observation(stamp, scan, odometry, sensed.door, self._status(now), sensed.navigation)

    def command(self, command: Command) -> None:
        """Send a command in answer to the last observation; never waits."""
        self._driver.drive(replace(command, answers=self._answers))

    def halt(self) -> bool:
        """Keep the robot stopped until its odometry shows it at rest; whether it did so within ``HALT`` seconds."""
        deadline, before = self._clock.now() + HALT, None
        while self._clock.now() < deadline:
            self.command(Command(STOP))
            self._pace.wait()
            sensed = self._driver.sense()
            self._senses.take(sensed, self._clock.now())
            if sensed.odometry is None or self._senses.refused:
                continue
            if before is not None and _rests(before, sensed.odometry):
                return True
            before = sensed.odometry
        return False

    def close(self) -> None:
        """Stop the robot and release it; a second call does nothing."""
        self._driver.close()

    def _complete(self) -> bool:
        return not self._senses.refused and max(self._senses.ages(self._clock.now())) < self._settings.stale

    def _missing(self) -> str:
        """The data that is missing since the start of the search, or why the data is unusable."""
        limit = self._settings.connect
        missing = self._senses.silent(self._clock.now(), limit) or "fresh scan or odometry"
        if self._senses.refused:
            return self._senses.refused
        heard = self._driver.heard()
        return f"no {missing} has come within {limit:g} s" + (f": {heard}" if heard else "")

    def _lost(self) -> str:
        """What the robot no longer sends."""
        limit, refused = self._settings.silence, self._senses.refused
        silent = self._senses.silent(self._clock.now(), limit)
        if refused:
            return f"has sent no usable data for {limit:g} s: {refused}"
        return f"has sent no data for {limit:g} s" if "and" in silent else f"has sent no {silent} for {limit:g} s"

    def _status(self, now: float) -> LinkStatus:
        ages = self._senses.ages(now)
        stale = max(ages) > self._settings.stale
        self.reconnects += self._stale and not stale
        self._stale = stale
        return LinkStatus(*ages, self.reconnects, self._driver.stopped, self._senses.refused)


def _rests(before: Odometry, now: Odometry) -> bool:
    """Whether a robot was at rest between two odometries, by the velocities that they report and by the poses."""
    seconds = (now.stamp - before.stamp) / 1e9
    if seconds <= 0.0:
        return False
    moved = norm(now.x - before.x, now.y - before.y)
    turned = abs(wrap_angle(now.pose.heading - before.pose.heading))
    slow = max(before.twist.speed, now.twist.speed, moved / seconds) <= SLOW
    return slow and max(abs(before.twist.turn), abs(now.twist.turn), turned / seconds) <= SLOW_TURN
