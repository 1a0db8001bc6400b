"""Laser logs in CARMEN's format, with the poses that a mapper found afterwards."""

from __future__ import annotations

import gzip
import math
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from perception.mapping.frames import between, compose
from transport.description import Laser, RobotDescription
from transport.messages import Pose, Scan

LOGS = Path(__file__).parents[2].parent / "shared" / "data" / "laser"
REACH = 50.0
JUMP = 1.0
"""From one odometry line to the next no robot of these logs drives so far, m, or turns so far, rad."""


class LogError(Exception):
    """A log cannot be read; the message says which and why."""


@dataclass(frozen=True, slots=True)
class Record:
    """A scan of a log.

    Attributes:
        robot: with the scanner that made it.
        scan: the readings.
        corrected: the pose that the mapper found.
        step: the movement since the scan before by raw odometry, in the robot's frame then; None where none is logged.
    """

    robot: RobotDescription
    scan: Scan
    corrected: Pose
    step: Pose | None


def robot(beams: int) -> RobotDescription:
    """A robot with the scanner of these logs: a degree or half a degree from beam to beam, half a turn or more."""
    step = math.pi / (180 if beams < 200 else 360)
    first = -math.pi / 2 if beams <= 361 else -step * (beams - 1) / 2
    laser = Laser(beams=beams, angle_min=first, angle_max=first + step * (beams - 1), range_max=REACH)
    return RobotDescription(laser=laser)


def read_log(file: Path) -> list[Record]:
    """The scans of a log, in order.

    Of odometry only the increments from line to line are read. A line with time 0 is where the odometry begins anew
    after a scan, at a corrected pose: no movement leads there.

    Raises:
        LogError: the file cannot be read, a line is damaged, or there are no scans.
    """
    records: list[Record] = []
    last: Pose | None = None
    step: Pose | None = None
    try:
        with gzip.open(file, "rt") if file.suffix == ".gz" else file.open() as lines:
            for number, line in enumerate(lines, 1):
                words = line.split()
                if not words or words[0] not in {"ODOM", "FLASER"}:
                    continue
                try:
                    if words[0] == "ODOM":
                        pose, begins_anew = Pose(*map(float, words[1:4])), float(words[-1]) == 0
                        if last is not None and not begins_anew:
                            step = _lengthened(step, between(last, pose))
                        last = pose
                    else:
                        beams = int(words[1])
                        numbers = [float(word) for word in words[2 : beams + 5]]
                        ranges, corrected = np.array(numbers[:beams], np.float32), Pose(*numbers[beams : beams + 3])
                        described = robot(beams)
                        records.append(Record(described, Scan(0, described.laser.geometry(), ranges), corrected, step))
                        step = None
                except (ValueError, IndexError, TypeError) as error:
                    raise LogError(f"{file}:{number}: the line is damaged: {error}") from None
    except (OSError, EOFError, zlib.error, UnicodeDecodeError) as error:
        raise LogError(f"{file}: {getattr(error, 'strerror', None) or error}") from None
    if not records:
        raise LogError(f"{file}: there is no FLASER line in it")
    return records


def _lengthened(step: Pose | None, more: Pose) -> Pose | None:
    if math.hypot(more.x, more.y) > JUMP or abs(more.heading) > JUMP:
        return step
    return compose(step or Pose(), more)


def scans(name: str):
    """The scans of a log, each with the robot's description and the pose found by the mapper."""
    for record in read_log(LOGS / f"{name}-corrected.log.gz"):
        yield record.robot, record.scan, record.corrected


def deviations(directions) -> list[float]:
    """How far directions of walls, found in many scans, are from their median, modulo a right angle, degrees."""
    right = math.pi / 2
    around = float(np.angle(np.mean(np.exp(4j * np.asarray(directions))))) / 4
    for _ in range(5):
        around += float(np.median([math.remainder(one - around, right) for one in directions]))
    return [abs(math.degrees(math.remainder(one - around, right))) for one in directions]
