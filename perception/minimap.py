"""The minimap: a small grid around the robot, aligned with the world, of what is free, occupied and unknown (2015)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from perception.settings import MinimapSettings
from perception.sweep import Floats, Indices, Mask, Sweep


class Cell(IntEnum):
    """What is known of a cell."""

    UNKNOWN = 0
    FREE = 1
    OCCUPIED = 2


@dataclass(frozen=True, eq=False)
class Minimap:
    """A square grid with the robot in its central cell, rows along x (ahead, along the walls), columns along y (left).

    Attributes:
        cells: values of ``Cell``, uint8, shape (n, n), n odd.
        cell: a cell's width, m.
    """

    cells: NDArray[np.uint8]
    cell: float

    @property
    def binary(self) -> Mask:
        """Where something stands, as the map of 2015 had it; unknown cells count as if nothing stood there."""
        occupied: Mask = self.cells == Cell.OCCUPIED
        return occupied

    @property
    def free(self) -> Mask:
        """What is seen to be free."""
        free: Mask = self.cells == Cell.FREE
        return free

    @property
    def known_share(self) -> float:
        """Share of the cells that are not unknown, 0 to 1."""
        return float(np.count_nonzero(self.cells)) / self.cells.size

    @property
    def centre(self) -> int:
        """Row and column of the robot's cell."""
        return len(self.cells) // 2

    def at(self, x: float, y: float) -> Cell:
        """The cell at a place in the robot's position turned along the walls, m; unknown outside the map."""
        row, column = self.centre + round(x / self.cell), self.centre + round(y / self.cell)
        inside = 0 <= row < len(self.cells) and 0 <= column < len(self.cells)
        return Cell(int(self.cells[row, column])) if inside else Cell.UNKNOWN

    def depth(self, direction: float, half_width: float) -> float:
        """How far a lane from the robot is seen to be free, m, at most to the map's border.

        Args:
            direction: rad, counter-clockwise from the map's x axis.
            half_width: m.
        """
        reach = self.centre * self.cell
        along = np.arange(0.0, reach, self.cell / 2)
        across = np.arange(-half_width, half_width + 1e-9, self.cell / 2)
        cosine, sine = math.cos(direction), math.sin(direction)
        x = np.rint((along[:, None] * cosine - across * sine) / self.cell).astype(np.intp) + self.centre
        y = np.rint((along[:, None] * sine + across * cosine) / self.cell).astype(np.intp) + self.centre
        last = len(self.cells) - 1
        blocked = (self.cells[np.clip(x, 0, last), np.clip(y, 0, last)] == Cell.OCCUPIED).any(axis=1)
        return float(along[int(blocked.argmax())]) if blocked.any() else reach


@lru_cache(maxsize=8)
def _cells(half: int, cell: float, x: float, y: float) -> tuple[Floats, Floats]:
    """Direction of each cell from a sensor at (x, y), and the distance of what is just behind it, flat."""
    places = np.arange(-half, half + 1) * cell
    dx, dy = np.meshgrid(places - x, places - y, indexing="ij")
    return np.arctan2(dy, dx).ravel(), np.hypot(dx, dy).ravel() + cell / 2


def minimap_of(sweep: Sweep, aligned: Floats, misalignment: float, settings: MinimapSettings) -> Minimap:
    """The minimap of a scan.

    A cell with a hit is occupied. A cell is free if the line from the sensor to it is: the beams towards it end behind
    it. All other cells are unknown, among them those behind a wall and those that no beam looks at. (In 2015 a search
    went along each beam from the middle; asking each cell for its beam gives the same map and visits no cell twice.)

    Args:
        sweep: the scan.
        aligned: its hits in the robot's place but turned along the walls, m, shape (n, 2).
        misalignment: direction of the walls seen from the robot, rad.
        settings: size and cell.
    """
    half = round(settings.half_size / settings.cell)
    count = 2 * half + 1
    cells = np.zeros(count * count, np.uint8)
    if len(sweep.ranges):
        mount = sweep.fan.mount
        cosine, sine = math.cos(misalignment), math.sin(misalignment)
        x, y = mount.x * cosine + mount.y * sine, mount.y * cosine - mount.x * sine
        directions, distances = _cells(half, settings.cell, x, y)
        free = _shortest_of_three(sweep.ranges)[_beams(sweep, directions, misalignment)] > distances
        cells[free] = Cell.FREE
    rows, columns = (np.rint(aligned.T / settings.cell) + half).astype(np.intp)
    inside = (rows >= 0) & (rows < count) & (columns >= 0) & (columns < count)
    cells[rows[inside] * count + columns[inside]] = Cell.OCCUPIED
    return Minimap(cells.reshape(count, count), settings.cell)


def _beams(sweep: Sweep, directions: Floats, misalignment: float) -> Indices:
    """The beam nearest to each direction, given from the walls; one more than the last where the sensor looks not."""
    turn = math.tau / sweep.fan.step
    numbers = (directions + (misalignment - float(sweep.fan.angles[0]))) / sweep.fan.step
    numbers -= turn * np.floor((numbers + 0.5) / turn)
    return np.minimum(np.rint(numbers), len(sweep.ranges)).astype(np.intp)


def _shortest_of_three(ranges: Floats) -> Floats:
    """Each reading or its neighbours', whichever is shortest; NaN where one of them is, and once more at the end."""
    padded = np.concatenate((ranges[:1], ranges, ranges[-1:], (math.nan,)))
    padded[:-3] = np.minimum(np.minimum(padded[:-3], padded[1:-2]), padded[2:-1])
    return np.concatenate((padded[:-3], padded[-1:]))
