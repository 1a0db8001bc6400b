"""Activities that use the same resource and could run at the same time."""

from __future__ import annotations

from collections.abc import Iterator

from hsm.dsl.semantics.analysis import AnalysisInput
from hsm.model.chart import State, StateKind
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic, Place, Related


def check(subject: AnalysisInput) -> Iterator[Diagnostic]:
    """Two regions, or a state and one around it, that could use the same resource at the same time."""
    states = subject.model.states
    held: list[dict[str, State]] = [{} for _ in states]
    for state in reversed(states):
        if state.index in subject.erroneous:
            continue  # where it lies is not known
        inside = held[state.index]
        parts = [held[child] for child in state.children]
        if state.kind is StateKind.PARALLEL:
            seen: dict[str, State] = {}
            for part in parts:
                for thing, holder in part.items():
                    if seen.setdefault(thing, holder) is not holder:
                        yield from _clash(subject, thing, seen[thing], holder)
        for part in parts:
            for thing, holder in part.items():
                inside.setdefault(thing, holder)
        if state.activity is not None:
            for thing in state.activity.activity.holds:
                if thing in inside:
                    yield from _clash(subject, thing, state, inside[thing])
                inside[thing] = state


def _clash(subject: AnalysisInput, thing: str, first: State, second: State) -> Iterator[Diagnostic]:
    place, other = _place(subject, second), _place(subject, first)
    if place is None:
        place, other, first, second = other, place, second, first
    if place is None or first.activity is None or second.activity is None:
        return
    message = (
        f"`{second.activity.activity.name}` in `{second.name}` and `{first.activity.activity.name}` in `{first.name}` "
        f"can be active at the same time, and both use `{thing}`"
    )
    related = () if other is None else (Related(other, "the other activity"),)
    hint = "put them into states that cannot be active at the same time"
    yield finding("E0411", place, message, hint, related)


def _place(subject: AnalysisInput, state: State) -> Place | None:
    """Where a state's activity is written in this file; inside an instance, where the instance is declared."""
    if state.activity is not None and state.activity.place is not None and state.activity.place.file == subject.file:
        return state.activity.place
    while state.parent >= 0:
        if state.place is not None and state.place.file == subject.file:
            return state.place
        state = subject.model.states[state.parent]
    return None
