"""A robot in real time, seen from its controller: ten beats a second, the newest data of each, and how old they are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from transport.clock import Clock, MonotonicClock, Pace
from transport.description import RobotDescription
from transport.driver import Driver, Sensed
from transport.messages import NANOSECONDS, Command, LinkStatus, Observation, Odometry, Scan
from transport.robot import LinkError
from transport.sanity import odometry_fault, scan_fault
from transport.settings import LinkSettings

_FIRST = 0.02
"""Between two looks for the first data, s."""


class Freshness:
    """How old a sensor's newest message is, without the robot's clock and this one's agreeing.

    The quickest message so far is taken to have come at once; what another took longer is its delay.
    """

    def __init__(self) -> None:
        self._stamp = 0
        self._quickest: float | None = None

    def arrived(self, stamp: int, now: float) -> None:
        """A message with this stamp (ns) was taken at ``now`` (s)."""
        if self._quickest is None or stamp <= self._stamp:
            # The first message, or the first of a robot whose clock was set back.
            self._quickest = now - stamp / NANOSECONDS
        self._stamp = stamp
        self._quickest = min(self._quickest, now - stamp / NANOSECONDS)

    def age(self, now: float) -> float:
        """Age of the newest message, s."""
        return 0.0 if self._quickest is None else max(0.0, now - self._stamp / NANOSECONDS - self._quickest)


class RealtimeRobot:
    """A robot that moves on whether or not it is commanded.

    Attributes:
        dropped: how many messages were dropped, by reason.
        reconnects: how often data came again after they had been stale.
    """

    def __init__(
        self, driver: Driver, description: RobotDescription, settings: LinkSettings, clock: Clock | None = None
    ) -> None:
        self.dropped: Counter[str] = Counter()
        self.reconnects = 0
        self._driver, self._description, self._settings = driver, description, settings
        self._clock = clock or MonotonicClock()
        self._pace = Pace(description.period, self._clock)
        self._heard = self._clock.now()
        self._scan: Scan | None = None
        self._odometry: Odometry | None = None
        self._scan_freshness, self._odometry_freshness = Freshness(), Freshness()
        self._fault = ""
        self._stale = False

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
        """How many beats the controller missed because it was too slow."""
        return self._pace.overruns

    def ready(self) -> None:
        """Wait until scan and odometry are there, fresh and sane; before, nothing drives.

        Raises:
            LinkError: they are not within the time limit; the message says what is wrong with them.
        """
        deadline = self._clock.now() + self._settings.connect
        while not self._complete():
            if self._clock.now() >= deadline:
                raise LinkError(self._missing())
            self._clock.wait(_FIRST)
            self._take(self._driver.sense())
        self._pace = Pace(self._description.period, self._clock)

    def observe(self) -> Observation:
        """Wait for the next beat; the newest data then.

        Raises:
            LinkError: the robot has not been heard for too long.
        """
        self._pace.wait()
        sensed = self._driver.sense()
        self._take(sensed)
        if self._scan is None or self._odometry is None or self._silent():
            raise LinkError(self._missing())
        status = self._status()
        stamp = max(self._scan.stamp, self._odometry.stamp)
        return Observation(stamp, self._scan, self._odometry, sensed.door, status)

    def command(self, command: Command) -> None:
        """Send a command in answer to the last observation; never waits."""
        self._driver.drive(command)

    def close(self) -> None:
        """Stop the robot and let go of it; a second call does nothing."""
        self._driver.close()

    def _take(self, sensed: Sensed) -> None:
        now = self._clock.now()
        if sensed.scan is not None and not self._refused(scan_fault(sensed.scan, self._description.laser)):
            self._scan = sensed.scan
            self._scan_freshness.arrived(sensed.scan.stamp, now)
            self._heard = now
        if sensed.odometry is not None and not self._refused(odometry_fault(sensed.odometry)):
            self._odometry = sensed.odometry
            self._odometry_freshness.arrived(sensed.odometry.stamp, now)

    def _refused(self, fault: str) -> bool:
        self.dropped.update([fault] if fault else [])
        self._fault = fault or self._fault
        return bool(fault)

    def _complete(self) -> bool:
        now, stale = self._clock.now(), self._settings.stale
        ages = self._scan_freshness.age(now), self._odometry_freshness.age(now)
        return self._scan is not None and self._odometry is not None and max(ages) < stale

    def _silent(self) -> bool:
        return self._clock.now() - self._heard > self._settings.silence

    def _missing(self) -> str:
        name = self._description.name
        if self._fault:
            return f"will not drive {name!r}: {self._fault}"
        sensor = "scan" if self._scan is None else "odometry" if self._odometry is None else ""
        if sensor:
            return f"will not drive {name!r}: no {sensor} has come within {self._settings.connect:g} s"
        return f"{name!r} has not been heard for {self._settings.silence:g} s"

    def _status(self) -> LinkStatus:
        now = self._clock.now()
        scan_age, odometry_age = self._scan_freshness.age(now), self._odometry_freshness.age(now)
        stale = max(scan_age, odometry_age) > self._settings.stale
        self.reconnects += self._stale and not stale
        self._stale = stale
        return LinkStatus(scan_age, odometry_age, self.reconnects, self._driver.stopped)
