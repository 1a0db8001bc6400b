"""Sessions: a controller takes and releases a robot by questions and answers in JSON on ``<robot>/session``.

The JSON is followed by a line with its CRC-32 in eight hexadecimal digits, so that a damaged question is never
accepted: the robot's side answers that it could not read it, and the controller asks again. Every field is bounded by
its type; a whole question with a value out of bounds is refused, and the refusal names the field.
"""

from __future__ import annotations

import hmac
import json
import logging
import secrets
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Literal, Protocol

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, JsonValue, TypeAdapter, ValidationError

from transport.bus import Bus, ask_until
from transport.clock import Clock, MonotonicClock
from transport.codec import CodecError
from transport.keys import RobotKeys
from transport.robot import LinkError, NoAnswerError
from transport.section import ROBOT_NAME
from transport.wording import in_words, printable

PROTOCOL = 2
"""Version of the whole conversation; both sides must speak the same."""

MAX_QUESTION = 4096
_PAUSE, _AGAIN, _NEIGHBOUR = 0.2, 0.02, 0.5
_MONOTONIC = MonotonicClock()
_OTHER_VERSION = f"the robot's side speaks protocol version {PROTOCOL}, not {{}}"
_MISUNDERSTANDING = f"the robot's side speaks {{}}, this program speaks version {PROTOCOL}"

_LOG = logging.getLogger(__name__)

Mode = Literal["lockstep", "realtime"]


def _printable_values(value: JsonValue) -> JsonValue:
    if isinstance(value, str):
        return printable(value)
    if isinstance(value, list):
        return [_printable_values(one) for one in value]
    if isinstance(value, dict):
        return {printable(key): _printable_values(one) for key, one in value.items()}
    return value


def _printable_report(report: dict[str, JsonValue]) -> dict[str, JsonValue]:
    return {printable(key): _printable_values(value) for key, value in report.items()}


Number = Annotated[int, Field(ge=0, lt=2**63)]
"""A lease's number, an observation's number, a seed."""
Count = Annotated[int, Field(ge=0, lt=2**31)]
Seconds = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]
Label = Annotated[str, Field(max_length=200), AfterValidator(printable)]
"""A short text for people, without control characters."""
Text = Annotated[str, Field(max_length=1000), AfterValidator(printable)]
Secret = Annotated[str, Field(max_length=64, pattern="^[0-9a-f]*$")]
"""The secret of the holder of a lease; empty if there is none."""
Report = Annotated[dict[str, JsonValue], AfterValidator(_printable_report)]


class _Part(BaseModel):
    """A question or an answer; fields that are not known, of a later version or somebody's own, are ignored."""

    model_config = ConfigDict(frozen=True, extra="ignore", strict=True)


class Open(_Part):
    """Take the robot; in simulation, begin an episode."""

    kind: Literal["open"] = "open"
    protocol: Count = PROTOCOL
    request: Label
    """A unique name of the request: a repeated question gets the same answer."""
    controller: Label
    """Who asks, for people."""
    seed: Number | None = None
    """Which run to simulate; None leaves it to the simulator."""
    previous: Secret = ""
    """The secret of the asker's last lease, if it takes the robot again: a simulator then continues where it was."""


class Close(_Part):
    """Give the robot back."""

    kind: Literal["close"] = "close"
    protocol: Count = PROTOCOL
    secret: Secret
    """Of the asker's lease."""


class Ask(_Part):
    """Ask for the state of a lease and for the referee's verdict."""

    kind: Literal["ask"] = "ask"
    protocol: Count = PROTOCOL
    secret: Secret
    """Of the asker's lease."""


class Retry(_Part):
    """Have the robot put back to the start for another attempt; time runs on. In lockstep only."""

    kind: Literal["again"] = "again"
    protocol: Count = PROTOCOL
    secret: Secret
    """Of the asker's lease."""
    attempt: Count
    """The number of the attempt to begin, so that the question may be asked twice."""


class Granted(_Part):
    """The robot is granted."""

    kind: Literal["granted"] = "granted"
    protocol: Count = PROTOCOL
    epoch: Number
    """The lease's number, which every observation and every command contains in clear text."""
    secret: Secret
    """Proves that a question comes from the holder, and signs its commands; observations never contain it."""
    robot: Annotated[str, Field(max_length=200, pattern=ROBOT_NAME)]
    """Name of the robot."""
    mode: Mode
    """Whether time waits for the controller."""
    period: Annotated[float, Field(gt=0, le=3600, allow_inf_nan=False)]
    """Time from one command to the next, s."""


class Refused(_Part):
    """The robot is refused."""

    kind: Literal["refused"] = "refused"
    protocol: Count = PROTOCOL
    reason: Text
    holder: Label = ""
    """Who holds the lease."""
    idle: Seconds = 0.0
    """How long its holder has been silent, s."""
    patience: Seconds = 0.0
    """The silence after which the lease is free, s."""


class SessionState(_Part):
    """The state of the lease and the episode."""

    kind: Literal["state"] = "state"
    protocol: Count = PROTOCOL
    held: bool
    """Whether the asker's lease still holds."""
    reason: Text = ""
    """Why it does not."""
    sequence: Number = 0
    """Number of the last observation."""
    report: Report | None = None
    """The referee's verdict so far, where there is a referee."""
    attempt: Count = 1
    """Number of the present attempt."""
    attempts: Annotated[list[Report], Field(max_length=1000)] = []
    """The referee's verdict on each attempt so far, where there may be several."""


class Unread(_Part):
    """The question was damaged or of another protocol."""

    kind: Literal["unread"] = "unread"
    protocol: Count = PROTOCOL
    reason: Text = f"the question is not one of protocol version {PROTOCOL}"


_Question = Annotated[Open | Close | Ask | Retry, Field(discriminator="kind")]
_Answer = Annotated[Granted | Refused | SessionState | Unread, Field(discriminator="kind")]
_QUESTION: TypeAdapter[Open | Close | Ask | Retry] = TypeAdapter(_Question)
_ANSWER: TypeAdapter[Granted | Refused | SessionState | Unread] = TypeAdapter(_Answer)


class ProtocolError(CodecError):
    """An intact question that this program cannot answer; the message says why."""


def written(part: BaseModel) -> bytes:
    """A question or an answer as it is sent."""
    text = part.model_dump_json().encode()
    return b"%s\n%08x" % (text, zlib.crc32(text))


def _text(payload: bytes) -> bytes:
    text, _, checksum = payload.rpartition(b"\n")
    if checksum != b"%08x" % zlib.crc32(text):
        raise CodecError("not a question or an answer, or a damaged one")
    return text


def read_question(payload: bytes) -> Open | Close | Ask | Retry:
    """The question in a payload.

    Raises:
        CodecError: it is not a question, or it is damaged. ProtocolError: it is intact, but of another version, or a
            value in it is out of bounds.
    """
    if len(payload) > MAX_QUESTION:
        raise ProtocolError("the question is too long")
    text = _text(payload)
    try:
        question = _QUESTION.validate_json(text)
    except ValidationError as error:
        version = _version(text)
        if version is not None and version != PROTOCOL:
            raise ProtocolError(_OTHER_VERSION.format(version)) from None
        fault = error.errors(include_url=False)[0]
        raise ProtocolError(f"the question is not valid: {in_words(fault)[:200]}") from None
    if question.protocol != PROTOCOL:
        raise ProtocolError(_OTHER_VERSION.format(question.protocol))
    return question


def _version(text: bytes) -> int | None:
    """The version of a question, whatever else is in it."""
    try:
        question = json.loads(text)
    except (ValueError, RecursionError):
        return None
    version = question.get("protocol") if isinstance(question, dict) else None
    return version if isinstance(version, int) and 0 <= version < 2**31 else None


def read_answer(payload: bytes) -> Granted | Refused | SessionState | Unread:
    """The answer in a payload.

    Raises:
        CodecError: it is not an answer.
    """
    try:
        return _ANSWER.validate_json(_text(payload))
    except ValidationError as error:
        raise CodecError(f"not an answer: {error.error_count()} faults") from None


@dataclass
class Lease:
    """The lease: the one controller that a robot's side obeys.

    Attributes:
        patience: a holder that was silent for this long may be replaced, s.
        clock: monotonic time, s.
        epoch: the lease's number; 0 where none is held.
        secret: the secret of its holder; empty if none is held.
        holder: who holds it, for people.
    """

    patience: float
    clock: Callable[[], float] = time.monotonic
    epoch: int = 0
    secret: str = ""
    holder: str = ""
    _heard: float = 0.0
    _request: str = ""

    def grant(self, question: Open) -> bool:
        """Whether the asker may have the robot; if so, a new epoch has begun."""
        if self.epoch and self.idle < self.patience and not self.proves(question.previous):
            return False
        # Random, so that a restarted robot's side never accepts an old command.
        self.epoch = secrets.randbits(62) + 1
        self.secret = secrets.token_hex(16)
        self.holder, self._request = question.controller, question.request
        self.heard()
        return True

    def proves(self, secret: str) -> bool:
        """Whether a secret is the holder's."""
        return bool(self.secret) and hmac.compare_digest(secret, self.secret)

    def repeats(self, question: Open) -> bool:
        """Whether this request has been granted already."""
        return bool(self.epoch) and question.request == self._request

    def heard(self) -> None:
        """Its holder gave a sign of life."""
        self._heard = self.clock()

    @property
    def idle(self) -> float:
        """How long its holder has been silent, s."""
        return self.clock() - self._heard

    def release(self) -> None:
        """Free the lease."""
        self.epoch, self.secret, self.holder, self._request = 0, "", "", ""

    def refusal(self) -> Refused:
        """The answer to a second controller."""
        return Refused(
            reason=f"the robot is driven by {self.holder}",
            holder=self.holder,
            idle=round(self.idle, 3),
            patience=self.patience,
        )


class SessionHandler(Protocol):
    """The robot's side of a session."""

    @property
    def lease(self) -> Lease:
        """Who may command the robot."""
        ...

    def open(self, question: Open) -> Granted | Refused:
        """A controller requests the robot."""
        ...

    def close(self, question: Close) -> SessionState:
        """A controller releases the robot."""
        ...

    def state(self, question: Ask) -> SessionState:
        """A controller asks for the state."""
        ...

    def again(self, question: Retry) -> SessionState:
        """A controller requests another attempt; the answer's number shows whether it has begun."""
        ...


def respond(desk: SessionHandler, payload: bytes) -> tuple[bytes, str]:
    """The answer to a question, and the reason to count it as failed, or nothing.

    Neither the contents of a question nor an error while it is answered has an effect beyond its answer.
    """
    try:
        question = read_question(payload)
    except ProtocolError as error:
        return written(Refused(reason=str(error))), "malformed question"
    except CodecError:
        return written(Unread()), "malformed question"
    try:
        return written(_answered(desk, question)), ""
    except Exception as error:
        reason = f"the robot's side failed: {type(error).__name__}: {error}"[:500]
        _LOG.error("the question `%s` of a controller: %s", question.kind, printable(reason))
        _LOG.debug("where it failed", exc_info=True)
        return written(Refused(reason=reason)), "failed question"


def _answered(desk: SessionHandler, question: Open | Close | Ask | Retry) -> Granted | Refused | SessionState:
    if isinstance(question, Close):
        return desk.close(question)
    if isinstance(question, Ask):
        return desk.state(question)
    if isinstance(question, Retry):
        return desk.again(question)
    return desk.open(question)


def _converse(
    bus: Bus, robot: str, question: Open | Close | Ask | Retry, timeout: float, clock: Clock
) -> Granted | Refused | SessionState | None:
    """The answer to a question, repeated until both arrive undamaged; None without an answer."""
    deadline = clock.now() + timeout
    spoken = ""
    while (left := deadline - clock.now()) > 0:
        payload = ask_until(bus, RobotKeys(robot).session, written(question), left, clock)
        if payload is None:
            break
        answer = _understood(payload)
        if answer is not None and answer.protocol != PROTOCOL:
            raise LinkError(_MISUNDERSTANDING.format(f"version {answer.protocol} of the protocol"))
        if answer is not None and not isinstance(answer, Unread):
            return answer
        spoken = "another protocol"
        clock.wait(min(_AGAIN, left))
    if spoken:
        raise LinkError(_MISUNDERSTANDING.format(spoken))
    return None


def _understood(payload: bytes) -> Granted | Refused | SessionState | Unread | None:
    try:
        return read_answer(payload)
    except CodecError:
        return None


def open_session(bus: Bus, robot: str, question: Open, timeout: float, clock: Clock = _MONOTONIC) -> Granted:
    """Take a robot.

    The lease of a dead holder becomes free after its timeout, which this waits for; a live holder is not disturbed.

    Raises:
        NoAnswerError: there is no answer within ``timeout`` seconds.
        LinkError: the robot is refused.
    """
    deadline = clock.now() + timeout
    idle: float | None = None
    while True:
        answer = _converse(bus, robot, question, max(deadline - clock.now(), 0.1), clock)
        if answer is None:
            raise NoAnswerError(f"no robot named {robot!r} answered within {timeout:g} s")
        if isinstance(answer, Granted):
            if answer.robot != robot:
                raise LinkError(f"{robot!r} was requested, and {answer.robot!r} was granted")
            return answer
        if not isinstance(answer, Refused):
            raise LinkError("the robot's side did not answer with a lease")
        alive = idle is not None and answer.idle < idle + _PAUSE / 2
        if alive or not answer.holder or clock.now() >= deadline:
            raise LinkError(answer.reason)
        idle = answer.idle
        clock.wait(_PAUSE)


def ask_state(bus: Bus, robot: str, secret: str, timeout: float, clock: Clock = _MONOTONIC) -> SessionState:
    """The state of a lease and its episode.

    Raises:
        LinkError: there is no answer within ``timeout`` seconds, or the robot's side cannot answer.
    """
    return _state(bus, robot, Ask(secret=secret), timeout, clock)


def check_name(bus: Bus, robot: str) -> None:
    """Make sure that no other program on the network serves a robot of this name.

    Raises:
        LinkError: there is one.
    """
    if bus.ask(RobotKeys(robot).session, written(Ask(secret="")), _NEIGHBOUR) is not None:
        raise LinkError(f"there is a robot named {robot!r} on this network already: choose another `robot.name`")


def begin_again(bus: Bus, robot: str, question: Retry, timeout: float) -> SessionState:
    """Ask for another attempt, which has begun if the answer has its number.

    Raises:
        LinkError: there is no answer within ``timeout`` seconds, or the robot's side cannot answer.
    """
    return _state(bus, robot, question, timeout, _MONOTONIC)


def _state(bus: Bus, robot: str, question: Ask | Retry, timeout: float, clock: Clock) -> SessionState:
    answer = _converse(bus, robot, question, timeout, clock)
    if isinstance(answer, Refused):
        raise LinkError(answer.reason)
    if not isinstance(answer, SessionState):
        raise LinkError(f"{robot!r} has not answered for {timeout:g} s")
    return answer


def close_session(bus: Bus, robot: str, secret: str, timeout: float, clock: Clock = _MONOTONIC) -> None:
    """Release a robot; without an answer, its side frees the lease by itself."""
    _converse(bus, robot, Close(secret=secret), timeout, clock)
