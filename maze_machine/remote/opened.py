"""The controller's side: publishes what its machine does, answers questions about it, and takes operations."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from threading import Condition, Thread
from types import TracebackType

from hsm.interchange.reports import model_json
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
    Resume,
    SendEvent,
    encoded,
    read_operation,
    why_json,
)
from transport.bus import Bus, Request
from transport.keys import MachineKeys
from transport.wording import printable

BACKLOG = 100
"""This many events may wait for a tick; more are refused."""
_RATE = 1 / 30
"""Between two published ticks, s: nobody sees more of a simulation that runs faster."""


class OpenRun:
    """A run that is open to the network: a watcher of its ticks and its operator in one.

    Nothing here holds up the loop but a pause that an operator asks for: ticks are described and sent from a thread of
    its own, the newest only. Use it as a context manager.

    Args:
        bus: the network.
        mission: the run.
        pausable: whether the robot waits for its controller, so that a run may stand still.
    """

    def __init__(self, bus: Bus, mission: Mission, *, pausable: bool) -> None:
        self._machine = mission.machine
        self._pausable = pausable
        self._keys = MachineKeys(mission.profile.robot.name)
        self._model = encoded(model_json(mission.machine.model, mission.parameters))
        self._newest: Tick | None = None
        self._unsent = False
        self._events: deque[str] = deque()
        self._allowed: int | None = None  # ticks until the run stands still; None: no end
        self._ended = ""
        self._closed = False
        self._change = Condition()
        self._publisher = bus.publisher(self._keys.step)
        bus.serve(self._keys.model, lambda request: request.reply(self._model))
        bus.serve(self._keys.why, self._say_why)
        bus.serve(self._keys.operate, self._operate)
        self._thread = Thread(target=self._publish, name="open run", daemon=True)

    def __enter__(self) -> OpenRun:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        with self._change:
            self._closed = True
            self._change.notify_all()
        self._thread.join()

    # The loop's side.

    @property
    def ended(self) -> str:
        """Why an operator ended the run; empty while nobody has."""
        return self._ended

    def events(self, _index: int, _time: float) -> Sequence[str]:
        """The events that operators have sent since the last tick."""
        found: list[str] = []
        while self._events:
            found.append(self._events.popleft())
        return found

    def __call__(self, tick: Tick) -> None:
        """Take in a tick; where an operator wants a pause, wait for its end."""
        with self._change:
            self._newest, self._unsent = tick, True
            self._change.notify_all()
            if self._allowed is not None:
                self._allowed = max(self._allowed - 1, 0)
                self._change.wait_for(lambda: self._allowed is None or self._allowed > 0 or bool(self._ended))

    # The network's side.

    def _publish(self) -> None:
        while True:
            with self._change:
                self._change.wait_for(lambda: self._unsent or self._closed)
                tick, self._unsent = self._newest if self._unsent else None, False
                closed = self._closed
            if tick is not None:
                self._publisher.put(encoded(tick.json))
            if closed:
                return
            time.sleep(_RATE)

    def _say_why(self, request: Request) -> None:
        state = request.payload[:1000].decode(errors="replace")
        request.reply(encoded(why_json(self._machine, self._newest, state)))

    def _operate(self, request: Request) -> None:
        try:
            answer = self._done(request.payload)
        except (OperationError, UsageError) as error:
            answer = Answer(done=False, reason=printable(str(error))[:1000])
        request.reply(answer.model_dump_json().encode())

    def _done(self, payload: bytes) -> Answer:
        operation = read_operation(payload)
        if not self._pausable and isinstance(operation, Pause | Resume | AdvanceRun):
            return Answer(done=False, reason="only a simulation in the machine's own process can stand still")
        with self._change:
            match operation:
                case SendEvent(name=name):
                    event = checked_event(name, self._machine)
                    if len(self._events) >= BACKLOG:
                        return Answer(done=False, reason=f"{BACKLOG} events wait already")
                    self._events.append(event)
                case Pause():
                    self._allowed = 0
                case Resume():
                    self._allowed = None
                case AdvanceRun(ticks=ticks):
                    self._allowed = ticks
                case EndRun():
                    self._ended = "an operator ended the run"
            self._change.notify_all()
        return Answer(done=True)
