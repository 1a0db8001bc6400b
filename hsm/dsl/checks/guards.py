"""Conditions that never hold, transitions hidden by earlier ones, nondeterminism and incompleteness."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from hsm.dsl.logic.formulas import (
    Formula,
    UndecidedError,
    both,
    can_hold,
    case_text,
    either,
    formula_of,
    models,
    negation,
    terms_of,
)
from hsm.dsl.logic.linear import form_of
from hsm.dsl.semantics.analysis import AnalysisInput
from hsm.model.chart import After, Held, On, State, Transition, When
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic, Related
from hsm.model.expressions import Expression
from hsm.model.types import BOOLEAN, Enumeration
from hsm.model.values import dataclass

_LONGEST_TABLE = 40
_MOST_GAPS = 4


@dataclass(frozen=True, slots=True)
class GuardRow:
    """A transition with its condition and guard as formulas.

    Attributes:
        transition: the transition.
        free: the formula for any values of the parameters.
        usual: the formula with numeric parameters at their defaults.
    """

    transition: Transition
    free: Formula
    usual: Formula


def check(subject: AnalysisInput) -> Iterator[Diagnostic]:
    """All diagnostics about conditions, state by state."""
    usual = default_values(subject)
    for state in subject.own_states():
        known = [number for number in state.transitions if number not in subject.uncertain]
        transitions = [subject.model.transitions[number] for number in known]
        own = [one for one in transitions if one.place is not None and one.place.file == subject.file]
        table = [_row(one, usual) for one in own if isinstance(one.trigger, When)]
        if 0 < len(table) <= _LONGEST_TABLE:
            found = list(_table(table))
            yield from found
            if len(known) == len(state.transitions) and state.index not in subject.awaiting_unknown:
                idle = {one.place for one in found if one.code != "N0701"}
                yield from _gaps(subject, state, [row for row in table if row.transition.place not in idle], usual)
        yield from _events(own, usual)
        yield from _timeouts(own)


def default_values(subject: AnalysisInput) -> dict[str, bool | float | int]:
    """The defaults of the machine's numeric parameters."""
    return {
        parameter.name: parameter.default
        for parameter in subject.model.parameters
        if not parameter.required and parameter.type != BOOLEAN and not isinstance(parameter.type, Enumeration)
    }


def _row(transition: Transition, usual: Mapping[str, bool | float | int]) -> GuardRow:
    conditions: list[Expression] = []
    if isinstance(transition.trigger, When | Held):
        conditions.append(transition.trigger.condition)
    if transition.guard is not None:
        conditions.append(transition.guard)
    free: Formula = True
    fixed: Formula = True
    for condition in conditions:
        free = both(free, formula_of(condition, {}))
        fixed = both(fixed, formula_of(condition, usual))
    return GuardRow(transition, free, fixed)


def _table(rows: Sequence[GuardRow], events: Sequence[str] = ()) -> Iterator[Diagnostic]:
    """Transitions that never fire, that earlier ones hide, or that overlap earlier ones."""
    living: list[GuardRow] = []
    subject = "this guard" if events else "this condition"
    for row in rows:
        place = row.transition.place
        try:
            if not can_hold(row.free):
                yield finding("W0506", place, f"{subject} never holds")
                continue
            hiding = _hiding(row, living)
            if hiding:
                related = tuple(
                    Related(one.place, "this transition comes first") for one in hiding if one.place is not None
                )
                what = f" on {' and '.join(f'`{event}`' for event in events)}" if events else ""
                yield finding(
                    "W0503",
                    place,
                    f"this transition never fires{what}: an earlier transition always fires first",
                    related=related,
                )
                continue
            if not events or row.transition.guard is not None:
                yield from _overlaps(row, living)
        except UndecidedError:
            continue
        finally:
            living.append(row)


def _hiding(row: GuardRow, earlier: Sequence[GuardRow]) -> list[Transition]:
    """The earlier transitions that together cover this one; empty where they leave a case."""
    for one in earlier:
        if not can_hold(both(row.free, negation(one.free))):
            return [one.transition]
    rest = row.free
    for one in earlier:
        rest = both(rest, negation(one.free))
    if can_hold(rest):
        return []
    return [one.transition for one in earlier if can_hold(both(row.free, one.free))]


def _overlaps(row: GuardRow, earlier: Sequence[GuardRow]) -> Iterator[Diagnostic]:
    """One diagnostic for a transition that can be enabled together with earlier ones, with an example of the first."""
    cases: list[str] = []
    related: list[Related] = []
    for one in earlier:
        if one.transition.place is None or not _order_matters(one, row):
            continue
        case = next(models(both(one.usual, row.usual)), None)
        if case is not None:
            cases.append(case_text(case))
            related.append(Related(one.transition.place, f"this one wins when {cases[-1]}"))
    if cases:
        message = f"an earlier transition wins where both can fire: {cases[0]}"
        yield finding("N0701", row.transition.place, message, related=tuple(related))


def _order_matters(earlier: GuardRow, later: GuardRow) -> bool:
    """Whether the order of two transitions decides although that was probably not intended.

    It is intended if they do the same, if one is a special case of the other (as with `if` and `elif`), or if they
    depend on different signals: then their order is a priority.
    """
    first, second = earlier.transition, later.transition
    if (first.targets, first.actions) == (second.targets, second.actions):
        return False
    if terms_of(earlier.usual).isdisjoint(terms_of(later.usual)):
        return False
    special = can_hold(both(earlier.usual, negation(later.usual)))
    general = can_hold(both(later.usual, negation(earlier.usual)))
    return special and general


def _events(own: Sequence[Transition], usual: Mapping[str, bool | float | int]) -> Iterator[Diagnostic]:
    """The transitions on each event, as a table; events with the same transitions share one."""
    rows: dict[int, GuardRow] = {}
    lists: dict[str, list[int]] = {}
    for transition in own:
        if isinstance(transition.trigger, On):
            rows[transition.index] = _row(transition, usual)
            for name in dict.fromkeys(transition.trigger.names):
                lists.setdefault(name, []).append(transition.index)
    tables: dict[tuple[int, ...], list[str]] = {}
    for name, indices in lists.items():
        tables.setdefault(tuple(indices), []).append(name)
    for table, events in tables.items():
        found = [rows[index] for index in table]
        if 1 < len(found) <= _LONGEST_TABLE or (len(found) == 1 and found[0].transition.guard is not None):
            yield from _table(found, events)


def _timeouts(own: Sequence[Transition]) -> Iterator[Diagnostic]:
    """Time-outs after one that comes no later and leaves the state."""
    first: list[tuple[Expression, Transition]] = []
    for transition in own:
        if not isinstance(transition.trigger, After):
            continue
        duration = transition.trigger.duration
        for earlier, winner in first:
            if _no_later(earlier, duration) and winner.place is not None:
                related = (Related(winner.place, "this transition comes first"),)
                message = "this transition never fires: an earlier time-out always leaves the state first"
                yield finding("W0503", transition.place, message, related=related)
                break
        if transition.guard is None and transition.targets:
            first.append((duration, transition))


def _no_later(earlier: Expression, later: Expression) -> bool:
    """Whether one duration is never longer than another, whatever the parameters and signals are."""
    difference = form_of(earlier, {}).minus(form_of(later, {}))
    return not difference.coefficients and difference.constant <= 0


def _gaps(
    subject: AnalysisInput, state: State, table: Sequence[GuardRow], usual: Mapping[str, bool | float | int]
) -> Iterator[Diagnostic]:
    """The cases that a table leaves out; without two rows that share a signal or a variable there is no table."""
    stays = subject.stays.get(state.index, ())
    if any(stay.always or stay.condition is None for stay in stays):
        return
    meant: Formula = False
    for condition in (stay.condition for stay in stays if stay.condition is not None):
        meant = either(meant, formula_of(condition, usual))
    rows = _connected(table)
    if rows:
        covered: Formula = False
        for row in rows:
            covered = either(covered, row.usual)
        yield from _gaps_of(state, either(covered, meant))


def _gaps_of(state: State, covered: Formula) -> Iterator[Diagnostic]:
    found = 0
    hint = "add a transition, or state that nothing should happen: `stay when ...`"
    try:
        for case in models(negation(covered)):
            found += 1
            if found <= _MOST_GAPS:
                message = f"in `{state.name}` no transition fires when {case_text(case)}"
                yield finding("N0702", state.place, message, hint)
    except UndecidedError:
        return
    if found > _MOST_GAPS:
        yield finding(
            "N0702",
            state.place,
            f"in `{state.name}` there are {found - _MOST_GAPS} more cases in which no transition fires",
            hint,
        )


def _connected(table: Sequence[GuardRow]) -> list[GuardRow]:
    """The rows, those that share most signals and variables first; none where no two rows share any."""
    groups: list[tuple[set[str], list[GuardRow]]] = []
    for row in table:
        terms, rows = set(terms_of(row.usual)), [row]
        for group in [one for one in groups if one[0] & terms]:
            groups.remove(group)
            terms |= group[0]
            rows = group[1] + rows
        groups.append((terms, rows))
    groups.sort(key=lambda group: -len(group[1]))
    return [row for _, rows in groups for row in rows] if len(groups) < len(table) else []
