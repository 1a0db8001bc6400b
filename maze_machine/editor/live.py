"""A remote run, relayed to the editor: its active states, whenever they change."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from threading import Event, Thread
from typing import Any

from maze_machine.errors import explain
from maze_machine.remote.client import RemoteMachine

Connect = Callable[[str, str], AbstractContextManager[RemoteMachine]]
"""Reaches the machine that runs at an endpoint and drives a robot."""
_SILENCE = 0.5
"""How long to wait for a tick before checking whether the watch is still wanted, s."""


class LiveRun:
    """One watched run, in its own thread, until it ends or the watch is cancelled.

    Args:
        connect: how to reach it.
        notify: receives news: ``{"machine", "states", "taken", "time"}`` when it changes, ``{"ended"}`` with the
            reason at the end.
    """

    def __init__(self, connect: Connect, notify: Callable[[Mapping[str, Any]], object]) -> None:
        self._connect = connect
        self._notify = notify
        self._unwanted = Event()
        self._thread: Thread | None = None

    def start(self, endpoint: str, robot: str) -> None:
        """Begin to watch the machine at an endpoint, instead of an earlier one."""
        self.stop()
        self._unwanted = Event()
        arguments = (endpoint, robot, self._unwanted)
        self._thread = Thread(target=self._watch, args=arguments, name="live run", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Watch no more."""
        self._unwanted.set()
        if self._thread is not None:
            self._thread.join(2 * _SILENCE)  # a program that is still connecting notices it later
            self._thread = None

    def _watch(self, endpoint: str, robot: str, unwanted: Event) -> None:
        try:
            with self._connect(endpoint, robot) as machine:
                name = machine.model()["machine"]
                ended = self._relay(str(name), machine, unwanted)
        except Exception as error:
            known = explain(error)
            if known is None:
                raise
            ended = known[1]
        self._notify({"ended": ended})

    def _relay(self, name: str, machine: RemoteMachine, unwanted: Event) -> str:
        shown: tuple[Any, ...] | None = None
        for step in _steps(machine, unwanted):
            states = tuple(step.get("states", ()))
            if states != shown or step.get("taken"):
                shown = states
                taken = list(step.get("taken", ()))
                time = step.get("stamp", 0) / 1e9
                self._notify({"machine": name, "states": list(states), "taken": taken, "time": time})
            if step.get("outcome"):
                return f"the machine ended in {step['outcome']}"
        return "no longer watched"


def _steps(machine: RemoteMachine, unwanted: Event) -> Iterator[Mapping[str, Any]]:
    """The ticks of a run, until the watch is cancelled.

    Raises:
        NoMachineError: the run has ended, or cannot be reached any more.
    """
    while not unwanted.is_set():
        heard = False
        for step in machine.steps(_SILENCE):
            heard = True
            yield step
            if unwanted.is_set():
                return
        if not heard:
            machine.present()  # a paused run sends no ticks but answers; one that has ended does not answer
