"""Recordings of runs as MCAP files with ROS 2 messages, which the tools that people own can open.

One file holds one robot's run: laser, odometry, velocity commands, clock and transforms as messages of their own types,
and one JSON text a tick (``std_msgs/String`` on ``NAME/tick``) with what those cannot carry, so that a replay hands out
the same observations bit for bit. The key-by-key list is in ``docs/reference/link.md``.
"""

from __future__ import annotations

import json
import queue
import struct
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from threading import Thread
from types import TracebackType
from typing import IO, Any

import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel, Metadata
from mcap.records import Message as Record
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from transport import codec
from transport.files import Stream
from transport.messages import STOP, Command, DoorReply, LinkStatus, Observation, Odometry, Scan
from transport.robot import LinkError

LIBRARY = "maze-machine"
RUN = "run"
"""Name of the metadata record that describes the run."""
CHUNK_SIZE = 256 * 1024
"""A crash costs at most so many bytes of messages, before compression: some seconds of a run."""
BACKLOG = 2000
"""How many ticks may wait for the disk."""
_FLUSH = 1.0
# What the reader stumbles over at a cut depends on the record that was cut.
_CUT_OFF = (McapError, struct.error, zstandard.ZstdError, ValueError, EOFError)


class RecordingError(Exception):
    """A file that is no recording of this program, or that cannot be written."""


@dataclass(frozen=True, slots=True)
class RecordedTick:
    """One tick of a run.

    Attributes:
        observation: what the robot sensed.
        command: what it was told.
        step: what the supervisor did, of JSON values.
    """

    observation: Observation
    command: Command
    step: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Recording:
    """A recorded run.

    Attributes:
        robot: the robot's name.
        run: what was written about the run: machine, seed and the like.
        ticks: the ticks in order.
        complete: whether the file was closed properly; one that a crash cut off ends with its last whole chunk.
    """

    robot: str
    run: Mapping[str, str]
    ticks: Sequence[RecordedTick]
    complete: bool


class Recorder:
    """Writes a run to a file from a thread of its own.

    Use it as a context manager: leaving the block finishes the file, also after an exception.

    Attributes:
        lost: how many ticks were not written because the disk was too slow, or failed.
    """

    def __init__(self, path: Path, robot: str, run: Mapping[str, str] | None = None, *, patience: float = 0.0) -> None:
        """Begin a file.

        Args:
            path: the file; one that is there is replaced when this one is complete.
            robot: the robot's name.
            run: what to write about the run: machine, seed and the like.
            patience: how long a tick may wait for a disk that does not keep up, s; nothing in real time.

        Raises:
            RecordingError: the file cannot be written.
        """
        self.lost = 0
        self._patience = patience
        self._failure: BaseException | None = None
        self._ticks: queue.Queue[RecordedTick | None] = queue.Queue(BACKLOG)
        try:
            self._stream = Stream(path)
        except OSError as error:
            raise RecordingError(f"cannot write the recording {path}: {error.strerror}") from None
        self._thread = Thread(target=self._work, args=({"robot": robot, **(run or {})},), name="recorder", daemon=True)
        self._thread.start()

    def record(self, observation: Observation, command: Command, step: Mapping[str, Any] | None = None) -> None:
        """Hand over one tick; it is written later, and nothing here waits for the disk longer than its patience.

        Args:
            observation: what the robot sensed.
            command: what it was told.
            step: what the supervisor did and why, of JSON values.
        """
        tick = RecordedTick(observation, command, step or {})
        try:
            self._ticks.put(tick, block=self._patience > 0, timeout=self._patience or None)
        except queue.Full:
            self.lost += 1

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

    def _work(self, run: dict[str, str]) -> None:
        ended = False
        try:
            writer = _TickWriter(self._stream.file, run)
            flushed = time.monotonic()
            while (tick := self._ticks.get()) is not None:
                writer.write(tick)
                if time.monotonic() - flushed > _FLUSH:
                    self._stream.file.flush()
                    flushed = time.monotonic()
            ended = True
            writer.finish()
            self._stream.close()
        except BaseException as error:
            self._failure = error
            self._stream.abandon()
            # Whoever records must not be held up by a full queue that nobody reads.
            while not ended and self._ticks.get() is not None:
                self.lost += 1


class _TickWriter:
    """The MCAP writer with its channels."""

    def __init__(self, file: IO[bytes], run: dict[str, str]) -> None:
        self._writer = Writer(file, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library=LIBRARY)
        self._writer.add_metadata(RUN, run)
        self._robot = run["robot"]
        self._sequence: Counter[str] = Counter()
        self._schemas: dict[str, int] = {}
        self._channels = {
            topic: self._channel(topic, kind)
            for topic, kind in {
                f"/{self._robot}/scan": codec.LASER_SCAN,
                f"/{self._robot}/odom": codec.ODOMETRY,
                f"/{self._robot}/cmd_vel": codec.TWIST,
                f"/{self._robot}/tick": codec.STRING,
                "/clock": codec.CLOCK,
                "/tf": codec.TRANSFORMS,
            }.items()
        }
        self._scan = self._odometry = -1

    def write(self, tick: RecordedTick) -> None:
        """One tick: its messages, sensors first."""
        observation, command, name = tick.observation, tick.command, self._robot
        at = observation.stamp
        self._add("/clock", at, codec.encode_clock(at))
        # In real time a tick may see the data of the last one again: those are in the file already.
        if observation.odometry.stamp != self._odometry:
            odometry = observation.odometry
            self._odometry = odometry.stamp
            self._add(f"/{name}/odom", at, codec.encode_odometry(odometry))
            self._add("/tf", at, codec.encode_transforms(self._transform(odometry)))
        if observation.scan.stamp != self._scan:
            self._scan = observation.scan.stamp
            self._add(f"/{name}/scan", at, codec.encode_scan(observation.scan))
        self._add(f"/{name}/cmd_vel", at, codec.encode_twist(command.twist))
        door = None if observation.door is None else asdict(observation.door)
        told = {
            "stamp": at,
            "door": door,
            "link": asdict(observation.link),
            "ring": command.ring,
            "answers": command.answers,
            "step": tick.step,
        }
        self._add(f"/{name}/tick", at, codec.encode_text(json.dumps(told, separators=(",", ":"))))

    def finish(self) -> None:
        """The last chunk and the index."""
        self._writer.finish()  # type: ignore[no-untyped-call]

    def _transform(self, odometry: Odometry) -> codec.Transform:
        place = odometry.x, odometry.y, odometry.qz, odometry.qw
        return codec.Transform(odometry.stamp, codec.ODOMETRY_FRAME, codec.BASE_FRAME, *place)

    def _channel(self, topic: str, kind: str) -> int:
        if kind not in self._schemas:
            definition, _ = codec.TYPES.generate_msgdef(kind, ros_version=2)
            self._schemas[kind] = self._writer.register_schema(kind, "ros2msg", definition.encode())
        return self._writer.register_channel(topic, "cdr", self._schemas[kind])

    def _add(self, topic: str, stamp: int, payload: bytes) -> None:
        self._sequence[topic] += 1
        self._writer.add_message(self._channels[topic], stamp, payload, stamp, self._sequence[topic])


def read_recording(path: Path) -> Recording:
    """Read a recorded run.

    Raises:
        RecordingError: the file cannot be read, is no recording of this program, or holds no tick.
    """
    try:
        with path.open("rb") as file:
            reader = _TickReader(file)
            ticks = tuple(reader.ticks())
    except OSError as error:
        raise RecordingError(f"cannot read the recording {path}: {error.strerror}") from None
    except (RecordingError, KeyError, TypeError, ValueError) as error:
        raise RecordingError(f"{path} is no recording of a run: {error}") from None
    if not reader.run:
        raise RecordingError(f"{path} is no recording of a run: nothing in it says which")
    if not ticks:
        cut = "" if reader.complete else ": it was cut off before the first chunk was written"
        raise RecordingError(f"{path} holds no tick{cut}")
    return Recording(reader.run["robot"], reader.run, ticks, reader.complete)


class _TickReader:
    """Puts ticks together from the messages of a file."""

    def __init__(self, file: IO[bytes]) -> None:
        self.run: dict[str, str] = {}
        self.complete = False
        self._records = StreamReader(file, validate_crcs=True).records
        self._topics: dict[int, str] = {}

    def ticks(self) -> Iterator[RecordedTick]:
        scan: Scan | None = None
        odometry: Odometry | None = None
        twist = STOP
        for topic, data in self._messages():
            if topic == "scan":
                scan = codec.decode_scan(data)
            elif topic == "odom":
                odometry = codec.decode_odometry(data)
            elif topic == "cmd_vel":
                twist = codec.decode_twist(data)
            elif topic == "tick" and scan is not None and odometry is not None:
                told = json.loads(codec.decode_text(data))
                door = None if told["door"] is None else DoorReply(**told["door"])
                observation = Observation(told["stamp"], scan, odometry, door, LinkStatus(**told["link"]))
                yield RecordedTick(observation, Command(twist, told["ring"], told["answers"]), told["step"])

    def _messages(self) -> Iterator[tuple[str, bytes]]:
        for record in self._whole():
            if isinstance(record, Channel):
                self._topics[record.id] = record.topic
            elif isinstance(record, Metadata) and record.name == RUN:
                self.run = dict(record.metadata)
            elif isinstance(record, Record):
                prefix = f"/{self.run.get('robot', '')}/"
                yield self._topics[record.channel_id].removeprefix(prefix), record.data

    def _whole(self) -> Iterable[object]:
        """The records up to the end, or to where a crash cut the file off."""
        try:
            yield from self._records
        except _CUT_OFF as error:
            if not self.run:
                raise RecordingError(str(error)) from None
        else:
            self.complete = True


class ReplayRobot:
    """A robot that shows a recorded run again, whatever it is told.

    Attributes:
        finished: the last observation has been answered.
    """

    def __init__(self, recording: Recording) -> None:
        self.finished = not recording.ticks
        self._ticks = recording.ticks
        self._next = 0

    def observe(self) -> Observation:
        """The next recorded observation, as it was.

        Raises:
            LinkError: the recording has ended.
        """
        if self._next >= len(self._ticks):
            raise LinkError("the recording has ended")
        return self._ticks[self._next].observation

    def command(self, command: Command) -> None:
        """Go on to the next observation."""
        del command
        self._next += 1
        self.finished = self._next >= len(self._ticks)

    def report(self) -> Mapping[str, object]:
        """Nothing: the referee is not recorded."""
        return {}

    def close(self) -> None:
        """Nothing to let go of."""
