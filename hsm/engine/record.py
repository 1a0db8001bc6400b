"""The record of a step: its selections, the values behind them, and its effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any, NamedTuple

from hsm.engine.configuration import Configuration, Leaf, Plan, Selector
from hsm.engine.looks import Found
from hsm.model.events import Event


class Phase(Enum):
    """The triggers that are not events."""

    START = "start"
    ALWAYS = "always"
    AFTER = "after"
    WHEN = "when"

    def __str__(self) -> str:
        return self.value


NOTHING_DUE: frozenset[int] = frozenset()


class Selection(NamedTuple):
    """The selection of transitions for one trigger.

    Attributes:
        trigger: what was searched for.
        configuration: the states that were active.
        values: the variables.
        due: the time-outs that were due.
        plan: what was done; None where no transition was enabled.
    """

    trigger: Phase | Event
    configuration: Configuration
    values: Sequence[Any]
    due: frozenset[int]
    plan: Plan | None

    @property
    def selector(self) -> Selector | None:
        """The transitions to choose from."""
        match self.trigger:
            case Phase.START:
                return None
            case Phase.ALWAYS:
                return self.configuration.always
            case Phase.AFTER:
                return self.configuration.after
            case Phase.WHEN:
                return self.configuration.when
            case event:
                return self.configuration.on(event)


class StepRecord(NamedTuple):
    """What a step records.

    Attributes:
        time: logical time in seconds.
        selections: in order.
        memo: the signals evaluated.
        values: the variables at the last selection for conditions, which took nothing and is not among the selections;
            None where there was no such selection.
        timers: the deadlines of time-outs afterwards, in nanoseconds.
        after: the configuration afterwards.
    """

    time: float
    selections: Sequence[Selection]
    memo: Mapping[Any, Any]
    values: Sequence[Any] | None
    timers: Mapping[int, int]
    after: Configuration


RawRecord = StepRecord | tuple[float, Found, Sequence[Any], Mapping[int, int]]
"""The same of a step that only moved: the time, what was found, the variables and the deadlines."""


def record_of(raw: RawRecord) -> StepRecord:
    """The record of a step, computed."""
    if isinstance(raw, StepRecord):
        return raw
    time, found, values, timers = raw
    leaf: Leaf = found[0]
    selections = [
        Selection(Phase.WHEN if one.event is None else one.event, one.configuration, values, NOTHING_DUE, one.plan)
        for one in leaf.looked
    ]
    return StepRecord(time, selections, leaf.memo(found, values), values, timers, leaf.after)


def took_something(raw: RawRecord) -> bool:
    """Whether a step carried out a plan; of a step that only moved, the record need not be computed for that."""
    looked = raw.selections if isinstance(raw, StepRecord) else raw[1][0].looked
    return any(one.plan is not None for one in looked)
