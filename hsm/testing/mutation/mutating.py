"""Mutants of a machine: which of them do its tests kill?"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import pairwise
from typing import Any

from hsm.engine.coverage import Coverage
from hsm.engine.decisions import decision_of
from hsm.engine.machine import Machine
from hsm.model.chart import Action, Model, State, Timed, Transition, When
from hsm.model.expressions import Expression, Literal, Unary
from hsm.model.rewriting import Rewriter
from hsm.model.types import BOOLEAN, Integer, Quantity
from hsm.model.unparse import action_text, expression_text, value_text
from hsm.model.values import dataclass
from hsm.testing.coverage.items import transition_text
from hsm.testing.exploration.feasible import guard_of
from hsm.testing.mutation.equivalence import Equivalence
from hsm.testing.mutation.operators import Mutant, in_expressions, in_states, in_transitions, written_parts
from hsm.testing.scenarios.running import run_scenario
from hsm.testing.scenarios.scenarios import Scenario, Suite
from hsm.testing.scenarios.script import scripted_machine

Kinds = Callable[[Model], Iterator[Mutant]]
"""Gives some of the mutants of a machine."""

SHIFT = 0.1
"""A constant is shifted by this share of itself; whole numbers are shifted by one, zeros by as much as one."""


@dataclass(frozen=True, slots=True)
class Survey:
    """The result for all mutants.

    Attributes:
        killed: the number of killed mutants.
        survivors: the mutants that no test killed.
        equivalent: the mutants that are proved equivalent, so that no test can kill them; they do not count.
        reached: the number of scenarios that reach each survivor, by its number.
    """

    killed: int
    survivors: tuple[Mutant, ...]
    equivalent: tuple[Mutant, ...] = ()
    reached: Mapping[int, int] = field(default_factory=dict, compare=False)

    @property
    def score(self) -> float:
        """The mutation score in percent; 100 without mutants."""
        total = self.killed + len(self.survivors)
        return 100.0 * self.killed / total if total else 100.0


@dataclass(frozen=True, slots=True)
class Trial:
    """A scenario that passes on a machine, to be run on the machine's mutants.

    Attributes:
        scenario: which one.
        tick: seconds from one step to the next.
        coverage: what it exercised of the machine.
    """

    scenario: Scenario
    tick: float
    coverage: Coverage

    def reaches(self, mutant: Mutant) -> bool:
        """Whether the scenario comes to the mutation; otherwise its result does not change."""
        coverage = self.coverage
        if not mutant.transitions:
            return mutant.state == 0 or mutant.state in coverage.states
        return any(
            index in coverage.guards
            or index in coverage.transitions
            or (_unmarked(mutant.model.transitions[index]) and mutant.state in coverage.states)
            for index in mutant.transitions
        )


def trial(scenario: Scenario, machine: Machine, tick: float) -> Trial:
    """Run a scenario on a machine, scripted, to see which mutants it reaches."""
    return Trial(scenario, tick, run_scenario(scenario, machine, tick).coverage)


def survey(model: Model, suites: Sequence[Suite], among: Kinds | None = None) -> Survey:
    """Run the scenarios of a machine on each of its mutants.

    Args:
        model: the machine; imported machines are tested separately and not changed here.
        suites: its scenarios; they pass on the machine itself.
        among: yields the mutants; by default all.
    """
    machine = scripted_machine(model)
    trials = [trial(one, machine, suite.tick) for suite in suites for one in suite.scenarios]
    killed = 0
    survivors, equivalent, reached = list[Mutant](), list[Mutant](), dict[int, int]()
    equivalence = Equivalence(machine)
    for mutant in (among or mutants)(model):
        reaching = [one for one in trials if one.reaches(mutant)]
        if notice(mutant, reaching):
            killed += 1
        elif equivalence.proved(mutant):
            equivalent.append(mutant)
        else:
            reached[len(survivors)] = len(reaching)
            survivors.append(mutant)
    return Survey(killed, tuple(survivors), tuple(equivalent), reached)


def _unmarked(transition: Transition) -> bool:
    """Whether a transition may have been looked at although no path through its guard was marked."""
    return isinstance(transition.trigger, Timed) or (
        guard_of(transition) is not None and not decision_of(transition).conditions
    )


def notice(mutant: Mutant, trials: Iterable[Trial]) -> bool:
    """Whether some scenarios kill a mutant; all of them reach it."""
    mutated = scripted_machine(mutant.model)
    return any(not run_scenario(one.scenario, mutated, one.tick).passed for one in trials)


def mutants(model: Model) -> Iterator[Mutant]:
    """All mutants, in the order of the kinds and of the document."""
    yield from structural(model)
    yield from _own(model, (*in_expressions(model), *in_transitions(model), *in_states(model)))


def structural(model: Model) -> Iterator[Mutant]:
    """The mutants for which tests are generated: something is left out, negated, swapped or shifted."""
    kinds = (*_dropped(model), *_negated(model), *_swapped(model), *_without_actions(model), *_shifted(model))
    yield from _own(model, kinds)


def _own(model: Model, found: Iterable[Mutant]) -> Iterator[Mutant]:
    """Those in the machine's own file."""
    own = model.files[0] if model.files else None
    return (one for one in found if own is None or one.place is None or one.place.file == own)


def _dropped(model: Model) -> Iterator[Mutant]:
    for transition in model.transitions:
        source = model.states[transition.source]
        rest = tuple(index for index in source.transitions if index != transition.index)
        mutated = _with_state(model, replace(source, transitions=rest))
        yield Mutant(
            "dropped transition",
            transition_text(model, transition),
            transition.place,
            mutated,
            source.index,
            (transition.index,),
        )


def _negated(model: Model) -> Iterator[Mutant]:
    for one in model.transitions:
        if isinstance(one.trigger, When):
            changed = replace(one, trigger=replace(one.trigger, condition=_not(one.trigger.condition)))
            yield Mutant(
                "negated condition",
                transition_text(model, one),
                one.place,
                _with_transition(model, changed),
                one.source,
                (one.index,),
            )
        if one.guard is not None:
            changed = replace(one, guard=_not(one.guard))
            yield Mutant(
                "negated guard",
                transition_text(model, one),
                one.place,
                _with_transition(model, changed),
                one.source,
                (one.index,),
            )


def _swapped(model: Model) -> Iterator[Mutant]:
    for state in model.states:
        leading = [model.transitions[index] for index in state.transitions if model.transitions[index].targets]
        for one, other in pairwise(leading):
            if one.targets == other.targets:
                continue
            mutated = _with_transition(model, replace(one, targets=other.targets))
            mutated = _with_transition(mutated, replace(other, targets=one.targets))
            yield Mutant(
                "swapped targets",
                f"{transition_text(model, one)} and the next",
                one.place,
                mutated,
                state.index,
                (one.index, other.index),
            )


def _without_actions(model: Model) -> Iterator[Mutant]:
    for state in model.states:
        for name in ("entry", "exit", "initial_actions"):
            for rest, action in _each_left_out(getattr(state, name)):
                mutated = _with_state(model, _replaced(state, name, rest))
                text = f"{state.name}: {action_text(action)}"
                yield Mutant("dropped action", text, action.place or state.place, mutated, state.index)
    for transition in model.transitions:
        for rest, action in _each_left_out(transition.actions):
            mutated = _with_transition(model, replace(transition, actions=rest))
            text = f"{transition_text(model, transition)} / {action_text(action)}"
            yield Mutant("dropped action", text, transition.place, mutated, transition.source, (transition.index,))


def _shifted(model: Model) -> Iterator[Mutant]:
    """Constants of expressions, by their place, and defaults of parameters."""
    for index, parameter in enumerate(model.parameters):
        if isinstance(parameter.type, Integer | Quantity) and not parameter.required:
            value = _shift(parameter.default)
            parameters = list(model.parameters)
            parameters[index] = replace(parameter, default=value)
            text = f"{parameter.name} = {value_text(value, parameter.type)}"
            derived = {name: one for name, one in model.derived.items() if name != parameter.name}
            mutated = replace(model, parameters=tuple(parameters), derived=derived)
            yield Mutant("shifted constant", text, None, mutated)
    for literal, (state, transitions) in _literals(model).items():
        value = _shift(literal.value)

        def change(one: Expression, literal: Literal = literal, value: Any = value) -> Expression:
            return replace(literal, value=value) if one == literal else one

        text = f"{expression_text(literal)} to {value_text(value, literal.type)}"
        mutated = Rewriter(change).model(model)
        yield Mutant("shifted constant", text, literal.place, mutated, state, transitions)


def _literals(model: Model) -> dict[Literal, tuple[int, tuple[int, ...]]]:
    """All numbers that are in the text, with the state and the transition that they belong to."""
    return {
        one: owner
        for one, owner in written_parts(model, model.variables).items()
        if isinstance(one, Literal) and isinstance(one.type, Integer | Quantity)
    }


def _shift(value: Any) -> Any:
    if isinstance(value, int):
        return value + 1
    return value * (1 + SHIFT) if value else 1.0


def _not(condition: Expression) -> Expression:
    return Unary("not", condition, BOOLEAN)


def _each_left_out(actions: tuple[Action, ...]) -> Iterator[tuple[tuple[Action, ...], Action]]:
    for index, action in enumerate(actions):
        yield (*actions[:index], *actions[index + 1 :]), action


def _replaced(state: State, name: str, actions: tuple[Action, ...]) -> State:
    change: dict[str, Callable[[], State]] = {
        "entry": lambda: replace(state, entry=actions),
        "exit": lambda: replace(state, exit=actions),
        "initial_actions": lambda: replace(state, initial_actions=actions),
    }
    return change[name]()


def _with_state(model: Model, state: State) -> Model:
    states = list(model.states)
    states[state.index] = state
    return replace(model, states=tuple(states))


def _with_transition(model: Model, transition: Transition) -> Model:
    transitions = list(model.transitions)
    transitions[transition.index] = transition
    return replace(model, transitions=tuple(transitions))
