"""A run that is open to the network: its ticks are published, questions answered, operations passed on."""

from __future__ import annotations

import time
from collections.abc import Mapping
from threading import Condition, Thread
from types import TracebackType
from typing import Any

from maze_machine.drive.mission import Ending, Mission
from maze_machine.drive.sights import sights
from maze_machine.drive.tick import Tick, shown_ranges
from maze_machine.remote.messages import encoded, why_json
from maze_machine.remote.operated import OperatedRun
from transport.bus import Bus, Request
from transport.keys import MachineKeys

_RATE = 1 / 30
"""The least interval of published ticks, s: of a faster simulation only some ticks are published."""


class OpenRun:
    """Publishes the ticks of a run, which it watches; use it as a context manager.

    It never delays the loop: a separate thread encodes and sends the newest tick only.

    Args:
        bus: the network.
        mission: the run.
        operated: the operators.
        head: the constant part of the run, as JSON values.
    """

    def __init__(self, bus: Bus, mission: Mission, operated: OperatedRun, head: Mapping[str, Any]) -> None:
        self._machine = mission.machine
        keys = MachineKeys(mission.profile.robot.name)
        model = encoded(head)
        self._newest: Tick | None = None
        self._unsent = False
        self._ended: Ending | None = None
        self._closed = False
        self._change = Condition()
        self._publisher = bus.publisher(keys.step)
        bus.serve(keys.model, lambda request: request.reply(model))
        bus.serve(keys.step, lambda request: request.reply(self._described()))
        bus.serve(keys.why, self._say_why)
        bus.serve(keys.sights, lambda request: request.reply(self._seen()))
        self._operated = operated
        operated.tell(self._again)
        bus.serve(keys.operate, lambda request: request.reply(operated.answer(request.payload)))
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

    def __call__(self, tick: Tick) -> None:
        """Receive a tick; never waits."""
        self._newest = tick
        if not self._unsent:
            with self._change:
                self._unsent = True
                self._change.notify_all()

    def _again(self) -> None:
        """Publish the newest tick once more: the run is paused after it."""
        with self._change:
            self._unsent = True
            self._change.notify_all()

    def end(self, ending: Ending) -> None:
        """Publish how the run ended, with the last tick again; the base has stopped by then."""
        with self._change:
            self._ended, self._unsent = ending, True
            self._change.notify_all()

    def _publish(self) -> None:
        while True:
            with self._change:
                self._change.wait_for(lambda: self._unsent or self._closed)
                tick, self._unsent = self._newest if self._unsent else None, False
                closed = self._closed
            if tick is not None:
                self._publisher.put(self._described())
            if closed:
                return
            time.sleep(_RATE)

    def _described(self) -> bytes:
        """The newest tick, with how the run ended where it has; an empty object before the first."""
        tick = self._newest
        if tick is None:
            return encoded({})
        more: dict[str, Any] = {} if self._ended is None else {"ended": self._ended.as_json()}
        if reason := self._operated.paused:
            more["paused"] = reason
        return encoded({**tick.json, "ranges": shown_ranges(tick.observation.scan), **more})

    def _seen(self) -> bytes:
        """What perception found in the newest tick, and where the robot was; made only where somebody asks."""
        tick = self._newest
        if tick is None or tick.facts is None:
            return encoded({})
        shown = tick.truth or tick.pose
        return encoded({**sights(tick.facts), "at": [shown.x, shown.y, shown.heading]})

    def _say_why(self, request: Request) -> None:
        state = request.payload[:1000].decode(errors="replace")
        request.reply(encoded(why_json(self._machine, self._newest, state)))
