"""How well the robot knows where it is and what it has seen.

    python benchmarks/world.py logs [--json] FILE...      laser logs in CARMEN's format, plain or compressed by gzip

`logs` reads the increments of raw odometry and the scans, nothing else, with one set of thresholds, and compares the
trajectory with the corrected poses that the log holds. Those come from a mapper, too: they are a reference, not the
truth. A line has the fields

    log             the file's name
    raw             absolute trajectory error of raw odometry, m
    ate             that of the map's poses at the end, m
    without_loops   that of scan matching alone, m
    largest         the map's largest deviation, m

The absolute trajectory error is the root mean square distance of the positions after the rigid motion that makes it
smallest (Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", 2012).
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from itertools import accumulate
from pathlib import Path

import numpy as np

# Before the folder of the benchmarks, where a script bears the name of a package.
sys.path.insert(0, str(Path(__file__).parents[1]))

from perception.mapping import Mapper, MappingSettings, cloud_of
from perception.mapping.frames import compose
from perception.sweep import Sweep
from tests.perception import carmen
from transport.messages import Pose


@dataclass(frozen=True, slots=True)
class LogResult:
    """What became of a log; lengths in m, the fields as the module describes them."""

    log: str
    raw: float
    ate: float
    without_loops: float
    largest: float


def map_of(records: Sequence[carmen.Record], settings: MappingSettings) -> tuple[list[Pose], list[Pose]]:
    """The pose at each scan, with loops closed and by scan matching alone."""
    mapper = Mapper(settings)
    places: list[tuple[int, Pose]] = []
    for number, record in enumerate(records):
        if number:
            mapper.move(record.step)
        sweep = Sweep.of(record.scan, record.robot.laser.mount)
        mapper.see(cloud_of(sweep, settings.cloud), measured=not number or record.step is not None)
        mapper.work(sys.maxsize)
        places.append((len(mapper.clouds) - 1, mapper.offset))
    mapper.finish()
    chain = list(accumulate((link.measured for link in mapper.graph.steps), compose, initial=Pose()))
    closed = [compose(mapper.graph.poses[keyframe], offset) for keyframe, offset in places]
    return closed, [compose(chain[keyframe], offset) for keyframe, offset in places]


def errors(poses: Sequence[Pose], reference: Sequence[Pose]) -> tuple[float, float]:
    """Absolute trajectory error and largest deviation after the best rigid motion, m."""
    here, there = (np.array([(pose.x, pose.y) for pose in one]).T for one in (poses, reference))
    here, there = here - here.mean(axis=1)[:, None], there - there.mean(axis=1)[:, None]
    turn = math.atan2(
        float(np.sum(here[0] * there[1] - here[1] * there[0])), float(np.sum(here[0] * there[0] + here[1] * there[1]))
    )
    cosine, sine = math.cos(turn), math.sin(turn)
    apart = np.hypot(here[0] * cosine - here[1] * sine - there[0], here[0] * sine + here[1] * cosine - there[1])
    return math.sqrt(float(np.mean(apart * apart))), float(apart.max())


def log_result(file: Path, settings: MappingSettings) -> LogResult:
    """Map a log and compare.

    Raises:
        carmen.LogError: the file cannot be read or holds no scans.
    """
    records = carmen.read_log(file)
    reference = [record.corrected for record in records]
    raw = list(accumulate((record.step or Pose() for record in records[1:]), compose, initial=Pose()))
    closed, chain = map_of(records, settings)
    ate, largest = errors(closed, reference)
    return LogResult(file.name, errors(raw, reference)[0], ate, errors(chain, reference)[0], largest)


def logs(files: Iterable[Path], *, as_json: bool) -> None:
    """Print a line for each log."""
    if not as_json:
        print(f"{'log':32} {'raw':>8} {'ate':>8} {'without_loops':>14} {'largest':>8}   m")
    for file in files:
        result = log_result(file, MappingSettings())
        if as_json:
            fields = asdict(result)
            name = fields.pop("log")
            print(json.dumps({"log": name, **{key: round(value, 4) for key, value in fields.items()}}), flush=True)
        else:
            numbers = f"{result.raw:8.3f} {result.ate:8.3f} {result.without_loops:14.3f} {result.largest:8.3f}"
            print(f"{result.log:32} {numbers}", flush=True)


def main() -> int:
    """Do what is asked for; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    what = parser.add_subparsers(dest="what", required=True)
    of_logs = what.add_parser("logs", help="absolute trajectory error on laser logs")
    of_logs.add_argument("files", nargs="+", type=Path, metavar="FILE")
    of_logs.add_argument("--json", action="store_true", dest="as_json", help="a line of JSON each")
    arguments = parser.parse_args()
    try:
        logs(arguments.files, as_json=arguments.as_json)
    except carmen.LogError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
