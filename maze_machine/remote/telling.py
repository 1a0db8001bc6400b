"""What a machine sends to other machines, forwarded to the machine of another robot."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager
from threading import Condition, Thread
from types import TracebackType

from maze_machine.drive.tick import Tick
from maze_machine.errors import CommandError
from maze_machine.remote.client import RemoteMachine
from maze_machine.remote.messages import SendEvent
from transport.bus import Bus
from transport.robot import LinkError

BACKLOG = 1000
"""How many events may wait to be forwarded; more are lost."""
_PATIENCE = 10.0
"""How long the end of a run waits for events that are not forwarded yet, s."""


class EventForwarder:
    """Forwards the events that a machine sends; a watcher of its ticks. Use it as a context manager.

    It never delays the loop: a separate thread connects and sends the events in order. The other machine receives them
    in its next tick; it ignores those that it does not declare.

    Args:
        dial: returns the network, connected while its block runs.
        robot: the robot that the other machine drives.
        losses: receives a sentence if events could not be forwarded.
    """

    def __init__(self, dial: Callable[[], AbstractContextManager[Bus]], robot: str, losses: list[str]) -> None:
        self._dial = dial
        self._robot = robot
        self._losses = losses
        self._events: deque[str] = deque()
        self._lost = 0
        self._reason = ""
        self._closed = False
        self._change = Condition()
        self._thread = Thread(target=self._hand_on, name=f"sending to {robot}", daemon=True)

    def __enter__(self) -> EventForwarder:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        with self._change:
            self._closed = True
            self._change.notify_all()
        self._thread.join(_PATIENCE)
        lost = self._lost + len(self._events)
        if lost:
            reason = self._reason or "it did not answer in time"
            self._losses.append(f"{lost} event{'s' * (lost != 1)} did not reach {self._robot}: {reason}")

    def __call__(self, tick: Tick) -> None:
        """Receive the events of a tick."""
        sent = tick.report.sent
        if not sent:
            return
        with self._change:
            room = max(0, BACKLOG - len(self._events))
            self._events.extend(sent[:room])
            self._lost += len(sent[room:])
            self._change.notify_all()

    def _hand_on(self) -> None:
        try:
            with self._dial() as bus:
                machine = RemoteMachine(bus, self._robot)
                while (event := self._next()) is not None:
                    machine.operate(SendEvent(name=event))
                    self._events.popleft()
        except (CommandError, LinkError) as error:
            self._reason = str(error)

    def _next(self) -> str | None:
        """The next event to forward; it stays queued until it is forwarded. None at the end."""
        with self._change:
            self._change.wait_for(lambda: bool(self._events) or self._closed)
            return self._events[0] if self._events else None
