"""Random places in mazes of square cells, by seed, with the walls around them."""

from __future__ import annotations

import math

import numpy as np

from tests.perception.scenes import cells
from transport.messages import Pose

SIZE = 6


def place(rng):
    """Walls and a pose: cells of 0.7 to 1.5 m, six in ten of them free, the robot somewhere in one, at any heading."""
    width = rng.uniform(0.7, 1.5)
    free = rng.random((SIZE, SIZE)) < 0.6
    row = column = SIZE // 2
    free[row, column] = True
    rows = ["".join(".#"[not cell] for cell in line) for line in free[::-1]]
    x, y = (row + rng.uniform(0.3, 0.7)) * width, -(column + rng.uniform(0.3, 0.7)) * width
    return np.array(cells(rows, width)), Pose(x, y, rng.uniform(-math.pi, math.pi))
