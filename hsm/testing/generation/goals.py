"""The goals of generated tests: states, transitions, outcomes, time-outs, each path through a guard."""

from __future__ import annotations

from collections.abc import Hashable, Iterator

from hsm.engine.decisions import Decision
from hsm.engine.machine import Machine
from hsm.model.chart import After, Every
from hsm.model.topology import HISTORY
from hsm.model.unparse import expression_text
from hsm.testing.coverage.items import transition_text
from hsm.testing.exploration.exploring import ExploredStep
from hsm.testing.exploration.feasible import guard_of, ruled_out
from hsm.testing.scenarios.driver import Driver
from hsm.testing.scenarios.script import FAULT

Goal = tuple[Hashable, ...]
"""Something to reach: ``("state", index)``, ``("transition", index)``, ``("path", index, path)``, ..."""

_ROUNDING = 1e-6


def goals_of(machine: Machine) -> Iterator[Goal]:
    """All goals of a machine, in document order."""
    model = machine.model
    for state in model.states[1:]:
        if state.kind in HISTORY:
            yield "history", state.index, True
            continue
        yield "state", state.index
        if state.activity is not None:
            for outcome in state.activity.activity.outcomes:
                yield "outcome", state.name, outcome
    for transition in model.transitions:
        yield "transition", transition.index
        if isinstance(transition.trigger, After | Every):
            yield "early", transition.index
        decision = machine.generator.decision(transition.index)
        if decision.conditions and _few_paths(decision):
            for path in decision.paths:
                yield "path", transition.index, path
        elif decision.conditions:
            yield "held", transition.index, True
            yield "held", transition.index, False


def _few_paths(decision: Decision) -> bool:
    """Whether each path through a guard is a goal; for guards with more paths only both outcomes are."""
    return decision.count <= 2 * len(decision.conditions) ** 2 + 2


def goals_on(machine: Machine, edge: ExploredStep) -> Iterator[Goal]:
    """All goals that one step reaches."""
    for index in edge.entered:
        yield "state", index
    for state, outcome in edge.input.reports:
        if outcome != FAULT:
            yield "outcome", state, outcome
    for index in edge.transitions:
        yield "transition", index
    for index, remembered in edge.restored:
        yield "history", index, remembered
    for index, paths in edge.paths.items():
        decision = machine.generator.decision(index)
        if _few_paths(decision):
            for path in paths:
                yield "path", index, path
        else:
            for path in paths:
                yield "held", index, decision.outcome(path)
    if edge.input.wait.early and not edge.selections:
        for index in edge.target.state.timers:
            yield "early", index


def impossible_goals(machine: Machine) -> Iterator[tuple[Goal, str]]:
    """The goals that are logically impossible, each with the reason."""
    model = machine.model
    for goal in goals_of(machine):
        match goal:
            case ("path", int(index), int(path)):
                decision = machine.generator.decision(index)
                values = zip(decision.conditions, decision.values(path), strict=True)
                found = [(condition, held) for condition, held in values if held is not None]
            case ("held", int(index), bool(held)):
                found = [(guard, held)] if (guard := guard_of(model.transitions[index])) is not None else []
            case ("transition", int(index)):
                found = [(guard, True)] if (guard := guard_of(model.transitions[index])) is not None else []
            case _:
                continue
        reason = ruled_out(model, model.transitions[index], found)
        if reason is not None:
            yield goal, reason


def owner_of(machine: Machine, goal: Goal) -> int:
    """The state that a goal belongs to, by index: the source of its transition, or the state that is entered."""
    match goal:
        case ("outcome", str(state), _):
            return machine.indices[state]
        case ("state" | "history", int(index), *_):
            return index
        case (_, int(index), *_):
            return machine.model.transitions[index].source
    return 0


def shown(machine: Machine, goal: Goal, driver: Driver) -> bool:
    """Whether a run that is over has reached a goal."""
    coverage = driver.supervisor.coverage
    match goal:
        case ("state", int(index)):
            return index in coverage.states
        case ("history", int(index), bool(remembered)):
            return (index, remembered) in coverage.history
        case ("outcome", str(state), str(outcome)):
            return (machine.indices[state], outcome) in coverage.outcomes
        case ("transition", int(index)):
            return index in coverage.transitions
        case ("path", int(index), int(path)):
            return path in coverage.guards.get(index, ())
        case ("held", int(index), bool(held)):
            decision = machine.generator.decision(index)
            return any(decision.outcome(path) is held for path in coverage.guards.get(index, ()))
        case ("early", int(index)):
            near = (one.remaining for one in driver.last.considered if one.transition.index == index)
            return any(one is not None and 0 < one <= driver.tick + _ROUNDING for one in near)
    return False


def title_of(machine: Machine, goal: Goal) -> str:
    """The title of a test that reaches a goal, without line numbers, which change with every comment."""
    model = machine.model
    match goal:
        case ("state", int(index)):
            return f"reach {model.states[index].name}"
        case ("history", int(index), _):
            return f"return to {model.states[index].name}"
        case ("path", int(index), int(path)):
            decision = machine.generator.decision(index)
            conditions = zip(decision.conditions, decision.values(path), strict=True)
            values = [f"{expression_text(one)} is {str(held).lower()}" for one, held in conditions if held is not None]
            return f"{transition_text(model, model.transitions[index])}: {', '.join(values)}"
        case ("held", int(index), bool(held)):
            return f"{transition_text(model, model.transitions[index])}: {str(held).lower()}"
        case ("transition" | "early" as kind, int(index)):
            how = {"transition": "take", "early": "too early for"}[str(kind)]
            return f"{how} {transition_text(model, model.transitions[index])}"
        case ("outcome", state, outcome):
            return f"{state} reports {outcome}"
    return " ".join(map(str, goal))
