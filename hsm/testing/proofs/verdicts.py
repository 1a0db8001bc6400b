"""The verdict about a property, and its assumptions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from enum import Enum
from typing import Any

from hsm.engine.inputs import follow
from hsm.model.chart import Model
from hsm.model.expressions import VariableValue
from hsm.model.properties import LONGEST_TICK, paced
from hsm.model.rewriting import parts_of
from hsm.model.unparse import shown_text
from hsm.model.values import dataclass
from hsm.testing.proofs.graph import FREE
from hsm.testing.proofs.microsteps import counters
from hsm.testing.scenarios.scenarios import Scenario

NO_FAULT = "no step fails"
"""Checked of every machine: no guard fails, no endless sequence of transitions."""


class Status(Enum):
    """The verdict about a property."""

    PROVED = "proved"
    BOUNDED = "no violation"
    VIOLATED = "violated"
    UNDECIDED = "not decided"


class Method(Enum):
    """How a property was proved."""

    REACHABILITY = "all reachable states"
    ZONES = "all reachable states with their times"


@dataclass(frozen=True, slots=True)
class Assumptions:
    """The assumptions of a proof.

    Attributes:
        longest_tick: the longest time between two steps, in seconds, if the machine states no shorter one; None for
            what the machine states, or else ``LONGEST_TICK``.
        parameters: values of parameters by name, in SI units; the others have their defaults.
        free: parameters that may have any value except NaN; those without a default and a value are always free.
        not_a_number: whether signals may be NaN.
    """

    longest_tick: float | None = None
    parameters: Mapping[str, Any] = field(default_factory=dict)
    free: frozenset[str] = frozenset()
    not_a_number: bool = True

    def pace(self, model: Model) -> float:
        """The longest time between two steps of a machine, in seconds."""
        known = [one for one in (self.longest_tick, paced(model.assumptions)) if one is not None]
        return min(known, default=LONGEST_TICK)

    def values(self, model: Model) -> dict[str, Any]:
        """The value of each parameter of a machine, in order; ``FREE`` for a parameter that may have any value.

        A parameter that depends on a free one is free.
        """
        found: dict[str, Any] = {}
        for one in model.parameters:
            made_of = None if one.name in self.parameters else model.derived.get(one.name)
            names = (
                [] if made_of is None else [part.name for part in parts_of(made_of) if isinstance(part, VariableValue)]
            )
            known = not one.required or one.name in self.parameters
            if one.name in self.free or not known or any(found[name] is FREE for name in names):
                found[one.name] = FREE
            elif made_of is not None:
                found[one.name] = follow(made_of, one, found)
            else:
                found[one.name] = self.parameters.get(one.name, one.default)
        return found

    def lines(self, model: Model) -> list[str]:
        """All assumptions about a machine, as text."""
        types = {one.name: one.type for one in model.parameters}
        given = ", ".join(
            f"any {name}" if value is FREE else f"{name} = {shown_text(value, types[name])}"
            for name, value in self.values(model).items()
        )
        names = ", ".join(one.parameter for one in model.adjustable)
        counting = sorted(counters(model))
        counted = [f"fewer than 2^32 changes of {', '.join(counting)}: no overflow"] if counting else []
        told = ["what one member sends to another comes from it alone"] if model.members else []
        deferring = ["no more than 1000 events are deferred at once"] if model.defers_events() else []
        return [
            f"a step comes at any time, at most {self.pace(model):g} s after the last; the first with the start",
            "each step: any signals, any outcomes of running activities, any sequence of events, including raised ones",
            f"signals may {'' if self.not_a_number else 'not '}be NaN; arithmetic on floats, as in the engine",
            "no signal or action fails, nor does an argument of one; an activity may fail if the machine handles it, "
            "but not while it is stopped",
            f"parameters: {given}" if given else "no parameters",
            "a run from its start, neither restored nor reloaded; stamps below 2^32 s",
            *([f"nobody adjusts {names} during the run"] if names else []),
            *(f"{one.name}: {one.text}" for one in model.assumptions),
            *counted,
            *told,
            *deferring,
        ]


@dataclass(frozen=True, slots=True)
class PropertyVerdict:
    """The verdict about one property.

    Attributes:
        name: the property's name, or ``NO_FAULT``.
        text: the property.
        status: the verdict.
        method: how it was proved; None if it was not.
        reason: what prevents a decision, or what a proof excludes; otherwise empty.
        counterexample: a shortest run to a violation, which was replayed on the engine; None if there is none.
        depth: no run of this many steps violates it.
        states: the number of states between two steps that were examined; with times, states that no property can
            distinguish count once.
    """

    name: str
    text: str
    status: Status
    method: Method | None = None
    reason: str = ""
    counterexample: Scenario | None = None
    depth: int = 0
    states: int = 0

    @property
    def proved(self) -> bool:
        """Whether the property holds in every run, under the assumptions."""
        return self.status is Status.PROVED

    @property
    def violated(self) -> bool:
        """Whether a run that violates it was found."""
        return self.status is Status.VIOLATED

    def meets(self, required: Status | None) -> bool:
        """Whether a caller may rely on it.

        Args:
            required: ``PROVED``, ``BOUNDED`` (proved, or no violation to the given depth), or None for anything that is
                not violated.
        """
        if self.violated:
            return False
        return required is None or self.proved or (required is Status.BOUNDED and self.status is Status.BOUNDED)

    def __str__(self) -> str:
        match self.status:
            case Status.PROVED:
                how = f" ({self.method.value}: {self.states})" if self.method is not None else ""
                return f"{self.name}: proved{how}{f'; {self.reason}' if self.reason else ''}"
            case Status.VIOLATED:
                return f"{self.name}: VIOLATED: {self.text}"
            case Status.BOUNDED:
                return f"{self.name}: no violation to depth {self.depth} ({self.reason})"
            case Status.UNDECIDED:
                known = f" (no violation to depth {self.depth})" if self.depth else ""
                return f"{self.name}: not decided: {self.reason}{known}"
