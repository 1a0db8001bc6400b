"""A part of a machine as a separate machine for drawing; folded states do not show their inner states."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace

from hsm.model.chart import Model, State, StateKind
from hsm.model.values import dataclass

Opened = Callable[[State], bool]
"""Whether the inner states of a state are shown."""


@dataclass(frozen=True, slots=True)
class Excerpt:
    """The visible part of a machine.

    Attributes:
        model: the states and transitions that are shown, numbered again.
        states: for each state of it, its index in the whole machine.
        transitions: for each transition of it, its index in the whole machine.
        folded: for each state of it that hides states, how many.
    """

    model: Model
    states: tuple[int, ...]
    transitions: tuple[int, ...]
    folded: dict[int, int]


def everything(_state: State) -> bool:
    """Nothing is folded."""
    return True


def own_states(state: State) -> bool:
    """Instances of other machines are folded."""
    return state.instance is None


def down_to(model: Model, depth: int) -> Opened:
    """All states down to a depth are shown; those of the machine itself have depth 1."""
    depths = [0]
    for state in model.states[1:]:
        depths.append(depths[state.parent] + 1)
    return lambda state: depths[state.index] < depth


def open_around(model: Model, names: Collection[str]) -> Opened:
    """Only the states around some states are opened, and these themselves."""
    wanted = set()
    for state in model.states:
        if state.name in names:
            index = state.index
            while index >= 0:
                wanted.add(index)
                index = model.states[index].parent
    return lambda state: state.index in wanted


def excerpt(model: Model, opened: Opened = everything, within: str | None = None) -> Excerpt:
    """The visible part of a machine.

    A transition from or to a hidden state begins or ends at the state that hides it; one that stays within a folded
    state is left out.

    Args:
        model: the machine.
        opened: which states show what lies in them.
        within: full name of a state: only this one and its inner states are shown.

    Raises:
        LookupError: there is no such state.
    """
    top = next((one.index for one in model.states[1:] if one.name == within), None)
    if within is not None and top is None:
        raise LookupError(within)
    shown = [0, *_shown(model, opened, model.states[0].children if top is None else (top,))]
    number = {index: place for place, index in enumerate(shown)}
    stands_for = _representatives(model, number)
    kept = [
        one.index
        for one in model.transitions
        if one.source in stands_for
        and all(target in stands_for for target in one.targets)
        and (
            one.source in number
            if not one.targets
            else one.source in number or {stands_for[target] for target in one.targets} != {stands_for[one.source]}
        )
    ]
    order = {index: place for place, index in enumerate(kept)}
    states = tuple(_renumbered(model.states[index], number, stands_for, order) for index in shown)
    if top is not None:
        root = replace(states[0], children=(1,), last=len(states) - 1, initial=(1,), initial_actions=(), transitions=())
        states = (root, *states[1:])
        kept = [index for index in kept if model.transitions[index].source]
        order = {index: place for place, index in enumerate(kept)}
        states = tuple(
            replace(one, transitions=_those(model.states[shown[place]].transitions if place else (), order))
            for place, one in enumerate(states)
        )
    transitions = tuple(
        replace(
            model.transitions[index],
            index=order[index],
            source=stands_for[model.transitions[index].source],
            targets=tuple(stands_for[target] for target in model.transitions[index].targets),
        )
        for index in kept
    )
    folded = {
        place: model.states[index].last - index
        for place, index in enumerate(shown)
        if model.states[index].children and not states[place].children
    }
    return Excerpt(replace(model, states=states, transitions=transitions), tuple(shown), tuple(kept), folded)


def _shown(model: Model, opened: Opened, level: tuple[int, ...]) -> Iterator[int]:
    pending = list(reversed(level))
    while pending:
        state = model.states[pending.pop()]
        yield state.index
        if opened(state):
            pending.extend(reversed(state.children))


def _representatives(model: Model, number: dict[int, int]) -> dict[int, int]:
    """For each state that is shown or hidden by one that is: the number of that one."""
    found: dict[int, int] = {}
    for state in model.states:
        if state.index in number:
            found[state.index] = number[state.index]
        elif found.get(state.parent, 0):
            found[state.index] = found[state.parent]
    return found


def _those(indices: tuple[int, ...], order: dict[int, int]) -> tuple[int, ...]:
    return tuple(order[index] for index in indices if index in order)


def _renumbered(state: State, number: dict[int, int], stands_for: dict[int, int], order: dict[int, int]) -> State:
    children = tuple(number[child] for child in state.children if child in number)
    folded = bool(state.children) and not children
    inside = [index for index in number if state.index < index <= state.last]
    return replace(
        state,
        index=number[state.index],
        kind=StateKind.ATOMIC if folded else state.kind,
        parent=-1 if state.parent < 0 else number.get(state.parent, 0),
        children=children,
        last=number[max(inside)] if inside else number[state.index],
        initial=() if folded else tuple(dict.fromkeys(stands_for[one] for one in state.initial if one in stands_for)),
        transitions=_those(state.transitions, order),
    )
