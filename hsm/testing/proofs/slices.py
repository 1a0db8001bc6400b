"""Parallel regions that do not depend on one another, each decided without the others.

A region that nothing else reads, hears or leads into can be left in its initial states for the properties of the rest:
what the rest does in a step is the same, whatever the region does. So six independent regions of four states have six
graphs of four places instead of one of 4,096. States and transitions keep their numbers.

Source: Clarke, Grumberg and Peled, "Model checking" (1999), chapter 13 (cone of influence).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import field, replace

from hsm.model.chart import (
    Action,
    After,
    Assign,
    Cancel,
    Emit,
    Every,
    Held,
    Model,
    On,
    Raise,
    Send,
    StateKind,
    Transition,
    TransitionKind,
    When,
)
from hsm.model.expressions import Active, Expression, VariableValue
from hsm.model.properties import Property, conditions_of
from hsm.model.rewriting import parts_of
from hsm.model.topology import HISTORY
from hsm.model.values import dataclass
from hsm.testing.proofs.points import NOTHING_LOOSE, Loose


@dataclass(frozen=True, slots=True)
class Slice:
    """A machine of which some regions stay in their initial states.

    Attributes:
        model: the machine.
        stated: the properties that it decides.
        whole: whether it is one of those that show together what all steps may do.
        kept: the regions that are followed; empty where all are.
        loose: what the others may do to those; empty where they do nothing to them.
    """

    model: Model
    stated: Sequence[Property]
    whole: bool = True
    kept: frozenset[int] = frozenset()
    loose: Loose = NOTHING_LOOSE


@dataclass(slots=True)
class Dependencies:
    """What a region, or all that is in no region, reads and does.

    Attributes:
        variables: read, by name.
        active: names of states of which it is asked whether they are active.
        hears: events that it waits for.
        assigns: variables that it sets.
        raises: events that it raises, sends or cancels.
        reports: outcomes and final states that the states around may receive.
        leads: states that its transitions lead to.
    """

    variables: set[str] = field(default_factory=set)
    active: set[str] = field(default_factory=set)
    hears: set[str] = field(default_factory=set)
    assigns: set[str] = field(default_factory=set)
    raises: set[str] = field(default_factory=set)
    reports: set[str] = field(default_factory=set)
    leads: set[int] = field(default_factory=set)

    def reads(self, expression: Expression) -> None:
        """Note what an expression depends on."""
        for part in parts_of(expression):
            if isinstance(part, VariableValue):
                self.variables.add(part.name)
            elif isinstance(part, Active):
                self.active.add(part.state)

    def asks(self, stated: Property) -> None:
        """Note what a property or an assumption depends on."""
        _read_all(self, conditions_of(stated.claim))
        if stated.scope is not None:
            self.active.add(stated.scope)


def slices(model: Model, stated: Sequence[Property]) -> list[Slice]:
    """The machine as several that together decide its properties, and whether a step fails.

    Every region is kept in one of them, and what is in no region is kept in all.

    Returns:
        The slices; one, the machine itself, where its regions depend on one another.
    """
    regions = closed_regions(model)
    if len(regions) < 2 or model.defers_events():
        return [Slice(model, stated)]
    parts = parts_of_regions(model, regions)
    needed = {region: _closed(model, parts, regions, {region}) for region in regions}
    found: dict[frozenset[int], list[Property]] = {}
    for kept in sorted(set(needed.values()), key=sorted):
        if not any(kept < other for other in needed.values()):
            found[kept] = []
    covering = set(found)
    for one in stated:
        kept = _closed(model, parts, regions, regions_read(model, parts, [one]))
        found.setdefault(kept, []).append(one)
    return [Slice(resting(model, regions, kept), some, kept in covering, kept) for kept, some in found.items()]


def closed_regions(model: Model) -> list[int]:
    """The outermost regions whose transitions stay within them."""
    found: list[int] = []
    for state in model.states:
        if state.kind is StateKind.PARALLEL and not any(state.index in model.states[one].subtree for one in found):
            children = [one for one in state.children if model.states[one].kind not in HISTORY]
            found += [one for one in children if _closed_in(model, one)]
    return found


def _closed_in(model: Model, region: int) -> bool:
    """Whether no transition of a region leads out of it or leaves it."""
    inside = model.states[region].subtree
    if model.states[region].kind not in (StateKind.COMPOUND, StateKind.ATOMIC):
        return False
    for one in model.transitions:
        if one.source not in inside:
            continue
        if any(target not in inside[1:] for target in one.targets):
            return False
        if one.source == region and one.targets and one.kind is not TransitionKind.LOCAL:
            return False
    return True


def parts_of_regions(model: Model, regions: Sequence[int]) -> Mapping[int, Dependencies]:
    """What each region reads and does; under -1 what is in no region, with the assumptions."""

    def part(state: int) -> Dependencies:
        return found[next((one for one in regions if state in model.states[one].subtree), -1)]

    # Any guard or action may fail.
    found = {-1: Dependencies(), **{one: Dependencies(reports={"fault"}) for one in regions}}
    for transition in model.transitions:
        own = part(transition.source)
        own.leads.update(transition.targets)
        _note_trigger(own, transition)
        _note_actions(own, transition.actions)
    for state in model.states:
        own = part(state.index)
        _note_actions(own, (*state.entry, *state.exit, *state.initial_actions))
        if state.activity is not None:
            own.reports.update(state.activity.activity.outcomes)
        if state.kind is StateKind.FINAL:
            own.reports.update((state.own_name, "done"))
    for variable in model.variables:
        own = part(variable.scope)
        own.reads(variable.initial)
        own.assigns.add(variable.name)
    for assumed in model.assumptions:
        found[-1].asks(assumed)
    return found


def _note_trigger(part: Dependencies, transition: Transition) -> None:
    match transition.trigger:
        case On(names):
            part.hears.update(names)
        case When(condition):
            part.reads(condition)
        case Held(condition, duration):
            part.reads(condition)
            part.reads(duration)
        case After(duration) | Every(duration):
            part.reads(duration)
    if transition.guard is not None:
        part.reads(transition.guard)


def _note_actions(part: Dependencies, actions: Iterable[Action]) -> None:
    for action in actions:
        match action:
            case Assign(variable, value):
                part.assigns.add(variable)
                part.reads(value)
            case Raise(event, _, arguments) | Send(event, arguments=arguments):
                part.raises.add(event)
                _read_all(part, arguments)
            case Emit(_, _, arguments, receivers):
                part.raises.update(receivers)
                _read_all(part, arguments)
            case Cancel(label):
                part.raises.add(label)


def _read_all(part: Dependencies, expressions: Iterable[Expression]) -> None:
    for one in expressions:
        part.reads(one)


def _closed(
    model: Model, parts: Mapping[int, Dependencies], regions: Sequence[int], begin: Collection[int]
) -> frozenset[int]:
    """Some regions with all that they, or what is in no region, depend on."""
    kept = set(begin)
    changed = True
    while changed:
        changed = False
        for region in regions:
            if region not in kept and any(depends(model, parts, one, region) for one in (-1, *kept)):
                kept.add(region)
                changed = True
    return frozenset(kept)


def regions_read(model: Model, parts: Mapping[int, Dependencies], stated: Iterable[Property]) -> set[int]:
    """The regions that properties ask about: for their states, or for variables that they set."""
    asked = Dependencies()
    for one in stated:
        asked.asks(one)
    return {region for region, doing in parts.items() if region >= 0 and _used(model, region, doing, asked)}


def depends(model: Model, parts: Mapping[int, Dependencies], part: int, region: int) -> bool:
    """Whether a part of a machine may do something else depending on what a region does."""
    reading, doing = parts[part], parts[region]
    if _used(model, region, doing, reading):
        return True
    if any(one in model.states[region].subtree for one in reading.leads) or overlaps(reading.hears, doing.raises):
        return True
    # Only what is around a region hears its outcomes, and loses an event that the region takes.
    return part == -1 and overlaps(reading.hears, doing.reports | doing.hears)


def _used(model: Model, region: int, doing: Dependencies, reading: Dependencies) -> bool:
    """Whether something reads a variable that a region sets, or asks for its states."""
    inside = {model.states[one].name for one in model.states[region].subtree}
    return not (reading.variables.isdisjoint(doing.assigns) and reading.active.isdisjoint(inside))


def overlaps(heard: Collection[str], told: Collection[str]) -> bool:
    """Whether some names that are heard are among those that are raised."""
    return bool(told) and ("*" in heard or not set(heard).isdisjoint(told))


def resting(model: Model, regions: Iterable[int], kept: Collection[int]) -> Model:
    """The machine with all other regions resting in their initial states."""
    rests = {state for region in regions if region not in kept for state in model.states[region].subtree}
    states = (
        replace(one, transitions=(), entry=(), exit=(), initial_actions=(), activity=None)
        if one.index in rests
        else one
        for one in model.states
    )
    return replace(model, states=tuple(states)) if rests else model
