"""Whether the robot knows where it is on its map: known, doubtful or lost."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from perception.mapping.agreement import Agreement
from perception.mapping.matching import Match
from perception.mapping.settings import PlaceSettings


class Knowledge(StrEnum):
    """What the robot knows of its place on the map."""

    KNOWN = "known"
    DOUBTFUL = "doubtful"
    LOST = "lost"


@dataclass(slots=True)
class Confidence:
    """Counts scans that fit the map and scans that do not.

    The first scan that does not fit makes the place doubtful; some that fit, one after the other, make it known again;
    many that do not, or a doubt that scans do not settle, and the robot is lost until it has been found.

    Attributes:
        settings: how many scans.
        knowledge: what the robot knows of its place.
    """

    settings: PlaceSettings
    knowledge: Knowledge = Knowledge.KNOWN
    _fitting: int = 0
    _misfits: int = 0
    _doubts: int = 0

    def believes(self, match: Match | None, agreement: Agreement) -> bool:
        """Whether a place is the robot's: the grid agrees with the scan there, or all but one sector of it does.

        Args:
            match: of the scan with the last keyframes, that has led to the place; None where odometry has.
            agreement: of the scan with the grid there.
        """
        settings = self.settings
        if agreement.hits < settings.least_hits:
            return match is not None
        if agreement.fits(settings):
            return True
        unchanged = match is not None and match.share >= settings.unchanged
        return (unchanged or agreement.share >= settings.unchanged_walls) and agreement.elsewhere >= settings.elsewhere

    def saw(self, *, fits: bool) -> None:
        """Take in whether a scan fits the map at the robot's estimated place."""
        if self.knowledge is Knowledge.LOST:
            return
        self._fitting, self._misfits = (self._fitting + 1, 0) if fits else (0, self._misfits + 1)
        self._doubts = 0 if self.knowledge is Knowledge.KNOWN else self._doubts + 1
        convinced = self._fitting >= self.settings.convincing
        if self._misfits >= self.settings.patience or (self._doubts >= self.settings.doubts and not convinced):
            self.knowledge = Knowledge.LOST
        elif self._misfits:
            self.knowledge = Knowledge.DOUBTFUL
        elif convinced:
            self.knowledge = Knowledge.KNOWN

    def saw_nothing(self, deviation: float) -> None:
        """Take in that odometry alone has led the robot on.

        Args:
            deviation: standard deviation of the place, m.
        """
        self._fitting = 0
        if self.knowledge is Knowledge.KNOWN and deviation >= self.settings.blind:
            self.knowledge = Knowledge.DOUBTFUL

    def found(self) -> None:
        """The robot has been found on its map."""
        self.knowledge, self._fitting, self._misfits, self._doubts = Knowledge.KNOWN, 0, 0, 0
