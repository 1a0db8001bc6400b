"""Properties that must hold for every run of a machine: stated in its file, monitored at run time, checked before.

Conditions are evaluated after each step, with the signals of that step.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from hsm.model.diagnostics import Place
from hsm.model.expressions import Expression
from hsm.model.values import dataclass


@dataclass(frozen=True, slots=True)
class Never:
    """``never CONDITION``."""

    condition: Expression


@dataclass(frozen=True, slots=True)
class AlwaysHolds:
    """``always CONDITION``: an invariant."""

    condition: Expression


@dataclass(frozen=True, slots=True)
class Recurrence:
    """``always eventually CONDITION within DURATION``: never longer than this without the condition, in seconds."""

    condition: Expression
    within: float


@dataclass(frozen=True, slots=True)
class Response:
    """``after CONDITION, CONDITION within DURATION``: the first is followed by the second in this many seconds."""

    trigger: Expression
    response: Expression
    within: float


@dataclass(frozen=True, slots=True)
class Precedence:
    """``after CONDITION, FIRST before THEN``: from there on, ``then`` does not hold until ``first`` has held."""

    trigger: Expression
    first: Expression
    then: Expression


LONGEST_TICK = 0.1
"""Seconds that proofs assume to pass between two steps at most, unless they are asked to assume something else."""


@dataclass(frozen=True, slots=True)
class Paced:
    """Each step comes at most this many seconds after the last: the assumption of every proof about a run."""

    within: float


def paced(assumptions: Iterable[Property]) -> float | None:
    """The longest time between two steps that some assumptions about the whole run state, s; None where none does."""
    stated = (one.claim.within for one in assumptions if isinstance(one.claim, Paced) and one.scope is None)
    return min(stated, default=None)


Claim = Never | AlwaysHolds | Recurrence | Response | Precedence | Paced


@dataclass(frozen=True, slots=True)
class Property:
    """A claim with its name.

    Attributes:
        name: unique in the machine; that of an instance's machine carries the instance's name (``open_door.patient``).
        claim: what must hold.
        text: the claim as it is written.
        place: where.
        scope: the instance that it is about, by its state's full name: it is checked while that state is active, and
            starts again at each entry; None if it is about the whole run.
    """

    name: str
    claim: Claim
    text: str
    place: Place | None = None
    scope: str | None = None


def conditions_of(claim: Claim) -> tuple[Expression, ...]:
    """All conditions of a claim."""
    match claim:
        case Response(trigger, response):
            return trigger, response
        case Precedence(trigger, first, then):
            return trigger, first, then
        case Paced():
            return ()
        case _:
            return (claim.condition,)


def with_conditions(claim: Claim, change: Callable[[Expression], Expression]) -> Claim:
    """The same claim about other conditions."""
    match claim:
        case Response(trigger, response):
            return replace(claim, trigger=change(trigger), response=change(response))
        case Precedence(trigger, first, then):
            return replace(claim, trigger=change(trigger), first=change(first), then=change(then))
        case Paced():
            return claim
        case _:
            return replace(claim, condition=change(claim.condition))
