"""Lockstep over a network: the simulator's stamp is the clock, and each command advances the world by one period.

``step{epoch, k, command}`` is answered by ``observation{epoch, k + 1}``. The simulator executes each k once, answers a
repeated one with the same observation and drops the rest; the controller repeats its question if there is no answer.
"""

from __future__ import annotations

import logging
import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TypeVar

from transport.bus import Bus, Mailbox, Message
from transport.codec import CodecError, decode_odometry, decode_scan, encode_twist
from transport.envelope import CommandTag, ObservationTag, is_tagged, is_whole, same_observation
from transport.keys import RobotKeys
from transport.messages import STOP, Command, Observation, Odometry, Scan, Twist
from transport.robot import LinkError
from transport.sanity import observed
from transport.session import (
    Ask,
    Close,
    Granted,
    Lease,
    Open,
    Refused,
    Retry,
    SessionState,
    ask_state,
    begin_again,
    close_session,
)
from transport.side import RobotEndpoint
from transport.wording import printable
from transport.world import MakeWorld, Repeatable, World

T = TypeVar("T")

PATIENCE = 2.0
"""After how long without a word from its holder a lease is free, s."""

_LOG = logging.getLogger(__name__)
_NOT_HELD = "the simulator was restarted, or another controller took the robot"
# A step is sent again after four times as long as answers usually take, then after twice as long each time, within
# these limits, s; where it takes more than the doubtful time, the simulator is asked whether it knows the lease.
_SHORTEST_RESEND, _DOUBTFUL, _LONGEST_RESEND = 0.02, 0.1, 1.0
_QUESTION = 0.3
"""How long the simulator has for the answer to a question between two steps, s."""
_STUBBORN = 6.0
"""After how many limits a simulator that answers questions and makes no step is given up."""


class LockstepServer:
    """Serves a world to one controller at a time.

    Attributes:
        lease: who drives now.
        dropped: how many messages were dropped, by reason.
    """

    def __init__(
        self, bus: Bus, robot: str, period: float, make_world: MakeWorld, *, patience: float = PATIENCE
    ) -> None:
        self._reports: list[Mapping[str, object]] = []
        self._robot, self._period, self._make_world = robot, period, make_world
        self.lease = Lease(patience)
        self._world: World | None = None
        self._granted: Granted | None = None
        self._sequence, self._attempt = 0, 1
        self._failure = ""
        self._side = RobotEndpoint(bus, RobotKeys(robot), self)
        self.dropped = self._side.dropped

    def episodes(
        self, stop: Callable[[], bool] = lambda: False, *, heartbeat: float = 0.1, forsaken: float = math.inf
    ) -> Iterator[Mapping[str, object]]:
        """Answer controllers; yields the referee's verdict on each finished or abandoned episode.

        Args:
            stop: returns whether to end; called at least every ``heartbeat`` seconds.
            heartbeat: s.
            forsaken: an episode ends when its controller was silent for this long, s; by default only when another one
                requests the robot, so that a delayed controller may come back.
        """
        while not stop():
            if (order := self._side.take(heartbeat)) is not None:
                self._obey(*order)
            elif self._world is not None and self.lease.idle > forsaken:
                self.lease.release()
                self._end()
            while self._reports:
                yield self._reports.pop(0)

    def open(self, question: Open) -> Granted | Refused:
        """Begin an episode for a controller."""
        if self._granted is not None and self.lease.repeats(question):
            return self._granted
        if not self.lease.grant(question):
            return self.lease.refusal()
        self._end()
        self._failure = ""
        try:
            self._world = self._make_world(question.seed)
        except Exception:
            self.lease.release()
            raise
        self._granted = Granted(
            epoch=self.lease.epoch,
            secret=self.lease.secret,
            robot=self._robot,
            mode="lockstep",
            period=self._period,
        )
        self._sequence, self._attempt = 0, 1
        self.lease.heard()
        self._show(self._world)
        return self._granted

    def close(self, question: Close) -> SessionState:
        """End the episode of a controller."""
        if not self.lease.proves(question.secret):
            return self._not_held()
        self.lease.release()
        self._end()
        return SessionState(held=False, reason="given back")

    def state(self, question: Ask) -> SessionState:
        """The state of a controller's episode."""
        if not self.lease.proves(question.secret) or self._world is None:
            return self._not_held()
        self.lease.heard()
        attempts = self._world.attempts() if isinstance(self._world, Repeatable) else []
        parts = {"sequence": self._sequence, "report": dict(self._world.report()), "attempt": self._attempt}
        return SessionState.model_validate({"held": True, **parts, "attempts": [dict(verdict) for verdict in attempts]})

    def again(self, question: Retry) -> SessionState:
        """Begin another attempt in the episode of a controller, if its world allows one."""
        held = self._world is not None and self.lease.proves(question.secret)
        if held and question.attempt == self._attempt + 1 and self._begin_again():
            self._attempt += 1
        return self.state(Ask(secret=question.secret))

    def _begin_again(self) -> bool:
        if not isinstance(self._world, Repeatable) or not self._world.try_again():
            return False
        self._sequence += 1
        self._show(self._world)
        return True

    def _not_held(self) -> SessionState:
        return SessionState(held=False, reason=self._failure or _NOT_HELD)

    def _end(self) -> None:
        world, self._world, self._granted = self._world, None, None
        self._side.forget()
        if world is not None:
            self._reports.append(world.report())

    def _fail(self, error: Exception) -> None:
        """The world cannot continue: the episode is over, and the next controller begins another."""
        self.dropped["failed step"] += 1
        self._failure = printable(f"the simulation failed: {type(error).__name__}: {error}"[:500])
        _LOG.error("%s", self._failure)
        _LOG.debug("where it failed", exc_info=True)
        self.lease.release()
        self._world, self._granted = None, None
        self._side.forget()

    def _obey(self, tag: CommandTag, twist: Twist) -> None:
        if self._world is None or tag.epoch != self.lease.epoch:
            self.dropped["foreign"] += 1
            return
        self.lease.heard()
        if tag.again or tag.sequence == self._sequence - 1:
            self._side.repeat()
        elif not all(map(math.isfinite, (twist.forward, twist.left, twist.turn))):
            self.dropped["not finite"] += 1
        elif tag.sequence == self._sequence:
            self._sequence += 1
            try:
                self._world.step(Command(twist, tag.ring, tag.answers))
                self._show(self._world)
            except Exception as error:
                self._fail(error)
        else:
            self.dropped["out of order"] += 1

    def _show(self, world: World) -> None:
        observation = world.observation
        tag = ObservationTag(
            self.lease.epoch,
            self._sequence,
            observation.stamp,
            rejected=self.dropped.total(),
            finished=world.finished,
            door=observation.door,
        )
        self._side.show(observation, tag)


class RemoteLockstep:
    """The robot of a world behind a network, which moves on with each command.

    Attributes:
        dropped: how many messages were dropped, by reason.
        resent: how often a step was asked for again.
    """

    def __init__(self, bus: Bus, granted: Granted, *, limit: float = 10.0) -> None:
        self.dropped: Counter[str] = Counter()
        self.resent = 0
        self._bus, self._robot, self._limit = bus, granted.robot, limit
        self._epoch, self._secret = granted.epoch, granted.secret
        self._sequence, self._attempt = 0, 1
        self._usual = _DOUBTFUL / 4
        self._finished = False
        self._observation: Observation | None = None
        self._last: tuple[bytes, ObservationTag] | None = None
        self._scan: tuple[ObservationTag, Scan] | None = None
        self._odometry: tuple[ObservationTag, Odometry] | None = None
        # Scan and odometry wake a waiting thread only together: a thread that wakes for half an answer costs as much.
        self._inbox: Mailbox[tuple[ObservationTag, Scan, Odometry]] = Mailbox()
        keys = RobotKeys(granted.robot)
        self._publisher = bus.publisher(keys.command, urgent=True)
        bus.subscribe(keys.odometry, self._take_odometry)
        bus.subscribe(keys.scan, self._take_scan)
        self._step = self._say_again()
        self._publisher.put(*self._step)
        self._closed = False

    @property
    def finished(self) -> bool:
        """Whether the referee has ended the episode."""
        self.observe()
        return self._finished

    def report(self) -> Mapping[str, object]:
        """The referee's verdict so far.

        Raises:
            LinkError: the simulator no longer answers, or holds no such episode any more.
        """
        self.observe()
        return self._held(ask_state(self._bus, self._robot, self._secret, self._limit)).report or {}

    def attempts(self) -> Sequence[Mapping[str, object]]:
        """The referee's verdict on each attempt so far.

        Raises:
            LinkError: as :meth:`report`.
        """
        return self._held(ask_state(self._bus, self._robot, self._secret, self._limit)).attempts

    def try_again(self) -> bool:
        """Put the robot back to the start, if the simulator allows another attempt; return whether it does.

        Raises:
            LinkError: as :meth:`report`.
        """
        self.observe()
        question = Retry(secret=self._secret, attempt=self._attempt + 1)
        state = self._held(begin_again(self._bus, self._robot, question, self._limit))
        if state.attempt == self._attempt:
            return False
        self._attempt, self._sequence, self._observation = state.attempt, state.sequence, None
        self._step = self._say_again()
        return True

    def observe(self) -> Observation:
        """The observation after the last command.

        Raises:
            LinkError: the simulator no longer answers, or holds no such episode any more.
        """
        if self._observation is None:
            self._observation = self._receive()
        return self._observation

    def command(self, command: Command) -> None:
        """Advance the world by one period."""
        self.observe()
        payload = encode_twist(command.twist)
        tag = CommandTag(self._epoch, self._sequence, command.answers, command.ring)
        self._step = payload, tag.encode(payload, self._secret)
        self._sequence += 1
        self._observation = None
        self._publisher.put(*self._step)

    def close(self) -> None:
        """Release the episode; the world is paused from now on."""
        if not self._closed:
            self._closed = True
            try:
                close_session(self._bus, self._robot, self._secret, 1.0)
            except LinkError:
                pass
            finally:
                self._bus.close()

    def _say_again(self) -> tuple[bytes, bytes]:
        nothing = encode_twist(STOP)
        return nothing, CommandTag(self._epoch, 0, 0, again=True).encode(nothing, self._secret)

    # The two are read where they come in, in the network's thread: one while the other is still on its way.

    def _take_odometry(self, message: Message) -> None:
        self._odometry = self._read(message, decode_odometry)
        self._pair()

    def _take_scan(self, message: Message) -> None:
        self._scan = self._read(message, decode_scan)
        self._pair()

    def _read(self, message: Message, decode: Callable[[bytes], T]) -> tuple[ObservationTag, T] | None:
        if not is_tagged(message.attachment):
            self.dropped["foreign"] += 1
            return None
        try:
            tag = self._tag(message)
            value = decode(message.payload)
        except CodecError:
            self.dropped["malformed"] += 1
            return None
        if tag.epoch != self._epoch:
            self.dropped["foreign"] += 1
            return None
        return tag, value

    def _tag(self, message: Message) -> ObservationTag:
        """The attachment of a message; the parts of one observation share it, so it is decoded once."""
        if self._last and same_observation(self._last[0], message.attachment) and is_whole(*message):
            return self._last[1]
        tag = ObservationTag.decode(message.attachment, message.payload)
        self._last = message.attachment, tag
        return tag

    def _pair(self) -> None:
        if self._scan and self._odometry and self._scan[0] == self._odometry[0]:
            self._inbox.put((*self._scan, self._odometry[1]))

    def _receive(self) -> Observation:
        """Wait for the answer to the last step, and ask for it again.

        The limit counts how long this process waited without a sign of the simulator. What passes while the process
        itself does not run (on a loaded or suspended computer) is nobody's silence: the answer may be there already.
        """
        resent = self.resent
        pause = left = min(max(4 * self._usual, _SHORTEST_RESEND), _LONGEST_RESEND)
        waited = silent = 0.0
        while silent < self._limit and waited < _STUBBORN * self._limit:
            asked, since = min(left, self._limit - silent), time.monotonic()
            answer = self._inbox.take(asked)
            spent = asked if answer is None else min(time.monotonic() - since, asked)
            waited, silent, left = waited + spent, silent + spent, left - spent
            if answer is None:
                if pause >= _DOUBTFUL:
                    silent = 0.0 if self._knows_lease() else silent + _QUESTION
                self._publisher.put(*self._step)
                self.resent += 1
                pause = left = min(2 * pause, _LONGEST_RESEND)
                continue
            tag, scan, odometry = answer
            if tag.sequence == self._sequence:
                if self.resent == resent:
                    self._usual += (waited - self._usual) / 8
                self._finished = tag.finished
                return observed(tag.stamp, scan, odometry, tag.door)
            self.dropped["repeated"] += 1
        if silent < self._limit:
            raise LinkError(f"the simulator of {self._robot!r} answers, but made no step for {waited:.3g} s")
        raise LinkError(f"the simulator of {self._robot!r} has not answered for {self._limit:g} s")

    def _knows_lease(self) -> bool:
        """Whether the simulator answers a question: a slow one does, one that has gone or was restarted does not."""
        try:
            state = ask_state(self._bus, self._robot, self._secret, _QUESTION)
        except LinkError:
            return False
        self._held(state)
        return True

    def _held(self, state: SessionState) -> SessionState:
        if not state.held:
            raise LinkError(f"the simulator of {self._robot!r} ended the episode: {state.reason}")
        return state
