"""The inputs of one step, as an exploration chooses them and a scenario replays them."""

from __future__ import annotations

from typing import Any

from hsm.model.values import dataclass
from hsm.testing.scenarios.script import SignalKey


@dataclass(frozen=True, slots=True)
class Wait:
    """Time that passes before a step.

    Attributes:
        seconds: how much.
        early: it ends one tick before the next deadline.
    """

    seconds: float = 0.0
    early: bool = False


NO_WAIT = Wait()


@dataclass(frozen=True, slots=True)
class Input:
    """The inputs of one step.

    Attributes:
        wait: how long after the step before.
        reports: outcomes by the full name of the state whose activity it is.
        events: events from outside.
        signals: the signals that were asked for, with their values.
    """

    wait: Wait = NO_WAIT
    reports: tuple[tuple[str, str], ...] = ()
    events: tuple[str, ...] = ()
    signals: tuple[tuple[SignalKey, Any], ...] = ()
