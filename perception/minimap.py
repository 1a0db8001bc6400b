"""The minimap: a small grid around the robot, aligned with the world, of what is free, occupied and unknown (2015)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from perception.settings import MinimapSettings
from perception.sweep import Floats, Indices, Mask, ScanPoints
from transport.arithmetic import atan2, cos_sin, norms


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
        """Where something is, as the map of 2015 had it; unknown cells count as free."""
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
        cosine, sine = cos_sin(direction)
        x = np.rint((along[:, None] * cosine - across * sine) / self.cell).astype(np.intp) + self.centre
        y = np.rint((along[:, None] * sine + across * cosine) / self.cell).astype(np.intp) + self.centre
        last = len(self.cells) - 1
        blocked = (self.cells[np.clip(x, 0, last), np.clip(y, 0, last)] == Cell.OCCUPIED).any(axis=1)
        return float(along[int(blocked.argmax())]) if blocked.any() else reach


@lru_cache(maxsize=8)
def _cells(half: int, cell: float, sensor: tuple[float, float], step: float) -> tuple[Floats, Floats]:
    """Direction of each cell from a sensor, in beams from the map's x axis, and the distance of what is just behind it.

    Both flat.
    """
    places = np.arange(-half, half + 1) * cell
    dx, dy = np.meshgrid(places - sensor[0], places - sensor[1], indexing="ij")
    directions = np.array([atan2(y, x) for x, y in zip(dx.ravel().tolist(), dy.ravel().tolist(), strict=True)])
    return directions / step, norms(dx, dy).ravel() + cell / 2


def minimap_of(sweep: ScanPoints, aligned: Floats, misalignment: float, settings: MinimapSettings) -> Minimap:
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
    free = np.zeros(count * count, np.bool_)
    if len(sweep.ranges):
        mount = sweep.fan.mount
        cosine, sine = cos_sin(misalignment)
        sensor = (mount.x * cosine + mount.y * sine, mount.y * cosine - mount.x * sine)
        directions, distances = _cells(half, settings.cell, sensor, sweep.fan.step)
        free = _shortest_of_three(sweep.ranges)[_beams(sweep, directions, misalignment)] > distances
    cells = free * np.uint8(Cell.FREE)
    places = np.rint(aligned.T / settings.cell)
    near = np.abs(places) <= half
    rows, columns = places.take((near[0] & near[1]).nonzero()[0], axis=1).astype(np.intp) + half
    cells[rows * count + columns] = Cell.OCCUPIED
    return Minimap(cells.reshape(count, count), settings.cell)


def _beams(sweep: ScanPoints, directions: Floats, misalignment: float) -> Indices:
    """The beam nearest to each direction; one more than the last where the sensor looks not.

    Args:
        sweep: the scan.
        directions: from the map's x axis, counted in beams, within half a turn.
        misalignment: of that axis seen from the robot, rad.
    """
    turn = math.tau / sweep.fan.step
    # Beam 0 is what is between 0 and 1 here; the offset makes that no number is below 0 and none at or above two turns.
    offset = (misalignment - float(sweep.fan.angles[0])) / sweep.fan.step + 0.5
    numbers = directions + ((offset - turn / 2) % turn + turn / 2)
    numbers -= (numbers >= turn) * turn
    return np.minimum(numbers.astype(np.intp), len(sweep.ranges))


def _shortest_of_three(ranges: Floats) -> Floats:
    """Each reading or its neighbours', whichever is shortest; NaN where one of them is, and once more at the end."""
    padded = np.concatenate((ranges[:1], ranges, ranges[-1:], (math.nan,)))
    padded[:-3] = np.minimum(np.minimum(padded[:-3], padded[1:-2]), padded[2:-1])
    return np.concatenate((padded[:-3], padded[-1:]))
