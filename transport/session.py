"""How a controller takes and gives back a robot: questions and answers in JSON on ``<robot>/session``.

Behind the JSON stands a line with its CRC-32 in eight hexadecimal digits, so that one that was damaged is never taken
for a good one: whoever cannot read a question says so, and it is asked again.
"""

from __future__ import annotations

import secrets
import time
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Literal, Protocol

from pydantic import BaseModel, ConfigDict, Field, JsonValue, TypeAdapter, ValidationError

from transport.bus import Bus, ask_until
from transport.clock import Clock, MonotonicClock
from transport.codec import CodecError
from transport.keys import RobotKeys
from transport.robot import LinkError

PROTOCOL = 1
"""Version of the whole conversation; both sides must speak the same."""

MAX_QUESTION = 4096
_PAUSE, _AGAIN, _NEIGHBOUR = 0.2, 0.02, 0.5
_MONOTONIC = MonotonicClock()
_MISUNDERSTANDING = f"the robot's side speaks {{}}, this program speaks version {PROTOCOL}"

Mode = Literal["lockstep", "realtime"]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Open(_Part):
    """Take the robot; in simulation, begin an episode."""

    kind: Literal["open"] = "open"
    protocol: int = PROTOCOL
    request: str
    """A name that no other request has: asked twice, the question is answered alike."""
    controller: Annotated[str, Field(max_length=200)]
    """Who asks, for people."""
    seed: int | None = None
    """Which run to simulate; None leaves it to the simulator."""
    previous: int = 0
    """The asker's last lease, if it takes the robot again: a simulator then goes on where it was."""


class Close(_Part):
    """Give the robot back."""

    kind: Literal["close"] = "close"
    protocol: int = PROTOCOL
    epoch: int


class Ask(_Part):
    """Ask for the state of a lease and for the referee's verdict."""

    kind: Literal["ask"] = "ask"
    protocol: int = PROTOCOL
    epoch: int


class Again(_Part):
    """Have the robot put back to the start for another attempt; time runs on. In lockstep only."""

    kind: Literal["again"] = "again"
    protocol: int = PROTOCOL
    epoch: int
    attempt: int
    """The number of the attempt to begin, so that the question may be asked twice."""


class Granted(_Part):
    """The robot is the asker's."""

    kind: Literal["granted"] = "granted"
    protocol: int = PROTOCOL
    epoch: int
    """The lease's number, which every command must bear."""
    robot: str
    """Name of the robot."""
    mode: Mode
    """Whether time waits for the controller."""
    period: float
    """Time from one command to the next, s."""


class Refused(_Part):
    """The robot is not the asker's."""

    kind: Literal["refused"] = "refused"
    protocol: int = PROTOCOL
    reason: str
    holder: str = ""
    """Who holds the lease."""
    idle: float = 0.0
    """How long its holder has not been heard, s."""
    patience: float = 0.0
    """After how long without a word the lease is free, s."""


class State(_Part):
    """How the lease and the episode stand."""

    kind: Literal["state"] = "state"
    protocol: int = PROTOCOL
    held: bool
    """Whether the asker's lease still holds."""
    reason: str = ""
    """Why it does not."""
    sequence: int = 0
    """Number of the last observation."""
    report: dict[str, JsonValue] | None = None
    """The referee's verdict so far, where there is a referee."""
    attempt: int = 1
    """Number of the present attempt."""
    attempts: list[dict[str, JsonValue]] = []
    """The referee's verdict on each attempt so far, where there may be several."""


class Unread(_Part):
    """The question came damaged, or in another language."""

    kind: Literal["unread"] = "unread"
    protocol: int = PROTOCOL
    reason: str = f"the question is not one of protocol version {PROTOCOL}"


_Question = Annotated[Open | Close | Ask | Again, Field(discriminator="kind")]
_Answer = Annotated[Granted | Refused | State | Unread, Field(discriminator="kind")]
_QUESTION: TypeAdapter[Open | Close | Ask | Again] = TypeAdapter(_Question)
_ANSWER: TypeAdapter[Granted | Refused | State | Unread] = TypeAdapter(_Answer)


def written(part: BaseModel) -> bytes:
    """A question or an answer as it is sent."""
    text = part.model_dump_json().encode()
    return b"%s\n%08x" % (text, zlib.crc32(text))


def _text(payload: bytes) -> bytes:
    text, _, checksum = payload.rpartition(b"\n")
    if checksum != b"%08x" % zlib.crc32(text):
        raise CodecError("not a question or an answer, or one that was damaged on its way")
    return text


def read_question(payload: bytes) -> Open | Close | Ask | Again:
    """The question in a payload.

    Raises:
        CodecError: it is none.
    """
    if len(payload) > MAX_QUESTION:
        raise CodecError("a question is too long")
    try:
        return _QUESTION.validate_json(_text(payload))
    except ValidationError as error:
        raise CodecError(f"not a question: {error.error_count()} faults") from None


def read_answer(payload: bytes) -> Granted | Refused | State | Unread:
    """The answer in a payload.

    Raises:
        CodecError: it is none.
    """
    try:
        return _ANSWER.validate_json(_text(payload))
    except ValidationError as error:
        raise CodecError(f"not an answer: {error.error_count()} faults") from None


@dataclass
class Lease:
    """The one controller that a robot's side listens to.

    Attributes:
        patience: a holder that was not heard for so long may be replaced, s.
        clock: monotonic time, s.
        epoch: the lease's number; 0 where none is held.
        holder: who holds it, for people.
    """

    patience: float
    clock: Callable[[], float] = time.monotonic
    epoch: int = 0
    holder: str = ""
    _heard: float = 0.0
    _request: str = ""

    def grant(self, question: Open) -> bool:
        """Whether the asker may have the robot; if so, a new epoch has begun."""
        if self.epoch and self.idle < self.patience and question.previous != self.epoch:
            return False
        # Random, so that a robot's side that was restarted never takes an old command for one of its own.
        self.epoch = secrets.randbits(62) + 1
        self.holder, self._request = question.controller, question.request
        self.heard()
        return True

    def repeats(self, question: Open) -> bool:
        """Whether this request has been granted already."""
        return bool(self.epoch) and question.request == self._request

    def heard(self) -> None:
        """Its holder gave a sign of life."""
        self._heard = self.clock()

    @property
    def idle(self) -> float:
        """How long its holder has not been heard, s."""
        return self.clock() - self._heard

    def release(self) -> None:
        """Nobody holds it any more."""
        self.epoch, self.holder, self._request = 0, "", ""

    def refusal(self) -> Refused:
        """What a second controller is told."""
        return Refused(
            reason=f"the robot is driven by {self.holder}",
            holder=self.holder,
            idle=round(self.idle, 3),
            patience=self.patience,
        )


class Desk(Protocol):
    """The robot's side of a session."""

    def open(self, question: Open) -> Granted | Refused:
        """Somebody wants the robot."""
        ...

    def close(self, question: Close) -> State:
        """Somebody gives the robot back."""
        ...

    def state(self, question: Ask) -> State:
        """Somebody asks how things stand."""
        ...

    def again(self, question: Again) -> State:
        """Somebody wants another attempt; the answer's number says whether it has begun."""
        ...


def respond(desk: Desk, payload: bytes) -> tuple[bytes, bool]:
    """The answer to a question, and whether it made sense."""
    answer: Granted | Refused | State | Unread
    try:
        question = read_question(payload)
    except CodecError:
        return written(Unread()), False
    if question.protocol != PROTOCOL:
        answer = Refused(reason=f"the robot's side speaks protocol version {PROTOCOL}, not {question.protocol}")
    elif isinstance(question, Close):
        answer = desk.close(question)
    elif isinstance(question, Ask):
        answer = desk.state(question)
    elif isinstance(question, Again):
        answer = desk.again(question)
    else:
        answer = desk.open(question)
    return written(answer), True


def _converse(
    bus: Bus, robot: str, question: Open | Close | Ask | Again, timeout: float, clock: Clock
) -> Granted | Refused | State | None:
    """The answer to a question, which is asked until both have come through whole; None where nobody answers."""
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


def _understood(payload: bytes) -> Granted | Refused | State | Unread | None:
    try:
        return read_answer(payload)
    except CodecError:
        return None


def open_session(bus: Bus, robot: str, question: Open, timeout: float, clock: Clock = _MONOTONIC) -> Granted:
    """Take a robot.

    A lease whose holder is dead frees after its patience, which is waited for; a holder that lives is not disturbed.

    Raises:
        LinkError: nobody answers within ``timeout`` seconds, or the robot is refused.
    """
    deadline = clock.now() + timeout
    idle: float | None = None
    while True:
        answer = _converse(bus, robot, question, max(deadline - clock.now(), 0.1), clock)
        if answer is None:
            raise LinkError(f"no robot named {robot!r} answered within {timeout:g} s")
        if isinstance(answer, Granted):
            return answer
        if not isinstance(answer, Refused):
            raise LinkError("the robot's side answered with something else than a lease")
        alive = idle is not None and answer.idle < idle + _PAUSE / 2
        if alive or not answer.holder or clock.now() >= deadline:
            raise LinkError(answer.reason)
        idle = answer.idle
        clock.wait(_PAUSE)


def ask_state(bus: Bus, robot: str, epoch: int, timeout: float, clock: Clock = _MONOTONIC) -> State:
    """How a lease and its episode stand.

    Raises:
        LinkError: nobody answers within ``timeout`` seconds.
    """
    return _state(bus, robot, Ask(epoch=epoch), timeout, clock)


def check_name(bus: Bus, robot: str) -> None:
    """Make sure that nobody else on the network answers for a robot: two of one name would confuse every controller.

    Raises:
        LinkError: somebody does.
    """
    if bus.ask(RobotKeys(robot).session, written(Ask(epoch=0)), _NEIGHBOUR) is not None:
        raise LinkError(f"there is a robot named {robot!r} on this network already: choose another `robot.name`")


def begin_again(bus: Bus, robot: str, question: Again, timeout: float) -> State:
    """Ask for another attempt, which has begun if the answer bears its number.

    Raises:
        LinkError: nobody answers within ``timeout`` seconds.
    """
    return _state(bus, robot, question, timeout, _MONOTONIC)


def _state(bus: Bus, robot: str, question: Ask | Again, timeout: float, clock: Clock) -> State:
    answer = _converse(bus, robot, question, timeout, clock)
    if not isinstance(answer, State):
        raise LinkError(f"{robot!r} no longer answers: it was asked for {timeout:g} s")
    return answer


def close_session(bus: Bus, robot: str, epoch: int, timeout: float, clock: Clock = _MONOTONIC) -> None:
    """Give a robot back; where nobody answers, its side frees the lease by itself."""
    _converse(bus, robot, Close(epoch=epoch), timeout, clock)
