"""The robot's side of a lease in real time: it publishes sensor data and guards the base.

It is in front of a simulator, or, as ``maze-machine gate``, in front of a driver without a command time-out.
"""

from __future__ import annotations

import logging
import math
import secrets
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Protocol

from transport.bus import Bus
from transport.clock import Clock, MonotonicClock, Pace
from transport.description import Laser, RobotDescription
from transport.driver import RosDriver
from transport.envelope import ObservationTag
from transport.guard import CommandGuard
from transport.keys import RobotKeys
from transport.messages import NANOSECONDS, STOP, Command, DoorReply, LinkStatus, Observation, Twist
from transport.senses import Senses
from transport.session import Ask, Close, Granted, Lease, Open, Refused, Retry, SessionState
from transport.settings import LinkSettings
from transport.side import RobotEndpoint, TaggedCommand
from transport.trust import Trust
from transport.wording import printable
from transport.world import MakeWorld, World

_LOG = logging.getLogger(__name__)
_LOOK = 0.005
"""The interval of checks of a driver's sensors, s."""


class GatedBase(Protocol):
    """The base behind a gate."""

    def begin(self, question: Open) -> str:
        """A controller takes the robot; returns why it cannot, or nothing."""
        ...

    def end(self) -> None:
        """The episode is over."""
        ...

    def due(self) -> float:
        """After how many seconds to ask for an observation again."""
        ...

    def sense(self) -> Observation | None:
        """The newest observation, if there is a new one."""
        ...

    def status(self) -> LinkStatus:
        """How old the base's scan and odometry are, and why the newest ones were refused."""
        ...

    def move(self, twist: Twist) -> None:
        """Drive with this velocity until the next command."""
        ...

    def ring(self) -> None:
        """Ring the door bell; the answer comes with an observation."""
        ...

    @property
    def finished(self) -> bool:
        """Whether a referee has ended the episode."""
        ...

    def report(self) -> Mapping[str, object] | None:
        """A referee's verdict so far, or None where there is no referee."""
        ...


class Gate:
    """Lets one controller at a time command a base, as long as its commands are timely and the base's sensors fresh.

    Attributes:
        guard: which commands reach the base.
        trust: whether the base may move by what it senses.
        dropped: how many messages were dropped before they were judged, by reason.
    """

    def __init__(
        self,
        bus: Bus,
        base: GatedBase,
        description: RobotDescription,
        settings: LinkSettings | None = None,
        clock: Clock | None = None,
    ) -> None:
        settings, self._clock = settings or LinkSettings(), clock or MonotonicClock()
        self.guard = CommandGuard(description, settings, self._clock.now)
        self.trust = Trust(settings)
        self._base, self._name, self._period = base, description.name, description.period
        self._granted: Granted | None = None
        self._reports: list[Mapping[str, object]] = []
        self._instance = secrets.randbits(62) + 1
        self._sequence = 0
        self._door: DoorReply | None = None
        self._rings = 0
        self._repeat = Pace(self._period, self._clock)
        self._told = STOP
        self._last: Observation | None = None
        self._side = RobotEndpoint(bus, RobotKeys(description.name, settings), self)
        self.dropped = self._side.dropped

    def episodes(
        self, stop: Callable[[], bool] = lambda: False, *, heartbeat: float = 0.1, forsaken: float = math.inf
    ) -> Iterator[Mapping[str, object]]:
        """Serve; yields the referee's verdict on each finished or abandoned episode.

        However it ends, the base is left stopped.

        Args:
            stop: returns whether to end; called at least every ``heartbeat`` seconds.
            heartbeat: s.
            forsaken: an episode ends when its controller was silent for this long, s; by default only when another one
                requests the robot, so that a delayed controller may come back.
        """
        try:
            order: TaggedCommand | None = None
            while not stop():
                order = self._side.take(min(self.pump(order), heartbeat))
                if order is None and self._granted is not None and self.lease.idle > forsaken:
                    self._give_up()
                while self._reports:
                    yield self._reports.pop(0)
        finally:
            self._base.move(STOP)

    def pump(self, order: TaggedCommand | None = None) -> float:
        """Do everything that is due now, without waiting, beginning with a command that was received already.

        Returns:
            the time until something is due again, s.
        """
        order = order or self._side.take()
        while order is not None:
            tag, twist = order
            if self.guard.accepts(tag, twist) and tag.ring:
                self._base.ring()
            order = self._side.take()
        self._move()
        try:
            if (observation := self._base.sense()) is not None:
                self._show(observation)
        except Exception as error:
            self._fail(error)
        return max(0.0, min(self._base.due(), self._repeat.due(), self.guard.due()))

    @property
    def lease(self) -> Lease:
        """Who may command the base."""
        return self.guard.lease

    def open(self, question: Open) -> Granted | Refused:
        """A controller takes the robot."""
        if self._granted is not None and self.lease.repeats(question):
            return self._granted
        goes_on = self.lease.proves(question.previous)
        if not self.guard.grant(question):
            return self.lease.refusal()
        if not goes_on:
            self._end()
        try:
            reason = self._base.begin(question)
        except Exception:
            self.guard.release()
            raise
        if reason:
            self.guard.release()
            return Refused(reason=reason)
        self.lease.heard()
        self._granted = Granted(
            epoch=self.lease.epoch,
            secret=self.lease.secret,
            robot=self._name,
            mode="realtime",
            period=self._period,
        )
        return self._granted

    def close(self, question: Close) -> SessionState:
        """A controller gives the robot back."""
        if not self.lease.proves(question.secret):
            return SessionState(held=False, reason="another controller took the robot")
        self._give_up()
        return SessionState(held=False, reason="given back")

    def state(self, question: Ask) -> SessionState:
        """A controller asks for the state."""
        if not self.lease.proves(question.secret):
            return SessionState(
                held=False, reason="the robot's side was restarted, or another controller took the robot"
            )
        report = self._base.report()
        parts = {"held": True, "sequence": self._sequence, "report": None if report is None else dict(report)}
        return SessionState.model_validate(parts)

    def again(self, question: Retry) -> SessionState:
        """A controller wants another attempt: where time does not wait, somebody must put the robot back."""
        return self.state(Ask(secret=question.secret))

    def _give_up(self) -> None:
        self.guard.release()
        self._granted = None
        self._move()
        self._end()

    def _fail(self, error: Exception) -> None:
        """The base cannot continue: it is stopped and the lease is over, but questions are still answered."""
        self.dropped["failed step"] += 1
        _LOG.error("the robot failed: %s", printable(f"{type(error).__name__}: {error}"[:500]))
        _LOG.debug("where it failed", exc_info=True)
        self.guard.release()
        self._granted = None
        self._base.end()
        self._move()

    def _end(self) -> None:
        if (report := self._base.report()) is not None:
            self._reports.append(report)
            self._base.end()

    def _move(self) -> None:
        """Send the base its current command: immediately after a change, and again every period in case it was lost."""
        before, blind = self.trust.reason, self.trust.look(self._base.status(), self._clock.now())
        if bool(before) != bool(blind):
            _LOG.warning("%s", f"the base was stopped: {printable(blind)}" if blind else "the base may move again")
        twist = self.guard.twist()
        if blind:
            twist = STOP
        if twist != self._told or self._repeat.due() <= 0:
            self._base.move(twist)
            self._told = twist
            self._repeat = Pace(self._period, self._clock)
            self._repeat.beat()

    def _show(self, observation: Observation) -> None:
        self._sequence += 1
        if observation.door is not None:
            self._door, self._rings = observation.door, self._rings + 1
        tag = ObservationTag(
            self.lease.epoch,
            self._sequence,
            observation.stamp,
            self._instance,
            rejected=self.guard.rejected.total() + self.dropped.total(),
            rings=self._rings,
            finished=self._base.finished,
            stopped=self.guard.stopped,
            door=self._door,
        )
        self.guard.shown(observation.stamp)
        self._side.show(observation, tag, since=self._last)
        self._last = observation


class PacedWorld:
    """A simulated base: its world advances with the wall clock, commanded or not.

    Its stamps keep to that clock as a robot's do: where the simulator was held up, the world has lost time, and the
    stamps continue by it.

    Attributes:
        overruns: how many periods the simulator was too slow for.
    """

    def __init__(self, make_world: MakeWorld, period: float, clock: Clock | None = None) -> None:
        self._make_world, self._period = make_world, round(period * NANOSECONDS)
        self._lost = 0
        self._pace = Pace(period, clock or MonotonicClock())
        self._world: World | None = None
        self._twist, self._ring, self._fresh = STOP, False, False

    @property
    def overruns(self) -> int:
        """How many periods the simulator was too slow for."""
        return self._pace.overruns

    def begin(self, question: Open) -> str:
        """Begin an episode, or continue it if its controller takes the robot again."""
        if question.previous and self._world is None:
            return "the simulator was restarted: its episode is lost"
        if not question.previous:
            self._world, self._fresh, self._lost = self._make_world(question.seed), True, 0
        return ""

    def end(self) -> None:
        """Released the world."""
        self._world = None

    def due(self) -> float:
        """Time until the world moves on, s."""
        return self._pace.due()

    def sense(self) -> Observation | None:
        """The sensor data at the end of a period."""
        if self._world is None or self._pace.due() > 0:
            return None
        missed = self._pace.overruns
        self._pace.beat()
        if self._fresh:
            self._fresh = False
            return self._world.observation
        self._lost += (self._pace.overruns - missed) * self._period
        observation = self._world.step(Command(self._twist, self._ring))
        self._ring = False
        return _later(observation, self._lost)

    def status(self) -> LinkStatus:
        """What the world's one clock says of its sensors."""
        return LinkStatus() if self._world is None else self._world.observation.link

    def move(self, twist: Twist) -> None:
        """Drive so from the next period on."""
        self._twist = twist

    def ring(self) -> None:
        """Ring in the next period."""
        self._ring = True

    @property
    def finished(self) -> bool:
        """Whether the referee has ended the episode."""
        return self._world is not None and self._world.finished

    def report(self) -> Mapping[str, object] | None:
        """The referee's verdict so far."""
        return None if self._world is None else self._world.report()


def _later(observation: Observation, time: int) -> Observation:
    """An observation whose stamps are later by a time in ns."""
    if not time:
        return observation
    scan, odometry = observation.scan, observation.odometry
    return replace(
        observation,
        stamp=observation.stamp + time,
        scan=replace(scan, stamp=scan.stamp + time),
        odometry=replace(odometry, stamp=odometry.stamp + time),
    )


class DriverBase:
    """A base behind a bare ROS 2 driver.

    Args:
        driver: what speaks with it.
        laser: what its scans must be of.
        clock: monotonic time.
    """

    def __init__(self, driver: RosDriver, laser: Laser, clock: Clock | None = None) -> None:
        self._driver, self._clock = driver, clock or MonotonicClock()
        self._senses = Senses(laser)
        self._door: DoorReply | None = None

    finished = False

    def begin(self, question: Open) -> str:
        """A controller takes the robot, once it senses anything."""
        del question
        if self._senses.refused:
            return f"the robot's sensors cannot be trusted: {self._senses.refused}"
        sensing = self._senses.scan is not None and self._senses.odometry is not None
        return "" if sensing else f"the robot's driver sends no scan or no odometry: the gate {self._driver.listens}"

    def end(self) -> None:
        """Hardware continues."""

    def due(self) -> float:
        """When to look again, s."""
        return _LOOK

    def sense(self) -> Observation | None:
        """A new scan makes a new observation, with the newest odometry."""
        before, sensed = self._senses.scan, self._driver.sense()
        self._senses.take(sensed, self._clock.now())
        self._door = sensed.door or self._door
        scan, odometry = self._senses.scan, self._senses.odometry
        if scan is None or odometry is None or scan is before:
            return None
        observation = Observation(max(scan.stamp, odometry.stamp), scan, odometry, self._door)
        self._door = None
        return observation

    def status(self) -> LinkStatus:
        """How old scan and odometry are."""
        if self._senses.scan is None or self._senses.odometry is None:
            return LinkStatus(refused=self._senses.refused)
        return LinkStatus(*self._senses.ages(self._clock.now()), refused=self._senses.refused)

    def move(self, twist: Twist) -> None:
        """Send a velocity to the driver."""
        self._driver.move(twist)

    def ring(self) -> None:
        """Ask for the door."""
        self._driver.ring()

    def report(self) -> Mapping[str, object] | None:
        """Empty: there is no referee."""
        return None
