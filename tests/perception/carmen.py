"""Laser logs in CARMEN's format, with the poses that a mapper found afterwards."""

from __future__ import annotations

import gzip
import math
from pathlib import Path

import numpy as np

from transport.description import Laser, RobotDescription
from transport.messages import Pose, Scan

LOGS = Path(__file__).parents[2].parent / "shared" / "data" / "laser"
REACH = 50.0


def robot(beams: int) -> RobotDescription:
    """A robot with the scanner of these logs: half a turn, a degree or half a degree from beam to beam."""
    step = math.pi / (180 if beams < 200 else 360)
    laser = Laser(beams=beams, angle_min=-math.pi / 2, angle_max=-math.pi / 2 + step * (beams - 1), range_max=REACH)
    return RobotDescription(laser=laser)


def scans(name: str):
    """The scans of a log, each with the robot's description and the pose found by the mapper."""
    with gzip.open(LOGS / f"{name}-corrected.log.gz", "rt") as lines:
        for line in lines:
            if not line.startswith("FLASER"):
                continue
            words = line.split()
            beams = int(words[1])
            numbers = [float(word) for word in words[2 : beams + 5]]
            described = robot(beams)
            ranges = np.array(numbers[:beams], np.float32)
            yield described, Scan(0, described.laser.geometry(), ranges), Pose(*numbers[beams:])


def deviations(directions) -> list[float]:
    """How far directions of walls, found in many scans, are from their median, modulo a right angle, degrees."""
    right = math.pi / 2
    around = float(np.angle(np.mean(np.exp(4j * np.asarray(directions))))) / 4
    for _ in range(5):
        around += float(np.median([math.remainder(one - around, right) for one in directions]))
    return [abs(math.degrees(math.remainder(one - around, right))) for one in directions]
