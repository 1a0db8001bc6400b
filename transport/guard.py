"""The guard between a controller and a base on the robot's side: lease, age of answers, limits, command time-out.

It never waits or reads a clock, so that every promise can be tested to the millisecond.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable

from transport.description import RobotDescription
from transport.envelope import CommandTag
from transport.messages import STOP, Twist
from transport.session import Lease, Open
from transport.settings import LinkSettings

_REMEMBERED = 64


class CommandGuard:
    """Decides which commands reach the base.

    The first accepted command of a lease arms the time-out. Once it has stopped the base, nothing moves it until
    a controller has taken the lease again.

    Attributes:
        lease: who may command.
        stopped: the command time-out has stopped the base, and waits for a new lease.
        rejected: how many commands were rejected, by reason.
        stops: how often the command time-out stopped the base.
    """

    def __init__(self, robot: RobotDescription, settings: LinkSettings, clock: Callable[[], float]) -> None:
        self.lease = Lease(settings.patience, clock)
        self.stopped = False
        self.rejected: Counter[str] = Counter()
        self.stops = 0
        self._robot, self._settings, self._clock = robot, settings, clock
        self._shown: deque[tuple[int, float]] = deque(maxlen=_REMEMBERED)
        self._sequence = -1
        self._twist = STOP
        self._accepted: float | None = None

    def grant(self, question: Open) -> bool:
        """Whether a controller may have the robot; if so, the latch of the command time-out is released."""
        if not self.lease.grant(question):
            return False
        self._rest()
        self.stopped = False
        self._sequence = -1
        return True

    def release(self) -> None:
        """The controller gives the robot back: the base stops."""
        self.lease.release()
        self._rest()

    def shown(self, stamp: int) -> None:
        """An observation with this stamp leaves for the controller now."""
        self._shown.append((stamp, self._clock()))

    def accepts(self, tag: CommandTag, twist: Twist) -> bool:
        """Whether a command may reach the base; if so, it counts from now on."""
        reason = self._fault(tag, twist)
        if reason:
            self.rejected[reason] += 1
            return False
        self._sequence = tag.sequence
        self._twist = self._robot.limited(twist)
        self._accepted = self._clock()
        return True

    def twist(self) -> Twist:
        """What the base must do now."""
        if self.due() <= 0:
            self.stopped = True
            self.stops += 1
            self._rest()
        return self._twist

    def due(self) -> float:
        """Time until the command time-out stops the base if nothing is accepted, s; infinite where it is not armed."""
        return math.inf if self._accepted is None else self._accepted + self._settings.dead_man - self._clock()

    def _rest(self) -> None:
        self._twist, self._accepted = STOP, None

    def _fault(self, tag: CommandTag, twist: Twist) -> str:
        """Why a command is rejected, or nothing."""
        if not self.lease.epoch or tag.epoch != self.lease.epoch:
            return "no lease"
        self.lease.heard()
        # A command that came too late to restart the command time-out must not count as timely.
        self.twist()
        if self.stopped:
            return "stopped by the command time-out"
        if tag.sequence <= self._sequence:
            return "repeated"
        if not all(map(math.isfinite, (twist.forward, twist.left, twist.turn))):
            return "not finite"
        age = next((self._clock() - at for stamp, at in reversed(self._shown) if stamp == tag.answers), None)
        if age is None:
            return "answers no observation that was sent"
        if age > self._settings.answer_age:
            return "answers an observation that is too old"
        return ""
