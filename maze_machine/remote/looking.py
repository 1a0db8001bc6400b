"""A machine that runs elsewhere, as one who watches sees it: ticks with what perception found, until it is gone."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from maze_machine.remote.client import NoMachineError, RemoteMachine
from transport.clock import Clock, MonotonicClock

EVERY = 0.5
"""Between two questions for what perception found, s."""
LATER = 10.0
"""The same where the machine has not answered, s."""


def looked_on(machine: RemoteMachine, silence: float, clock: Clock | None = None) -> Iterator[dict[str, Any]]:
    """The ticks of a run with ``sights``, until the machine does not answer any more; a pause is not an end.

    Args:
        machine: the machine.
        silence: after this time without a tick it is asked whether it is there, s.
        clock: what time is measured on.
    """
    clock = clock or MonotonicClock()
    due, shown = clock.now(), None
    seen: dict[str, Any] = {}
    while True:
        for step in machine.steps(silence):
            state = (step.get("tick"), "ended" in step, step.get("paused"))
            if state == shown:
                continue  # the newest tick of a run that stands still
            shown = state
            if clock.now() >= due:
                found = machine.sights()
                seen = found or seen
                due = clock.now() + (EVERY if found else LATER)
            yield {**step, "sights": seen} if seen else step
        try:
            machine.present()
        except NoMachineError:
            return
