"""Coupled parallel regions, a few at a time, while the others may do anything that those few can notice.

Regions that read, ask or send events to one another have as many states together as the product of their own. A
property often needs only the region that it names. So the others are left in their initial states, and what they
could do to the rest is free instead: each ``in(...)`` of them has any value whenever it is asked, each variable that
they set, too, and the events that they raise may come at any moment of a step. That only adds runs, so what is proved
holds for the machine. What is not proved is tried with the neighbours of those regions, and then with all.

Source: Kurshan, "Computer-aided verification of coordinating processes" (1994), localization reduction.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from typing import Any

from hsm.model.chart import Action, Assign, Cancel, Emit, Model, Raise, Send
from hsm.model.expressions import Active, Expression, SignalValue, VariableValue
from hsm.model.properties import Property, conditions_of
from hsm.model.registry import SignalDeclaration
from hsm.model.rewriting import Rewriter, actions_of, parts_of
from hsm.model.types import BOOLEAN, Boolean, Enumeration, Type
from hsm.testing.proofs.microsteps import counters
from hsm.testing.proofs.points import Loose
from hsm.testing.proofs.slices import Slice, closed_regions, depends, overlaps, parts_of_regions, regions_read, resting

FEWEST = 4
"""Machines in which fewer regions depend on one another are decided whole."""

MOST_KEPT = 3
"""At most this many regions are followed; with more, the whole machine is."""


class Localizer:
    """Makes slices of a machine in which only some of its coupled regions are followed.

    Args:
        model: the machine.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._regions = closed_regions(model)
        self._parts = parts_of_regions(model, self._regions)
        self._assumed = regions_read(model, self._parts, model.assumptions)
        self._always = {one for one in self._regions if self._around_needs(one)}

    def kept(self, region: int) -> frozenset[int]:
        """The regions that are followed to find out about one of them."""
        return frozenset({region, *self._always, *self._assumed})

    def kept_for(self, stated: Property) -> frozenset[int]:
        """The regions that are followed for a property: those that it names."""
        return frozenset({*regions_read(self._model, self._parts, [stated]), *self._always, *self._assumed})

    def grown(self, kept: frozenset[int]) -> frozenset[int]:
        """Some regions with those that they depend on."""
        near = (
            one for one in self._regions if any(depends(self._model, self._parts, other, one) for other in (-1, *kept))
        )
        return kept.union(near)

    def slice(self, kept: frozenset[int], stated: Sequence[Property]) -> Slice | None:
        """The machine with only some regions followed; None where what the others do to them cannot be left free."""
        others = [one for one in self._regions if one not in kept]
        if not others or len(kept) > MOST_KEPT or any(self._leads_into(kept, one) for one in others):
            return None
        gone = {self._model.states[state].name for one in others for state in self._model.states[one].subtree}
        free = {name for one in others for name in self._parts[one].assigns}
        kept_model = _silent(self._model, self._regions, kept)
        free = _spread(kept_model, free, gone)
        asked = [condition for one in (*stated, *self._model.assumptions) for condition in conditions_of(one.claim)]
        told = [given for one in actions_of(kept_model) for given in _told(one)]
        if any(_is_free(part, free, gone) for one in (*asked, *told) for part in parts_of(one)):
            return None
        signals: dict[str, SignalDeclaration] = {}
        rewriter = Rewriter(lambda part: _freed(part, free, gone, signals))
        safe = counters(self._model)
        model = rewriter.model(_without(kept_model, {name for name in free if self._never_fails(name, safe)}))
        model = replace(model, variables=self._model.variables)
        events = sorted({name for one in others for name in self._parts[one].raises})
        return Slice(model, stated, kept=kept, loose=Loose(tuple(signals.values()), tuple(events)))

    def _around_needs(self, region: int) -> bool:
        """Whether what is around the regions is led into one, or hears what happens in it."""
        around, doing = self._parts[-1], self._parts[region]
        return overlaps(around.hears, doing.reports | doing.hears) or self._leads_into((), region)

    def _leads_into(self, kept: Collection[int], region: int) -> bool:
        inside = self._model.states[region].subtree
        return any(target in inside for one in (-1, *kept) for target in self._parts[one].leads)

    def _never_fails(self, name: str, safe: Collection[str]) -> bool:
        """Whether no assignment of a variable can fail."""
        given = [one.value for one in actions_of(self._model) if isinstance(one, Assign) and one.variable == name]
        return name in safe or all(_is_condition(one) for one in given)


def applies(model: Model, kept: Collection[int]) -> bool:
    """Whether a slice of a machine with some coupled regions may be decided by a few of them at a time."""
    told = any(isinstance(one, Cancel | Emit) for one in actions_of(model))
    return len(kept) >= FEWEST and not (model.members or model.defers_events() or told)


def _silent(model: Model, regions: Sequence[int], kept: Collection[int]) -> Model:
    """The machine in which other regions rest, and what their transitions read and do is left out, too."""
    rests = {state for region in regions if region not in kept for state in model.states[region].subtree}
    transitions = (replace(one, guard=None, actions=()) if one.source in rests else one for one in model.transitions)
    return resting(replace(model, transitions=tuple(transitions)), regions, kept)


def _spread(model: Model, free: set[str], gone: Collection[str]) -> set[str]:
    """The variables that are free, with those that are given something free."""
    given: list[tuple[str, Expression]] = [(one.name, one.initial) for one in model.variables]
    given += [(one.variable, one.value) for one in actions_of(model) if isinstance(one, Assign)]
    found, before = set(free), -1
    while len(found) > before:
        before = len(found)
        found |= {name for name, value in given if any(_is_free(part, found, gone) for part in parts_of(value))}
    return found


def _is_free(part: Expression, free: Collection[str], gone: Collection[str]) -> bool:
    match part:
        case Active(state):
            return state in gone
        case VariableValue(name):
            return name in free
    return False


def _freed(
    part: Expression, free: Collection[str], gone: Collection[str], signals: dict[str, SignalDeclaration]
) -> Expression:
    """A signal instead of what may have any value."""
    match part:
        case Active(state) if state in gone:
            return _asked(f"in({state})", BOOLEAN, signals)
        case VariableValue(name, kind) if name in free:
            return _asked(f"variable {name}", kind, signals)
    return part


def _asked(name: str, kind: Type, signals: dict[str, SignalDeclaration]) -> SignalValue:
    return SignalValue(signals.setdefault(name, SignalDeclaration(name, kind, _unread)))


def _unread(_facts: Any) -> Any:
    raise AssertionError("what is free has no value in a run")


def _told(action: Action) -> Iterator[Expression]:
    """What an event carries that an action raises."""
    if isinstance(action, Raise | Send):
        yield from action.arguments


def _without(model: Model, names: Collection[str]) -> Model:
    """A machine without the assignments of some variables."""

    def left(actions: tuple[Action, ...]) -> tuple[Action, ...]:
        return tuple(one for one in actions if not (isinstance(one, Assign) and one.variable in names))

    states = (
        replace(one, entry=left(one.entry), exit=left(one.exit), initial_actions=left(one.initial_actions))
        for one in model.states
    )
    transitions = (replace(one, actions=left(one.actions)) for one in model.transitions)
    return replace(model, states=tuple(states), transitions=tuple(transitions))


def _is_condition(value: Expression) -> bool:
    """Whether a value is a flag or a name that is computed from such alone."""
    return all(isinstance(part.type, Boolean | Enumeration) for part in parts_of(value))
