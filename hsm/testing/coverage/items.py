"""The coverage items of a machine with their counts, shared by all reports."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from enum import Enum
from itertools import combinations

from hsm.engine.coverage import Coverage
from hsm.engine.decisions import Decision, decision_of
from hsm.model.chart import Model, State, Timed, Transition
from hsm.model.diagnostics import Place
from hsm.model.topology import HISTORY
from hsm.model.unparse import expression_text, trigger_text
from hsm.model.values import dataclass


class ItemKind(Enum):
    """The kind of an item; the value is the heading of its column."""

    STATE = "States"
    TRANSITION = "Trans"
    GUARD = "Guards"
    CONDITION = "Conds"
    MCDC = "MC/DC"
    OUTCOME = "Outcomes"
    HISTORY = "History"
    TIME_OUT = "Timeouts"


@dataclass(frozen=True, slots=True)
class CoverageItem:
    """One thing that tests can exercise.

    Attributes:
        kind: what it is about.
        key: distinguishes it from all others of its machine.
        text: the message if it is not covered.
        place: where it is written.
        count: how often it was exercised; 1 or 0 for items without a count.
    """

    kind: ItemKind
    key: tuple[object, ...]
    text: str
    place: Place | None
    count: int

    @property
    def covered(self) -> bool:
        """Whether it was exercised at all."""
        return self.count > 0


def points(model: Model, coverage: Coverage) -> list[CoverageItem]:
    """All points of a machine, in the order of the document."""
    found: list[CoverageItem] = []
    for state in model.states[1:]:
        found.extend(_of_state(state, coverage))
    for transition in model.transitions:
        found.extend(_of_transition(model, transition, coverage))
    return found


def share(among: Iterable[CoverageItem]) -> float:
    """Percentage that is covered; 100 without items."""
    listed = [one.covered for one in among]
    return 100.0 * sum(listed) / len(listed) if listed else 100.0


def transition_text(model: Model, transition: Transition) -> str:
    """A transition in a few words: its source, its trigger, its target."""
    targets = ", ".join(model.states[target].name for target in transition.targets)
    source = model.states[transition.source].name if transition.source else model.name
    return f"{source}: {trigger_text(transition.trigger, transition.guard)}{f' -> {targets}' if targets else ''}"


def _of_state(state: State, coverage: Coverage) -> Iterator[CoverageItem]:
    name = state.name
    if state.kind in HISTORY:
        for remembered in (False, True):
            how = "with something remembered" if remembered else "with nothing remembered"
            count = coverage.history.get((state.index, remembered), 0)
            yield CoverageItem(
                ItemKind.HISTORY, ("history", name, remembered), f"{name} never entered {how}", state.place, count
            )
        return
    count = coverage.states.get(state.index, 0)
    yield CoverageItem(ItemKind.STATE, ("state", name), f"{name} never entered", state.place, count)
    if state.activity is not None:
        activity = state.activity.activity.name
        for outcome in state.activity.activity.outcomes:
            count = coverage.outcomes.get((state.index, outcome), 0)
            text = f"{activity} in {name} never reported {outcome}"
            yield CoverageItem(ItemKind.OUTCOME, ("outcome", name, outcome), text, state.activity.place, count)


def _of_transition(model: Model, transition: Transition, coverage: Coverage) -> Iterator[CoverageItem]:
    index, place = transition.index, transition.place
    text = transition_text(model, transition)
    count = coverage.transitions.get(index, 0)
    yield CoverageItem(ItemKind.TRANSITION, ("transition", index), f"{text} never taken", place, count)
    if isinstance(transition.trigger, Timed):
        yield CoverageItem(ItemKind.TIME_OUT, ("time-out", index), f"{text} never timed out", place, count)
    decision = decision_of(transition)
    if not decision.conditions:
        return
    paths = sorted(coverage.guards.get(index, ()))
    outcomes = [decision.outcome(path) for path in paths]
    for held in (True, False):
        missed = f"{text} never {'true' if held else 'false'}"
        yield CoverageItem(ItemKind.GUARD, ("guard", index, held), missed, place, outcomes.count(held))
    if len(decision.conditions) > 1:
        yield from _of_conditions(decision, transition, text, paths)


def _of_conditions(decision: Decision, transition: Transition, text: str, paths: list[int]) -> Iterator[CoverageItem]:
    seen = [decision.values(path) for path in paths]
    for number, condition in enumerate(decision.conditions):
        name = expression_text(condition)
        place = condition.place or transition.place
        for held in (True, False):
            count = sum(values[number] is held for values in seen)
            missed = f"{text}: `{name}` never {'true' if held else 'false'}"
            yield CoverageItem(ItemKind.CONDITION, ("condition", transition.index, number, held), missed, place, count)
        missed = f"{text}: `{name}` never decided independently"
        alone = int(_decides_alone(decision, paths, number))
        yield CoverageItem(ItemKind.MCDC, ("mcdc", transition.index, number), missed, place, alone)


def _decides_alone(decision: Decision, paths: list[int], number: int) -> bool:
    """Whether two paths show a condition to decide: it differs, the outcome differs, nothing else that was evaluated.

    This is masking MC/DC with short-circuit evaluation (DO-178C, FAQ 8 of DO-248C).
    """
    for one, other in combinations(paths, 2):
        first, second = decision.values(one), decision.values(other)
        if None in (first[number], second[number]) or first[number] == second[number]:
            continue
        rest = (pair for index, pair in enumerate(zip(first, second, strict=True)) if index != number)
        if decision.outcome(one) != decision.outcome(other) and all(a == b or None in (a, b) for a, b in rest):
            return True
    return False
