"""A toy in place of a robot: a corridor with the dock at its beginning, a carpet in it and a wall after 3 m."""

import math

from vacuum_robot import Facts, Floor, Wanted


class Toy:
    """Moves on request, ten times a second."""

    def __init__(self) -> None:
        self.charge, self.place, self.heading = 0.23, 1.0, 0.0

    def sense(self) -> Facts:
        """The sensor data."""
        floor = Floor.CARPET if 1.5 < self.place < 2.5 else Floor.HARD
        return Facts(self.charge, bumped=self.place >= 3 and math.cos(self.heading) > 0, floor=floor, dock=self.place)

    def move(self, wanted: list[Wanted]) -> None:
        """Execute the requests of the activities for a tenth of a second; the battery charges at the dock."""
        for one in wanted:
            self.heading += one.turn / 10
            self.place += (-1 if one.homing else math.cos(self.heading)) * one.forward / 10
            self.charge -= one.brush * 0.0004
        self.charge += 0.02 if not wanted and self.place < 0.05 else 0.0
