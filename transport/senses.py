"""The newest scan and odometry that can be trusted, how old they are, and why others were refused."""

from __future__ import annotations

from collections import Counter

from transport.description import Laser
from transport.driver import Sensed
from transport.messages import NANOSECONDS, Odometry, Scan
from transport.sanity import ScanError, conformed, odometry_fault

DRIFT = 500e-6
"""By how much two clocks may run apart, s per s: the most by which NTP slews one."""


class Freshness:
    """The age of a sensor's newest message, without synchronised clocks.

    The fastest message so far counts as having no delay; the extra time of another one is its delay.
    """

    def __init__(self) -> None:
        self._stamp = 0
        self._quickest = 0.0
        self._at: float | None = None

    def arrived(self, stamp: int, now: float) -> None:
        """A message with this stamp (ns) was taken at ``now`` (s).

        A message with the stamp of the last one, unless that is zero, is the same message again, and no newer.
        """
        if self._at is not None and stamp == self._stamp != 0:
            return
        delay = now - stamp / NANOSECONDS
        if self._at is None or stamp <= self._stamp:
            # The first message, or the first of a robot whose clock was set back or stands still.
            self._quickest = delay
        else:
            self._quickest = min(self._quickest + DRIFT * (now - self._at), delay)
        self._stamp, self._at = stamp, now

    def age(self, now: float) -> float:
        """Age of the newest message, s; infinite before the first."""
        if self._at is None:
            return float("inf")
        return max(0.0, now - self._stamp / NANOSECONDS - self._quickest)

    def silence(self, now: float) -> float:
        """Since when nothing has come, s; infinite before the first message."""
        return float("inf") if self._at is None else now - self._at


class Senses:
    """Receives the data of a robot's driver.

    Attributes:
        scan: the newest scan that can be trusted, as the profile's laser gives it.
        odometry: the newest odometry that can be trusted.
        dropped: how many messages were refused, by reason.
    """

    def __init__(self, laser: Laser) -> None:
        self.scan: Scan | None = None
        self.odometry: Odometry | None = None
        self.dropped: Counter[str] = Counter()
        self._laser = laser
        self._scan, self._odometry = Freshness(), Freshness()
        self._scan_fault = self._odometry_fault = ""

    def take(self, sensed: Sensed, now: float) -> None:
        """Process data that arrived at ``now`` (s, monotonic)."""
        if sensed.scan is not None:
            try:
                self.scan = conformed(sensed.scan, self._laser)
            except ScanError as error:
                self._scan_fault = str(error)
                self.dropped[self._scan_fault] += 1
            else:
                self._scan_fault = ""
                self._scan.arrived(sensed.scan.stamp, now)
        if sensed.odometry is not None:
            self._odometry_fault = odometry_fault(sensed.odometry)
            if self._odometry_fault:
                self.dropped[self._odometry_fault] += 1
            else:
                self.odometry = sensed.odometry
                self._odometry.arrived(sensed.odometry.stamp, now)

    @property
    def refused(self) -> str:
        """Why the newest scan or odometry was refused, or nothing."""
        return self._scan_fault or self._odometry_fault

    def ages(self, now: float) -> tuple[float, float]:
        """Age of the scan and of the odometry, s; infinite for one that has not come yet."""
        return self._scan.age(now), self._odometry.age(now)

    def silent(self, now: float, limit: float) -> str:
        """Which sensor has sent nothing that can be trusted for longer than a limit (s), or nothing."""
        silences = (("scan", self._scan.silence(now)), ("odometry", self._odometry.silence(now)))
        return " and no ".join(sensor for sensor, silence in silences if silence > limit)
