"""The messages in an untrusted file: MCAP, or a rosbag2 folder or database, within bounds.

Nothing in a file is trusted: a length that it declares only bounds what is read, and what is decompressed is
counted as it comes out. Sources: the MCAP specification, version 0; the schema of rosbag2_storage_sqlite3.
"""

from __future__ import annotations

import re
import sqlite3
import struct
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Protocol
from urllib.parse import quote

import lz4.frame
import zstandard
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Chunk, McapRecord, Metadata, Schema
from mcap.records import Message as Record
from mcap.stream_reader import StreamReader, breakup_chunk

from transport.files import read_at_most
from transport.recording.values import RecordingError

RUN = "run"
"""Name of the metadata record that describes a run of this program."""
ENDING = "ending"
"""Name of the metadata record that says how it ended."""
LARGEST_RECORD = 64 * 1024 * 1024
"""Records, chunks and messages are not larger than this, bytes."""
LARGEST = 4 * 1024**3
"""All records of a file together are not larger than this, decompressed, bytes."""
WINDOW = 128 * 1024 * 1024
"""The most memory that a decompressor may ask for, bytes."""
MCAP, SQLITE, ZSTD, ROS1 = b"\x89MCAP0\r\n", b"SQLite format 3\0", b"\x28\xb5\x2f\xfd", b"#ROSBAG V"
SUFFIXES = (".mcap", ".db3", ".mcap.zstd", ".db3.zstd")
"""How the files of a rosbag2 folder end."""
STEPS = 50_000_000
"""After this many steps of the database's machine without a row a question to it is given up."""

# What a reader stumbles over at a cut or at nonsense depends on the record.
BROKEN = (
    McapError,
    struct.error,
    zstandard.ZstdError,
    ValueError,
    EOFError,
    OverflowError,
    MemoryError,
    RuntimeError,
    KeyError,
    TypeError,
    AttributeError,
)


@dataclass(frozen=True, slots=True)
class RecordedMessage:
    """One message.

    Attributes:
        topic: on which it came.
        kind: its ROS type, such as ``sensor_msgs/msg/LaserScan``; another word where it is not a ROS 2 message in CDR.
        stamp: when it was recorded, ns.
        data: its bytes.
    """

    topic: str
    kind: str
    stamp: int
    data: bytes


class Messages(Protocol):
    """The messages of a file, to be gone through once.

    Attributes:
        run: after that, what this program wrote about its run; empty where it did not.
        ending: after that, what it wrote about the run's end.
        complete: after that, whether the file was whole.
    """

    run: Mapping[str, str]
    ending: Mapping[str, str]
    complete: bool

    def __iter__(self) -> Iterator[RecordedMessage]:
        """The messages in the order in which they were recorded."""
        ...


def messages_of(path: Path) -> Messages:
    """The messages in an MCAP file, a rosbag2 database, or a rosbag2 folder with such files.

    Raises:
        RecordingError: it is none of them.
        OSError: it cannot be read.
    """
    if path.is_dir():
        files = [file for file in path.iterdir() if file.name.endswith(SUFFIXES)]
        if not files:
            raise RecordingError("is a folder without an .mcap or .db3 file")
        return _Folder([messages_of(file) for file in sorted(files, key=_number)])
    head = read_at_most(path, 16)
    if head.startswith(MCAP):
        return _McapFile(path)
    if head.startswith(SQLITE):
        return _Database(path)
    if head.startswith(ZSTD):
        return _Compressed(path)
    if head.startswith(ROS1):
        raise RecordingError("is a bag of ROS 1: convert it first, for example with rosbags-convert")
    raise RecordingError("is neither an MCAP file nor a rosbag2 database" if head else "is empty")


def _number(file: Path) -> tuple[int, str]:
    """A bag's files are numbered: NAME_0.mcap, NAME_1.mcap, ..., NAME_10.mcap."""
    numbered = re.search(r"_(\d{1,9})\.", file.name)
    return int(numbered[1]) if numbered else 0, file.name


class _Folder:
    """Several files, one after the other."""

    def __init__(self, parts: list[Messages]) -> None:
        self.run: Mapping[str, str] = {}
        self.ending: Mapping[str, str] = {}
        self.complete = False
        self._parts = parts

    def __iter__(self) -> Iterator[RecordedMessage]:
        for part in self._parts:
            yield from part
            self.run = part.run or self.run
            self.ending = part.ending or self.ending
        self.complete = all(part.complete for part in self._parts)


class _Left:
    """A file that is never asked for more than it has left, whatever its records declare."""

    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file, self._left = file, size

    def read(self, length: int) -> bytes:
        """The next bytes, as many as there are."""
        data = self._file.read(min(length, self._left))
        self._left -= len(data)
        return data


class _McapFile:
    """The messages of one MCAP file."""

    def __init__(self, path: Path) -> None:
        self.run: Mapping[str, str] = {}
        self.ending: Mapping[str, str] = {}
        self.complete = False
        self._path = path
        self._kinds: dict[int, str] = {}
        self._topics: dict[int, tuple[str, str]] = {}

    def __iter__(self) -> Iterator[RecordedMessage]:
        with self._path.open("rb") as file:
            size = self._path.stat().st_size
            for record in self._records(_Left(file, size)):
                if isinstance(record, Schema):
                    known = record.encoding in ("ros2msg", "ros2idl")
                    self._kinds[record.id] = record.name if known else f"{record.encoding} {record.name}"
                elif isinstance(record, Channel):
                    kind = self._kinds.get(record.schema_id, "")
                    cdr = record.message_encoding == "cdr"
                    self._topics[record.id] = record.topic, kind if cdr else f"{record.message_encoding} {kind}"
                elif isinstance(record, Metadata) and record.name == RUN:
                    self.run = dict(record.metadata)
                elif isinstance(record, Metadata) and record.name == ENDING:
                    self.ending = dict(record.metadata)
                elif isinstance(record, Record) and record.channel_id in self._topics:
                    topic, kind = self._topics[record.channel_id]
                    yield RecordedMessage(topic, _long(kind), record.log_time, record.data)

    def _records(self, file: _Left) -> Iterator[McapRecord]:
        """The records up to the end, or to where the file is cut off or corrupt."""
        left = LARGEST
        reader = StreamReader(file, emit_chunks=True, validate_crcs=True, record_size_limit=LARGEST_RECORD)  # type: ignore[arg-type]
        try:
            for record in reader.records:
                if not isinstance(record, Chunk):
                    yield record
                    continue
                whole = _unpacked(record)
                left -= len(whole.data)
                if left < 0:
                    raise RecordingError(f"holds more than the limit of {LARGEST // 1024**3} GB")
                yield from breakup_chunk(whole, validate_crc=True)
        except BROKEN as error:
            if not self._topics and not self.run:
                cut = (
                    "it was cut off before the first chunk was written"
                    if isinstance(error, EndOfFile | EOFError)
                    else str(error)
                )
                raise RecordingError(f"cannot be read: {cut or type(error).__name__}") from None
        else:
            self.complete = True


def _unpacked(chunk: Chunk) -> Chunk:
    """A chunk without compression.

    Raises:
        RecordingError: it declares, or holds, more than a chunk may.
    """
    declared = chunk.uncompressed_size
    if declared > LARGEST_RECORD:
        raise RecordingError(f"has a chunk that declares {declared} bytes; at most {LARGEST_RECORD} are read")
    if chunk.compression == "zstd":
        data = _decompressed(chunk.data, declared)
    elif chunk.compression == "lz4":
        data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=declared + 1)
    else:
        data = chunk.data
    if len(data) != declared:
        raise RecordingError(f"has a chunk that declares {declared} bytes and holds another number of them")
    return replace(chunk, compression="", data=data)


def _decompressed(data: bytes, most: int) -> bytes:
    """What zstd makes of bytes, up to one byte more than ``most``."""
    unpacker = zstandard.ZstdDecompressor(max_window_size=WINDOW)
    with unpacker.stream_reader(data) as stream:
        return stream.read(most + 1)


class _Database:
    """The messages of one rosbag2 database (SQLite)."""

    def __init__(self, path: Path) -> None:
        self.run: Mapping[str, str] = {}
        self.ending: Mapping[str, str] = {}
        self.complete = False
        self._path = path

    def __iter__(self) -> Iterator[RecordedMessage]:
        location = f"file:{quote(str(self._path.resolve()))}?mode=ro&immutable=1"
        left = LARGEST
        try:
            with closing(sqlite3.connect(location, uri=True)) as database:
                database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_RECORD)
                # A view that never ends could be in for a table.
                database.set_progress_handler(lambda: 1, STEPS)
                for topic, kind, form, at, data in database.execute(_QUESTION):
                    database.set_progress_handler(lambda: 1, STEPS)
                    left -= len(data)
                    if left < 0:
                        raise RecordingError(f"holds more than the limit of {LARGEST // 1024**3} GB")
                    packed = data.startswith(ZSTD)
                    content = _decompressed(data, LARGEST_RECORD) if packed else data
                    yield RecordedMessage(
                        str(topic), _long(str(kind)) if form == "cdr" else f"{form} {kind}", int(at), content
                    )
        except (sqlite3.Error, zstandard.ZstdError, TypeError, ValueError, AttributeError) as error:
            raise RecordingError(f"is not a rosbag2 database: {error}") from None
        self.complete = True


_QUESTION = (
    "SELECT topics.name, topics.type, topics.serialization_format, messages.timestamp, messages.data "
    "FROM messages JOIN topics ON messages.topic_id = topics.id ORDER BY messages.timestamp, messages.id"
)


class _Compressed:
    """The messages of a file that zstd has compressed as a whole."""

    def __init__(self, path: Path) -> None:
        self.run: Mapping[str, str] = {}
        self.ending: Mapping[str, str] = {}
        self.complete = False
        self._path = path

    def __iter__(self) -> Iterator[RecordedMessage]:
        with tempfile.TemporaryDirectory() as folder:
            plain = Path(folder) / "bag"
            with self._path.open("rb") as packed, plain.open("wb") as file:
                self._unpack(packed, file)
            inner = messages_of(plain)
            if isinstance(inner, _Compressed):
                raise RecordingError("is compressed twice")
            yield from inner
            self.run, self.ending, self.complete = inner.run, inner.ending, inner.complete

    @staticmethod
    def _unpack(packed: IO[bytes], file: IO[bytes]) -> None:
        left = LARGEST
        try:
            unpacker = zstandard.ZstdDecompressor(max_window_size=WINDOW)
            for part in unpacker.read_to_iter(packed):
                left -= len(part)
                if left < 0:
                    raise RecordingError(f"holds more than the limit of {LARGEST // 1024**3} GB")
                file.write(part)
        except zstandard.ZstdError as error:
            raise RecordingError(f"cannot be decompressed: {error}") from None


def _long(kind: str) -> str:
    """A type's name with the part that ROS 2 sometimes leaves out: ``sensor_msgs/LaserScan`` has no ``msg``."""
    parts = kind.split("/")
    return f"{parts[0]}/msg/{parts[1]}" if len(parts) == 2 and " " not in kind else kind
