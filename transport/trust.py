"""The rule that stops a robot without trustworthy sensor data, and lets it continue."""

from __future__ import annotations

from dataclasses import replace

from transport.messages import LinkStatus, Observation
from transport.settings import LinkSettings


class Trust:
    """Whether a robot may move by its sensor data.

    It stops at once when its newest scan or odometry was refused, or is older than ``link.stale``. It continues once
    both have been fresh and credible for ``link.resume`` without a break, so a sensor that comes and goes stops it.

    Attributes:
        reason: why the robot must stop; empty if it may move.
    """

    def __init__(self, settings: LinkSettings) -> None:
        self.reason = ""
        self._settings = settings
        self._good_since: float | None = None

    def look(self, status: LinkStatus, time: float) -> str:
        """Update with the state of the sensors.

        Args:
            status: the ages of the sensors' data, and why they were refused.
            time: s, on any clock that does not go back.

        Returns:
            Why the robot must stop, or nothing.
        """
        fault = status.refused or self._too_old(status)
        if fault:
            self.reason, self._good_since = fault, None
        elif self.reason:
            self._good_since = time if self._good_since is None else self._good_since
            if time - self._good_since >= self._settings.resume - 1e-9:
                self.reason = ""
        return self.reason

    def judged(self, observation: Observation) -> Observation:
        """An observation with the reason to stop in ``link.blind``."""
        reason = self.look(observation.link, observation.time)
        if observation.link.blind == reason:
            return observation
        return replace(observation, link=replace(observation.link, blind=reason))

    def _too_old(self, status: LinkStatus) -> str:
        ages = (("scan", status.scan_age), ("odometry", status.odometry_age))
        return " and ".join(f"no {sensor} for {age:.2f} s" for sensor, age in ages if age > self._settings.stale)
