"""Where a robot can drive, as far as it has seen: a grid of free, occupied and unknown cells."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from perception.mapping.frames import compose, placed
from perception.mapping.settings import FreeSpaceSettings
from perception.sweep import Floats, Mask, ScanPoints
from transport.arithmetic import cosines_and_sines, directions, norms
from transport.description import Point
from transport.messages import Pose

Cells = NDArray[np.intp]
Cell = tuple[int, int]

GROWTH = 40
"""The grid grows by at least this many cells at a time."""


@dataclass(slots=True)
class FreeSpace:
    """A grid that grows with what is seen.

    A scan counts for a cell through whose middle a beam went, and against one that a beam ended in; newer scans count
    more, so that a door that opens becomes free.

    Attributes:
        settings: how fine, how fast to learn.
        corner: column and row of the grid's first cell, counted from the cell whose corner is the frame's origin.
        belief: above zero where free, below where taken, zero where nothing is known, shape (columns, rows).
        changes: how often it has been changed.
    """

    settings: FreeSpaceSettings
    corner: Cell = (0, 0)
    belief: NDArray[np.int8] = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int8))
    changes: int = 0

    @property
    def free(self) -> Mask:
        """Cells that are free."""
        mask: Mask = self.belief > 0
        return mask

    @property
    def taken(self) -> Mask:
        """Cells in which there is a wall."""
        mask: Mask = self.belief < 0
        return mask

    def cell_of(self, point: Point) -> Cell:
        """Column and row of the cell that a point is in; may be outside the grid."""
        size = self.settings.cell
        return math.floor(point[0] / size) - self.corner[0], math.floor(point[1] / size) - self.corner[1]

    def middle(self, cell: Cell) -> Point:
        """The middle of a cell, m."""
        size = self.settings.cell
        return (cell[0] + self.corner[0] + 0.5) * size, (cell[1] + self.corner[1] + 0.5) * size

    def holds(self, cell: Cell) -> bool:
        """Whether a cell is in the grid."""
        columns, rows = self.belief.shape
        return bool(0 <= cell[0] < columns and 0 <= cell[1] < rows)

    def see(self, sweep: ScanPoints, pose: Pose) -> None:
        """Take in a scan.

        Args:
            sweep: the scan.
            pose: of the robot.
        """
        if not len(sweep.ranges):
            return
        sensor = compose(pose, sweep.fan.mount)
        reach = min(sweep.reach, self.settings.reach)
        self._grow(sensor, reach)
        hits = self._hits(sweep, pose, reach)
        seen = self._seen(sweep, sensor, reach)
        settings = self.settings
        belief = self.belief.astype(np.int16)
        belief[seen] += settings.gain
        belief[hits] -= settings.gain * seen[hits] + settings.loss
        # The place of the robot is free, also behind it, where it may see nothing.
        own = self._disc(pose, settings.body)
        belief[own] = np.where(belief[own] == 0, settings.gain, belief[own])
        np.clip(belief, -settings.most, settings.most, out=belief)
        # A cell that was free or occupied does not become unknown again.
        belief[(belief == 0) & (self.belief != 0)] = -1
        self.belief = belief.astype(np.int8)
        self.changes += 1

    def _hits(self, sweep: ScanPoints, pose: Pose, reach: float) -> tuple[Cells, Cells]:
        near = sweep.distances < reach
        points = placed(sweep.points.T[:, near], pose)
        cells = np.floor(points / self.settings.cell).astype(np.intp)
        taken = np.zeros_like(self.belief, dtype=bool)
        taken[cells[0] - self.corner[0], cells[1] - self.corner[1]] = True
        columns, rows = taken.nonzero()
        return columns, rows

    def _seen(self, sweep: ScanPoints, sensor: Pose, reach: float) -> Mask:
        """Cells through whose middles beams went, some way before what they hit."""
        settings, fan = self.settings, sweep.fan
        free = np.minimum(sweep.free - settings.before, reach)
        low, high = self._box(sweep, sensor, free)
        x = (np.arange(low[0], high[0] + 1) + (self.corner[0] + 0.5)) * settings.cell - sensor.x
        y = (np.arange(low[1], high[1] + 1) + (self.corner[1] + 0.5)) * settings.cell - sensor.y
        across, along = x[:, None].astype(np.float64), y[None, :].astype(np.float64)
        away = norms(across, along)
        heading = sensor.heading - fan.mount.heading
        first = float(fan.angles[0])
        towards = directions(across, along)
        bearing = (towards - heading - first) % math.tau
        beam = np.rint(bearing / fan.step).astype(np.intp)
        inside = beam < len(sweep.ranges)
        clear = inside & (away < free[np.where(inside, beam, 0)])
        seen = np.zeros_like(self.belief, dtype=bool)
        seen[low[0] : high[0] + 1, low[1] : high[1] + 1] = clear
        return seen

    def _box(self, sweep: ScanPoints, sensor: Pose, free: Floats) -> tuple[Cell, Cell]:
        """The lowest and the highest column and row of the cells that beams may have gone through.

        Args:
            sweep: the scan.
            sensor: where the beams begin.
            free: how far each went through free space, m.
        """
        lengths = np.maximum(free, 0.0)
        cosines, sines = cosines_and_sines(sweep.fan.angles + (sensor.heading - sweep.fan.mount.heading))
        # The nearest beam to a cell passes it at a distance of up to half the angle between two beams.
        margin = float(np.max(lengths)) * sweep.fan.step + self.settings.cell
        x, y = sensor.x + lengths * cosines, sensor.y + lengths * sines
        left, right = min(float(np.min(x)), sensor.x) - margin, max(float(np.max(x)), sensor.x) + margin
        below, above = min(float(np.min(y)), sensor.y) - margin, max(float(np.max(y)), sensor.y) + margin
        low, high = self.cell_of((left, below)), self.cell_of((right, above))
        columns, rows = self.belief.shape
        return (max(low[0], 0), max(low[1], 0)), (min(high[0], columns - 1), min(high[1], rows - 1))

    def _disc(self, pose: Pose, radius: float) -> tuple[Cells, Cells]:
        """The cells of the grid whose middles are within a radius of the robot."""
        away, size = math.ceil(radius / self.settings.cell), self.settings.cell
        column, row = self.cell_of((pose.x, pose.y))
        low = max(column - away, 0), max(row - away, 0)
        high = min(column + away + 1, self.belief.shape[0]), min(row + away + 1, self.belief.shape[1])
        x = (np.arange(low[0], high[0]) + (self.corner[0] + 0.5)) * size - pose.x
        y = (np.arange(low[1], high[1]) + (self.corner[1] + 0.5)) * size - pose.y
        columns, rows = (norms(x[:, None], y[None, :]) <= radius).nonzero()
        return columns + low[0], rows + low[1]

    def _grow(self, sensor: Pose, reach: float) -> None:
        """Make the grid hold all that the scan may show."""
        reach += 2 * self.settings.cell
        low, high = (
            self.cell_of((sensor.x - reach, sensor.y - reach)),
            self.cell_of((sensor.x + reach, sensor.y + reach)),
        )
        columns, rows = self.belief.shape
        if not self.belief.size:
            self.corner = (low[0] + self.corner[0], low[1] + self.corner[1])
            self.belief = np.zeros((high[0] - low[0] + 1, high[1] - low[1] + 1), dtype=np.int8)
            return
        left, below = (max(GROWTH, -one) if one < 0 else 0 for one in low)
        right = max(GROWTH, high[0] - columns + 1) if high[0] >= columns else 0
        above = max(GROWTH, high[1] - rows + 1) if high[1] >= rows else 0
        if left or right or below or above:
            self.belief = np.pad(self.belief, ((left, right), (below, above)))
            self.corner = (self.corner[0] - left, self.corner[1] - below)
