"""What ROS 2 messages cannot carry, as the attachment of the Zenoh message that carries them.

Both attachments are little-endian and begin with a version; both bear a CRC-32 of themselves and of the payload, so
that a message that was damaged anywhere between the two programs is never taken for a good one.
``docs/reference/link.md`` lists them field by field.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass

from transport.codec import CodecError
from transport.messages import DoorReply

VERSION = 1
MAX_REASON = 200
"""Longest reason of a door's answer, bytes of UTF-8; a longer one is cut."""

_LAYOUT = struct.Struct("<BBxxIQQqI")
_RING, _AGAIN = 1, 2
_FINISHED, _DOOR, _DOOR_ACCEPTED, _STOPPED = 1, 2, 4, 8


@dataclass(frozen=True, slots=True)
class CommandTag:
    """Rides with a command.

    Attributes:
        epoch: the lease under which it is given.
        sequence: in lockstep the number of the observation that it answers; in real time a strictly rising number.
        answers: stamp of the observation that it answers, ns on the robot's clock.
        ring: ring the door bell.
        again: carries no command, only the wish to hear the last observation again.
    """

    epoch: int
    sequence: int
    answers: int
    ring: bool = False
    again: bool = False

    def encode(self, payload: bytes) -> bytes:
        """The attachment's bytes for a payload."""
        flags = _RING * self.ring | _AGAIN * self.again
        return _pack((flags, 0, self.epoch, self.sequence, self.answers), b"", payload)

    @classmethod
    def decode(cls, attachment: bytes, payload: bytes) -> CommandTag:
        """Read an attachment.

        Raises:
            CodecError: it is not one of a command, of another version, or damaged.
        """
        (flags, _count, epoch, sequence, answers), rest = _unpack(attachment, payload)
        if rest:
            raise CodecError("the attachment of a command is too long")
        return cls(epoch, sequence, answers, bool(flags & _RING), bool(flags & _AGAIN))


@dataclass(frozen=True, slots=True)
class ObservationTag:
    """Rides with every scan and every odometry.

    Attributes:
        epoch: the lease that is held, 0 where none is.
        sequence: the observation's number.
        stamp: the observation's time, ns on the robot's clock.
        rejected: how many commands the robot's side has rejected in this epoch (it stops counting at 2^32 - 1).
        finished: the episode is over; the referee's verdict can be asked for.
        stopped: the dead man has stopped the robot, which waits for a new lease.
        door: the answer to a ring since the last observation.
    """

    epoch: int
    sequence: int
    stamp: int
    rejected: int = 0
    finished: bool = False
    stopped: bool = False
    door: DoorReply | None = None

    def encode(self, payload: bytes) -> bytes:
        """The attachment's bytes for a payload."""
        flags, reason = _FINISHED * self.finished | _STOPPED * self.stopped, b""
        if self.door is not None:
            flags |= _DOOR | _DOOR_ACCEPTED * self.door.accepted
            reason = self.door.reason.encode()[:MAX_REASON]
        counted = min(self.rejected, 2**32 - 1)
        return _pack((flags, counted, self.epoch, self.sequence, self.stamp), reason, payload)

    @classmethod
    def decode(cls, attachment: bytes, payload: bytes) -> ObservationTag:
        """Read an attachment.

        Raises:
            CodecError: it is not one of an observation, of another version, or damaged.
        """
        (flags, rejected, epoch, sequence, stamp), rest = _unpack(attachment, payload)
        if len(rest) > MAX_REASON:
            raise CodecError("the attachment of an observation is too long")
        reason = rest.decode(errors="ignore")
        door = DoorReply(bool(flags & _DOOR_ACCEPTED), reason) if flags & _DOOR else None
        return cls(epoch, sequence, stamp, rejected, bool(flags & _FINISHED), bool(flags & _STOPPED), door)


def _pack(fields: tuple[int, int, int, int, int], rest: bytes, payload: bytes) -> bytes:
    checksum = zlib.crc32(payload, zlib.crc32(_LAYOUT.pack(VERSION, *fields, 0) + rest))
    return _LAYOUT.pack(VERSION, *fields, checksum) + rest


def _unpack(attachment: bytes, payload: bytes) -> tuple[tuple[int, int, int, int, int], bytes]:
    if len(attachment) < _LAYOUT.size:
        raise CodecError("the attachment is too short: the message comes from a foreign sender")
    version, flags, counted, epoch, sequence, stamp, _checksum = _LAYOUT.unpack_from(attachment)
    if version != VERSION:
        raise CodecError(f"the attachment has version {version}, this program speaks version {VERSION}")
    rest = attachment[_LAYOUT.size :]
    fields = flags, counted, epoch, sequence, stamp
    if _pack(fields, rest, payload) != attachment:
        raise CodecError("the message was damaged on its way")
    return fields, rest
