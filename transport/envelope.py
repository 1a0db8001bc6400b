"""Attachments of Zenoh messages: the values that ROS 2 messages have no fields for.

Both attachments are little-endian and begin with a version; both have a CRC-32 of themselves and of the payload, so
that a message that was damaged anywhere between the two programs is never accepted. A command is signed with the secret
of its lease, so that a program that only reads messages cannot command a robot. ``docs/reference/link.md`` lists them
field by field.
"""

from __future__ import annotations

import hmac
import struct
import zlib
from hashlib import blake2s
from typing import NamedTuple

from transport.codec import CodecError
from transport.messages import DoorReply

VERSION = 2
MAX_REASON = 200
"""Longest reason of a door's answer, bytes of UTF-8; a longer one is cut."""

# version, flags, two unused bytes, CRC-32, then what the class lists
_COMMAND = struct.Struct("<BBxxIQQq")
_SIGNATURE = 8
_OBSERVATION = struct.Struct("<BBxxIIIQQQq")
_SEAL, _SEALED = struct.calcsize("<BBxx"), struct.calcsize("<BBxxI")
_NO_CHECKSUM = bytes(_SEALED - _SEAL)
_RING, _AGAIN = 1, 2
_FINISHED, _STOPPED, _DOOR, _DOOR_ACCEPTED = 1, 2, 4, 8
_MOST = 2**32 - 1


class CommandTag(NamedTuple):
    """The attachment of a command.

    Attributes:
        epoch: the lease under which it is given.
        sequence: in lockstep the number of the observation that it answers; in real time a strictly rising number.
        answers: stamp of the observation that it answers, ns on the robot's clock.
        ring: ring the door bell.
        again: contains no command, only a request to repeat the last observation.
    """

    epoch: int
    sequence: int
    answers: int
    ring: bool = False
    again: bool = False

    def encode(self, payload: bytes, secret: str) -> bytes:
        """The attachment's bytes for a payload, signed with the secret of the lease."""
        flags = _RING * self.ring | _AGAIN * self.again
        attachment = _COMMAND.pack(VERSION, flags, 0, self.epoch, self.sequence, self.answers)
        return sealed(attachment + _signature(attachment, payload, secret), payload)

    @classmethod
    def decode(cls, attachment: bytes, payload: bytes) -> CommandTag:
        """Read an attachment; see :func:`is_signed` for whether the holder of the lease has sent it.

        Raises:
            CodecError: it is not one of a command, of another version, or damaged.
        """
        flags, epoch, sequence, answers = _opened(_COMMAND, attachment, payload)
        if len(attachment) != _COMMAND.size + _SIGNATURE:
            raise CodecError("the attachment of a command has another length")
        return cls(epoch, sequence, answers, bool(flags & _RING), bool(flags & _AGAIN))


def is_signed(attachment: bytes, payload: bytes, secret: str) -> bool:
    """Whether a command was signed with this secret."""
    unsigned = attachment[: _COMMAND.size]
    return hmac.compare_digest(attachment[_COMMAND.size :], _signature(unsigned, payload, secret))


def _signature(attachment: bytes, payload: bytes, secret: str) -> bytes:
    """Keyed BLAKE2s (RFC 7693) of an attachment except for its checksum, and of a payload; eight bytes."""
    signed = attachment[:_SEAL] + attachment[_SEALED:] + payload
    return blake2s(signed, digest_size=_SIGNATURE, key=secret.encode()[: blake2s.MAX_KEY_SIZE]).digest()


class ObservationTag(NamedTuple):
    """The attachment of every scan and every odometry.

    Attributes:
        epoch: the lease that is held, 0 where none is.
        sequence: the observation's number.
        stamp: the observation's time, ns on the robot's clock.
        instance: which start of the robot's side this is; numbers begin again with it.
        rejected: how many commands the robot's side has rejected (it stops counting at 2^32 - 1).
        rings: how many rings have been answered.
        finished: the episode is over; the referee's verdict can be asked for.
        stopped: the command time-out has stopped the robot, which waits for a new lease.
        door: the last answer to a ring; in lockstep only where it is new.
    """

    epoch: int
    sequence: int
    stamp: int
    instance: int = 0
    rejected: int = 0
    rings: int = 0
    finished: bool = False
    stopped: bool = False
    door: DoorReply | None = None

    def open(self) -> bytes:
        """The attachment's bytes for any payload, to be sealed for each."""
        flags, reason = _FINISHED * self.finished | _STOPPED * self.stopped, b""
        if self.door is not None:
            flags |= _DOOR | _DOOR_ACCEPTED * self.door.accepted
            reason = self.door.reason.encode()[:MAX_REASON]
        counts = min(self.rejected, _MOST), min(self.rings, _MOST)
        fields = self.epoch, self.instance, self.sequence, self.stamp
        return _OBSERVATION.pack(VERSION, flags, 0, *counts, *fields) + reason

    def encode(self, payload: bytes) -> bytes:
        """The attachment's bytes for a payload."""
        return sealed(self.open(), payload)

    @classmethod
    def decode(cls, attachment: bytes, payload: bytes) -> ObservationTag:
        """Read an attachment.

        Raises:
            CodecError: it is not one of an observation, of another version, or damaged.
        """
        flags, rejected, rings, epoch, instance, sequence, stamp = _opened(_OBSERVATION, attachment, payload)
        if len(attachment) > _OBSERVATION.size + MAX_REASON:
            raise CodecError("the attachment of an observation is too long")
        door = None
        if flags & _DOOR:
            reason = attachment[_OBSERVATION.size :].decode(errors="ignore")
            door = DoorReply(bool(flags & _DOOR_ACCEPTED), reason)
        finished, stopped = bool(flags & _FINISHED), bool(flags & _STOPPED)
        return cls(epoch, sequence, stamp, instance, rejected, rings, finished, stopped, door)


def is_tagged(attachment: bytes) -> bool:
    """Whether an attachment is long enough to be one of an observation; another program's rarely is."""
    return len(attachment) >= _OBSERVATION.size


def is_whole(payload: bytes, attachment: bytes) -> bool:
    """Whether a payload and its attachment arrived undamaged."""
    return attachment[_SEAL:_SEALED] == _checksum(attachment, payload)


def same_observation(attachment: bytes, other: bytes) -> bool:
    """Whether two attachments belong to one observation: lease, start, number and stamp are equal."""
    return attachment[_SEALED:] == other[_SEALED:]


def sealed(attachment: bytes, payload: bytes) -> bytes:
    """An attachment with the checksum of itself and of the payload that it rides with."""
    return attachment[:_SEAL] + _checksum(attachment, payload) + attachment[_SEALED:]


def _checksum(attachment: bytes, payload: bytes) -> bytes:
    """CRC-32 of an attachment, with zero where its checksum is, and of a payload."""
    blank = attachment[:_SEAL] + _NO_CHECKSUM + attachment[_SEALED:]
    return zlib.crc32(payload, zlib.crc32(blank)).to_bytes(4, "little")


def _opened(layout: struct.Struct, attachment: bytes, payload: bytes) -> tuple[int, ...]:
    """The flags of an attachment and what its class lists."""
    if len(attachment) < layout.size:
        raise CodecError("the attachment is too short: the message comes from a foreign sender")
    version, flags, _, *fields = layout.unpack_from(attachment)
    if version != VERSION:
        raise CodecError(f"the attachment has version {version}, this program speaks version {VERSION}")
    if not is_whole(payload, attachment):
        raise CodecError("the message was damaged")
    return flags, *fields
