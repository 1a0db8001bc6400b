"""The client: watches a running machine and operates it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from pydantic import ValidationError

from maze_machine.errors import CommandError, ExitStatus
from maze_machine.remote.described import read_machine, read_tick, read_why
from maze_machine.remote.messages import Answer, Operation
from maze_machine.remote.seen import read_sights
from transport.bus import Bus, ask_until
from transport.clock import Clock, MonotonicClock
from transport.keys import MachineKeys

_LOOK = 0.02
"""The interval of checks for a tick, s."""


class NoMachineError(CommandError):
    """No machine drives a robot of that name at this endpoint."""

    status = ExitStatus.UNREACHABLE


class RemoteMachine:
    """A remote machine.

    Args:
        bus: the network.
        robot: the name of the robot that it drives.
        patience: how long to wait for an answer, s.
        clock: what time is measured on.
    """

    def __init__(self, bus: Bus, robot: str, *, patience: float = 3.0, clock: Clock | None = None) -> None:
        self._bus = bus
        self._keys = MachineKeys(robot)
        self._patience = patience
        self._clock = clock or MonotonicClock()

    def model(self) -> dict[str, Any]:
        """The constant part of the run (``MachineJson``).

        Raises:
            NoMachineError: no machine answers.
            ForeignMessageError: the answer is not of the published form.
        """
        return read_machine(self._asked(self._keys.model, b""))

    def present(self) -> None:
        """Make sure that the machine is there.

        Raises:
            NoMachineError: no machine answers.
        """
        self._asked(self._keys.step, b"")

    def why(self, state: str) -> dict[str, Any]:
        """The verdicts about a state's transitions in the newest tick.

        Raises:
            NoMachineError: no machine answers.
            ForeignMessageError: the answer is not of the published form.
        """
        return read_why(self._asked(self._keys.why, state.encode(errors="replace")))

    def sights(self) -> dict[str, Any]:
        """What perception found in the newest tick; empty where the machine does not say, or not validly."""
        answer = self._bus.ask(self._keys.sights, b"", self._patience)
        return {} if answer is None else read_sights(answer)

    def operate(self, operation: Operation) -> Answer:
        """Execute an operation.

        An operation without an answer may have been executed or not; it is not repeated, since an event would count
        twice.

        Raises:
            NoMachineError: no machine answers.
        """
        self.present()  # a program that is not discovered yet receives nothing: this question may be repeated
        answer = self._bus.ask(self._keys.operate, operation.model_dump_json().encode(), self._patience)
        if answer is None:
            raise self._nobody()
        return _read_answer(answer)

    def ask(self, payload: bytes) -> bytes:
        """Forward an operation unchanged; the result says if there is no answer, or none that can be read."""
        answer = self._bus.ask(self._keys.operate, payload, self._patience)
        found = Answer(done=False, reason="the machine does not answer") if answer is None else _read_answer(answer)
        return found.model_dump_json().encode()

    def steps(self, silence: float) -> Iterator[dict[str, Any]]:
        """The ticks of the run, as they are published, until none has come for a while.

        Args:
            silence: for how long, s.
        """
        newest = self.newest_step()
        heard = self._clock.now()
        while self._clock.now() - heard < silence:
            step = newest()
            if step is None:
                self._clock.wait(_LOOK)
                continue
            heard = self._clock.now()
            yield step

    def newest_step(self) -> Callable[[], dict[str, Any] | None]:
        """A function that gives the newest tick, or None where there is none since the last call.

        The first is the one that was there before, which a run that stands still publishes no more. The function raises
        ``ForeignMessageError`` for a message that is not a tick.
        """
        newest = self._bus.newest(self._keys.step)
        answer = ask_until(self._bus, self._keys.step, b"", self._patience, self._clock)
        before = None if answer is None else read_tick(answer)
        last: dict[str, Any] | None = None

        def take() -> dict[str, Any] | None:
            nonlocal before, last
            message = newest.take()
            found, before = (before if message is None else read_tick(message.payload)), None
            if not found or found == last:  # it may come as an answer, and then be published
                return None
            last = found
            return found

        return take

    def _asked(self, key: str, payload: bytes) -> bytes:
        answer = ask_until(self._bus, key, payload, self._patience, self._clock)
        if answer is None:
            raise self._nobody()
        return answer

    def _nobody(self) -> NoMachineError:
        return NoMachineError(
            f"no machine that drives `{self._keys.robot}` answers",
            "start it with `maze-machine run --open ENDPOINT`; over TLS, its access file must allow your certificate",
        )


def _read_answer(answer: bytes) -> Answer:
    try:
        return Answer.model_validate_json(answer)
    except ValidationError:
        return Answer(done=False, reason="the answer cannot be read")
