"""A run that people and programs operate while it runs: events, pause, steps, speed, the end."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from threading import Condition

from maze_machine.drive.mission import Mission
from maze_machine.drive.operation import checked_event
from maze_machine.drive.tick import Tick
from maze_machine.errors import UsageError
from maze_machine.remote.messages import (
    AdvanceRun,
    Answer,
    EndRun,
    OperationError,
    Pause,
    PauseAt,
    Resume,
    SendEvent,
    SetParameter,
    SetSpeed,
    read_operation,
)
from maze_machine.remote.stopping import Reached, stopping_point
from transport.wording import printable

KEEP = 0.5
"""How often a paused run sends a sign of life to the robot, s."""
BACKLOG = 100
"""How many events may wait for a tick; more are refused."""


class OperatedRun:
    """The operator of a run and a watcher of its ticks in one; any number of networks and pages can use it.

    If the robot waits for its controller, as in a simulation, the run may pause, advance tick by tick and keep a
    pace; a real robot's run can only be sent events and be ended.

    Args:
        mission: the run.
        pausable: whether the robot waits for its controller; ``drives`` sets it if it is known only later.
        speed: the pace of a simulation as a multiple of real time; None to run as fast as it can.
    """

    def __init__(self, mission: Mission, *, pausable: bool, speed: float | None = None) -> None:
        self.pausable = pausable
        self._mission, self._machine = mission, mission.machine
        self._period = mission.profile.robot.period
        self._speed = speed
        self._due = 0.0
        self._events: deque[str] = deque()
        self._allowed: int | None = None  # ticks until the run pauses; None: no limit
        self._place: tuple[str, Reached] | None = None  # where it pauses by itself
        self._reached, self._stands = "", False
        self._stood: Callable[[], object] = lambda: None
        self._ended = ""
        self._change = Condition()
        self._keep: Callable[[], object] = lambda: None

    # The loop's side.

    def drives(self, *, waits: bool, keep: Callable[[], object]) -> None:
        """Register the robot: whether it waits for its controller, and how to keep it while the run is paused."""
        self.pausable, self._keep = waits, keep

    @property
    def ended(self) -> str:
        """Why an operator ended the run; empty if none has."""
        return self._ended

    def events(self, _index: int, _time: float) -> Sequence[str]:
        """The events that operators have sent since the last tick."""
        found: list[str] = []
        while self._events:
            found.append(self._events.popleft())
        return found

    @property
    def paused(self) -> str:
        """Why the run is paused; empty while it runs."""
        return (self._reached or "an operator has paused it") if self._allowed == 0 else ""

    def tell(self, stood: Callable[[], object]) -> None:
        """Call a function whenever the run pauses; it must not wait."""
        self._stood = stood

    def __call__(self, tick: Tick) -> None:
        """Receive a tick: keep the speed, and wait while the run is paused."""
        place = self._place
        if place is not None and place[1](tick):
            self._allowed, self._reached = 0, place[0]
        if self._speed is None and self._allowed is None:
            return
        with self._change:
            if self._allowed is not None:
                self._allowed = max(self._allowed - 1, 0)
                self._stands = self._allowed == 0
                if self._stands:
                    self._stood()
                while self._allowed == 0 and not self._ended:
                    if not self._change.wait_for(lambda: self._allowed != 0 or bool(self._ended), KEEP):
                        self._keep()
                self._stands = False
            while not self._ended and self._speed is not None and (left := self._due - time.monotonic()) > 0:
                if not self._change.wait(min(left, KEEP)) and left > KEEP:
                    self._keep()
            if self._speed is not None:
                self._due = max(self._due, time.monotonic() - self._period) + self._period / self._speed

    # The operators' side.

    def answer(self, payload: bytes) -> bytes:
        """Execute a question, and return the answer; both are JSON (``docs/reference/link.md``)."""
        try:
            answer = self._done(payload)
        except (OperationError, UsageError) as error:
            answer = Answer(done=False, reason=printable(str(error))[:1000])
        return answer.model_dump_json().encode()

    def _done(self, payload: bytes) -> Answer:
        operation = read_operation(payload)
        place = _place(operation.at, self._mission) if isinstance(operation, PauseAt) else None
        if not self.pausable and isinstance(operation, Pause | Resume | AdvanceRun | SetSpeed | PauseAt):
            return Answer(done=False, reason="only a simulation that waits for its controller can do that")
        with self._change:
            match operation:
                case SendEvent(name=text) | SetParameter(text=text):
                    event = checked_event(text, self._machine)
                    if len(self._events) >= BACKLOG:
                        return Answer(done=False, reason=f"{BACKLOG} events wait already")
                    self._events.append(event)
                case Pause():
                    self._allowed, self._reached = 0, ""
                case Resume():
                    self._allowed, self._reached = None, ""
                case AdvanceRun(ticks=ticks):
                    # A tick that is still on its way to the pause is not one of them.
                    coming = self._allowed == 0 and not self._stands
                    self._allowed, self._reached = (self._allowed or 0) + ticks + coming, ""
                case PauseAt():
                    self._place = place
                case SetSpeed(factor=factor):
                    self._speed, self._due = factor, 0.0
                case EndRun():
                    self._ended = "an operator ended the run"
            self._change.notify_all()
        return Answer(done=True)


def _place(text: str, mission: Mission) -> tuple[str, Reached] | None:
    """A place to pause at, with its text; None for none.

    Raises:
        UsageError: it cannot be read.
    """
    return (text, stopping_point(text, mission)) if text.strip() else None
