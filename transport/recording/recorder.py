"""Writes recordings of runs as MCAP files with ROS 2 messages, which common tools can open.

One file holds one robot's run: laser, odometry, velocity commands, clock and transforms as messages of their own types,
and one JSON text a tick (``std_msgs/String`` on ``NAME/tick``) with what those cannot carry, so that a replay gives the
same observations bit for bit. For viewers there are the map, the outline, the path, some points of each scan and the
state of each region besides. The key-by-key list is in ``docs/reference/link.md``.
"""

from __future__ import annotations

import json
import queue
import re
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from threading import Thread
from types import TracebackType
from typing import IO, Any, NamedTuple

import numpy as np
from mcap.writer import CompressionType, Writer
from numpy.typing import NDArray

from transport import codec
from transport.arithmetic import cos, cosines_and_sines, sin
from transport.files import Stream
from transport.messages import NANOSECONDS, Command, Observation, Odometry, Pose, Scan, ScanGeometry
from transport.recording import drawings
from transport.recording.frames import inverse, placed
from transport.recording.messages import ENDING, RUN
from transport.recording.values import RecordingError

LIBRARY = "maze-machine"
CHUNK_SIZE = 256 * 1024
"""A crash costs at most this many bytes of messages, before compression: some seconds of a run."""
BACKLOG = 2000
"""How many ticks may wait for the disk."""
_FLUSH = 1.0
POINTS_STRIDE = 4
"""Every this many beams of a scan are written as points too."""
PATH_EVERY = NANOSECONDS
"""The path so far is written this often, ns, with one place for each time before."""
PATH_LONGEST = 600
"""It has no more places than this, the newest ones."""


@dataclass(frozen=True, slots=True, eq=False)
class RecordedScene:
    """The constant part of a recording, for viewers: the robot and its surroundings.

    Attributes:
        footprint: the robot's outline in its own frame, m.
        mount: where the laser sits on it.
        grid: the map; None where there is none.
        epoch: all stamps are later by this than the robot's own, ns: with the time of day at which a run began, its
            recording is dated.
    """

    footprint: Sequence[tuple[float, float]] = ()
    mount: Pose = Pose()  # noqa: RUF009 - frozen
    grid: drawings.Grid | None = None
    epoch: int = 0


class Recorder:
    """Writes a run to a file from a thread of its own.

    Use it as a context manager: leaving the block finishes the file, also after an exception.

    Attributes:
        lost: how many ticks were not written because the disk was too slow, or failed.
    """

    def __init__(
        self,
        path: Path,
        robot: str,
        run: Mapping[str, str] | None = None,
        *,
        setting: RecordedScene | None = None,
        patience: float = 0.0,
    ) -> None:
        """Begin a file.

        Args:
            path: the file; one that is there is replaced when this one is complete.
            robot: the robot's name.
            run: what to write about the run: machine, seed and the like.
            setting: what the robot is like and where it is, for viewers.
            patience: how long a tick may wait for a disk that does not keep up, s; nothing in real time.

        Raises:
            RecordingError: the file cannot be written.
        """
        self.lost = 0
        self._patience = patience
        self._failure: BaseException | None = None
        self._ending: dict[str, str] = {}
        self._ticks: queue.Queue[_Handed | None] = queue.Queue(BACKLOG)
        try:
            self._stream = Stream(path)
        except OSError as error:
            raise RecordingError(f"cannot write the recording {path}: {error.strerror}") from None
        said = {"robot": robot, **(run or {})}
        self._thread = Thread(target=self._work, args=(said, setting or RecordedScene()), name="recorder", daemon=True)
        self._thread.start()

    def record(
        self,
        observation: Observation,
        command: Command,
        step: Callable[[], Mapping[str, Any]] | None = None,
        *,
        pose: Pose | None = None,
    ) -> None:
        """Queue one tick for writing; this never waits for the disk longer than the timeout.

        Args:
            observation: what the robot sensed.
            command: what it was commanded.
            step: says what the supervisor did and why, of JSON values; called in the recorder's thread. What it says of
                ``regions``, the machine's active state in each of its regions, is written for viewers, too.
            pose: where the robot really was in the frame of the map, if anybody knows.
        """
        tick = _Handed(observation, command, step or dict, pose)
        try:
            self._ticks.put(tick, block=self._patience > 0, timeout=self._patience or None)
        except queue.Full:
            self.lost += 1

    def conclude(self, ending: Mapping[str, str]) -> None:
        """Set how the run ended; it is written when the file is finished."""
        self._ending = dict(ending)

    def close(self) -> None:
        """Write what is left and finish the file; a second call does nothing.

        Raises:
            RecordingError: the disk failed.
        """
        if self._thread.is_alive():
            self._ticks.put(None)
            self._thread.join()
        if self._failure is not None:
            failure, self._failure = self._failure, None
            cause = self._stream.cause(failure) if isinstance(failure, OSError) else str(failure)
            raise RecordingError(f"the recording {self._stream.path} is not complete: {cause}") from failure

    def __enter__(self) -> Recorder:
        """The recorder itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        """Finish the file."""
        self.close()

    def _work(self, run: dict[str, str], setting: RecordedScene) -> None:
        ended = False
        try:
            writer = _TickWriter(self._stream.file, run, setting)
            flushed = time.monotonic()
            while (tick := self._ticks.get()) is not None:
                writer.write(tick)
                if time.monotonic() - flushed > _FLUSH:
                    self._stream.file.flush()
                    flushed = time.monotonic()
            ended = True
            writer.finish(self._ending)
            self._stream.close()
        except BaseException as error:
            self._failure = error
            self._stream.abandon()
            # The recording thread must not be held up by a full queue that nobody reads.
            while not ended and self._ticks.get() is not None:
                self.lost += 1


class _Handed(NamedTuple):
    """A queued tick; the supervisor's step is encoded when it is written."""

    observation: Observation
    command: Command
    step: Callable[[], Mapping[str, Any]]
    pose: Pose | None


class _TickWriter:
    """The MCAP writer with its channels."""

    def __init__(self, file: IO[bytes], run: dict[str, str], setting: RecordedScene) -> None:
        self._writer = Writer(file, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library=LIBRARY)
        self._writer.add_metadata(RUN, run)
        self._robot, self._setting = run["robot"], setting
        self._sequence: Counter[str] = Counter()
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._scan: Scan | None = None
        self._odometry: Odometry | None = None
        self._regions: dict[str, str] = {}
        self._path: list[Pose] = []
        self._path_at = -PATH_EVERY
        self._begun = False

    def write(self, tick: _Handed) -> None:
        """One tick: its messages, sensors first."""
        observation, command, name = tick.observation, tick.command, self._robot
        at = observation.stamp
        if not self._begun:
            self._begun = True
            self._begin(at, tick.pose)
        self._add("/clock", codec.CLOCK, at, codec.encode_clock(at + self._setting.epoch))
        # In real time a tick may see the data of the last one again: those are in the file already. Their stamps do not
        # show, for a robot's clock may stand still.
        if observation.odometry is not self._odometry:
            odometry = replace(observation.odometry, stamp=observation.odometry.stamp + self._setting.epoch)
            self._odometry = observation.odometry
            self._add(f"/{name}/odom", codec.ODOMETRY, at, codec.encode_odometry(odometry))
            place = odometry.x, odometry.y, odometry.qz, odometry.qw
            moved = [codec.Transform(odometry.stamp, codec.ODOMETRY_FRAME, codec.BASE_FRAME, *place)]
            if tick.pose is not None:
                drift = placed(inverse(odometry.pose), tick.pose)
                moved.append(_transform(odometry.stamp, drawings.MAP_FRAME, codec.ODOMETRY_FRAME, drift))
            self._add("/tf", codec.TRANSFORMS, at, codec.encode_transforms(*moved))
        if observation.scan is not self._scan:
            scan = replace(observation.scan, stamp=observation.scan.stamp + self._setting.epoch)
            self._scan = observation.scan
            self._add(f"/{name}/scan", codec.LASER_SCAN, at, codec.encode_scan(scan))
            self._add(f"/{name}/points", drawings.POINTS, at, drawings.encode_points(_points(scan), scan.stamp))
        self._add(f"/{name}/cmd_vel", codec.TWIST, at, codec.encode_twist(command.twist))
        step = tick.step()
        self._show(tick, step.get("regions", {}))
        door = None if observation.door is None else asdict(observation.door)
        told = {
            "stamp": at,
            "door": door,
            "link": asdict(observation.link),
            "ring": command.ring,
            "answers": command.answers,
            "step": step,
        }
        # Only where there is one: few robots have a navigation of their own.
        told |= {
            key: asdict(one)
            for key, one in (("goal", command.goal), ("navigation", observation.navigation))
            if one is not None
        }
        self._add(f"/{name}/tick", codec.STRING, at, codec.encode_text(json.dumps(told, separators=(",", ":"))))

    def finish(self, ending: dict[str, str]) -> None:
        """How the run ended, the last chunk and the index."""
        if ending:
            self._writer.add_metadata(ENDING, ending)
        self._writer.finish()  # type: ignore[no-untyped-call]

    def _begin(self, at: int, pose: Pose | None) -> None:
        """What is said once."""
        setting, stamp = self._setting, at + self._setting.epoch
        fixed = [_transform(stamp, codec.BASE_FRAME, codec.LASER_FRAME, setting.mount)]
        if pose is None:
            # Without better knowledge, the map is drawn in the odometry frame.
            fixed.append(_transform(stamp, drawings.MAP_FRAME, codec.ODOMETRY_FRAME, Pose()))
        self._add("/tf_static", codec.TRANSFORMS, at, codec.encode_transforms(*fixed))
        if setting.footprint:
            self._add(
                f"/{self._robot}/footprint", drawings.OUTLINE, at, drawings.encode_outline(setting.footprint, stamp)
            )
        if setting.grid is not None:
            self._add("/map", drawings.GRID, at, drawings.encode_grid(setting.grid, stamp))

    def _show(self, tick: _Handed, regions: Mapping[str, str]) -> None:
        """Messages for viewers only: the states that changed, and occasionally the path."""
        at = tick.observation.stamp
        for region, state in regions.items():
            if self._regions.get(region) != state:
                self._regions[region] = state
                topic = f"/{self._robot}/state/{re.sub(r'[^A-Za-z0-9_]', '_', region)}"
                self._add(topic, codec.STRING, at, codec.encode_text(state))
        if at - self._path_at >= PATH_EVERY:
            self._path_at = at
            self._path = [*self._path, tick.pose or tick.observation.odometry.pose][-PATH_LONGEST:]
            path = drawings.encode_path(self._path, drawings.MAP_FRAME, at + self._setting.epoch)
            self._add(f"/{self._robot}/path", drawings.PATH, at, path)

    def _channel(self, topic: str, kind: str) -> int:
        if topic not in self._channels:
            if kind not in self._schemas:
                definition, _ = codec.TYPES.generate_msgdef(kind, ros_version=2)
                self._schemas[kind] = self._writer.register_schema(kind, "ros2msg", definition.encode())
            self._channels[topic] = self._writer.register_channel(topic, "cdr", self._schemas[kind])
        return self._channels[topic]

    def _add(self, topic: str, kind: str, at: int, payload: bytes) -> None:
        self._sequence[topic] += 1
        stamp = at + self._setting.epoch
        self._writer.add_message(self._channel(topic, kind), stamp, payload, stamp, self._sequence[topic])


def _transform(stamp: int, parent: str, child: str, pose: Pose) -> codec.Transform:
    half = pose.heading / 2
    return codec.Transform(stamp, parent, child, pose.x, pose.y, sin(half), cos(half))


def _points(scan: Scan) -> NDArray[np.float32]:
    """Some of a scan's hits in the laser's frame, shape (n, 3)."""
    ranges = scan.ranges[::POINTS_STRIDE].astype(np.float64)
    hit = np.isfinite(ranges)
    x, y = (ranges[hit] * one[hit] for one in _directions(scan.geometry))
    return np.stack([x, y, np.zeros_like(x)], axis=1).astype(np.float32)


@lru_cache(maxsize=4)
def _directions(beams: ScanGeometry) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cosines and sines of the directions of the beams that are written as points."""
    return cosines_and_sines(beams.angles()[::POINTS_STRIDE])
