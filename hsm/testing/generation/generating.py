"""Tests generated from the machine: the shortest runs to all goals, and why the other goals cannot be reached."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush
from itertools import islice
from typing import Any

from hsm.engine.machine import Machine
from hsm.model.chart import Model, On
from hsm.model.expressions import Expression, VariableValue
from hsm.model.rewriting import parts_of
from hsm.model.unparse import expression_text
from hsm.testing.coverage.items import transition_text
from hsm.testing.exploration.exploring import AskingRegions, ExploredMoment, ExploredStep, Explorer
from hsm.testing.generation.distinguishing import distinguishing_steps
from hsm.testing.generation.goals import Goal, goals_of, goals_on, impossible_goals, short, title_of
from hsm.testing.mutation.mutating import survivors
from hsm.testing.mutation.operators import Mutant
from hsm.testing.proofs.possible import Possible
from hsm.testing.proofs.proving import examine
from hsm.testing.proofs.verdicts import NO_FAULT, Assumptions
from hsm.testing.scenarios.driver import TICK
from hsm.testing.scenarios.replaying import replay
from hsm.testing.scenarios.running import run_scenario
from hsm.testing.scenarios.scenarios import Expectation, Scenario
from hsm.testing.scenarios.script import scripted_machine
from hsm.testing.scenarios.writing import Writer

Key = tuple[Any, ...]

MOST_WAYS = 60
"""At most this many runs are tried to kill a mutant that survives all tests."""

MOST_TOLD = 10_000
"""At most this many steps are considered to find those runs."""

MOST_STEPS = 120_000
"""At most this many steps are tried in the search for goals."""

PATIENCE = 40_000
"""At most this many steps without a new goal are tried."""


@dataclass(frozen=True, slots=True)
class Unreached:
    """A goal that no run reaches.

    Attributes:
        text: what.
        reason: why not.
        line: where it is written, or None.
        proved: whether no run can reach it.
    """

    text: str
    reason: str
    line: int | None
    proved: bool


@dataclass(frozen=True, slots=True)
class Generated:
    """The result of a generation.

    Attributes:
        scenarios: the tests.
        unreached: the goals without a run.
        moments: how many different states were seen.
        steps: how many steps were tried.
        complete: whether those are all the states there are.
    """

    scenarios: tuple[Scenario, ...]
    unreached: tuple[Unreached, ...]
    moments: int
    steps: int
    complete: bool


def generate(
    machine: Machine | Model,
    parameters: Mapping[str, Any] | None = None,
    *,
    tick: float = TICK,
    steps: int = MOST_STEPS,
) -> Generated:
    """Generate tests that reach every state, take every transition, and take every path through each guard.

    Args:
        machine: the machine.
        parameters: in SI units; by default as declared.
        tick: seconds from one step to the next in the tests.
        steps: the largest number of steps to try.
    """
    ready = scripted_machine(machine)
    search = _Search(ready, Explorer(ready, parameters, tick=tick, regions=AskingRegions(ready)), parameters, steps)
    search.run()
    writer = Writer(ready.model)
    scenarios: list[Scenario] = []

    def told(title: str, way: Sequence[ExploredStep]) -> Scenario | None:
        name = f"{len(scenarios) + 1}: {title}"
        found = replay(name, ready, [edge.input for edge in way], writer, tick=tick)
        return None if found.fault else _trimmed(found.scenario)

    for way, goals in search.chosen():
        scenario = told(title_of(ready.model, goals[0]), way)
        if scenario is not None:
            scenarios.append(scenario)
    for mutant in survivors(ready.model, scenarios, tick):
        for way in islice(search.around(mutant), MOST_WAYS):
            scenario = told(short(f"{mutant.kind}: {mutant.text}"), way)
            if scenario is not None and not run_scenario(scenario, mutant.model, tick).passed:
                scenarios.append(scenario)
                break
    return Generated(tuple(scenarios), tuple(search.unreached()), len(search.parents), search.steps, search.complete)


def _can_be(goal: Goal, machine: Machine, possible: Possible) -> bool:
    """Whether any possible step may reach a goal."""
    match goal:
        case ("state", int(index)):
            return index in possible.states
        case ("transition", int(index)):
            return index in possible.transitions
        case ("history", int(index), bool(remembered)):
            return (index, remembered) in possible.history
        case ("path", int(index), int(path)):
            return index in possible.untold or path in possible.guards.get(index, ())
        case ("held", int(index), bool(held)):
            decision = machine.generator.decision(index)
            paths = possible.guards.get(index, ())
            return index in possible.untold or any(decision.outcome(path) is held for path in paths)
    return True


@dataclass(slots=True)
class _Search:
    """The order of exploration: short runs first, and rarely seen combinations of states before frequent ones."""

    machine: Machine
    explorer: Explorer
    parameters: Mapping[str, Any] | None
    limit: int
    parents: dict[Key, tuple[Key | None, ExploredStep]] = field(default_factory=dict)
    found: dict[Goal, tuple[Key | None, ExploredStep]] = field(default_factory=dict)
    impossible: dict[Goal, str] = field(default_factory=dict)
    entering: dict[int, dict[Key | None, None]] = field(default_factory=dict)
    kinds: dict[tuple[int, ...], int] = field(default_factory=dict)
    queue: list[tuple[int, int, int, Key, ExploredMoment]] = field(default_factory=list)
    steps: int = 0
    complete: bool = False
    proved: bool = False

    def run(self) -> None:
        """Explore until all goals are reached, all states are visited, or the limit is reached."""
        self.impossible = dict(impossible_goals(self.machine))
        wanted = set(goals_of(self.machine)) - self.impossible.keys()
        for edge in self.explorer.start():
            self._take(None, edge, 0)
        idle = 0
        while self.queue and self.steps < self.limit and idle < PATIENCE and not wanted <= self.found.keys():
            _, depth, _, key, moment = heappop(self.queue)
            known, before = len(self.found), self.steps
            for edge in self.explorer.successors(moment):
                self._take(key, edge, depth + 1)
            idle = idle + self.steps - before if len(self.found) == known else 0
        self.complete = not self.queue

    def _take(self, source: Key | None, edge: ExploredStep, depth: int) -> None:
        self.steps += 1
        if edge.fault is not None:
            return
        for goal in goals_on(self.machine, edge):
            self.found.setdefault(goal, (source, edge))
        for index in edge.entered:
            self.entering.setdefault(index, {})[source] = None
        key = edge.target.key()
        if key not in self.parents:
            self.parents[key] = (source, edge)
            kind = edge.target.state.configuration.leaves
            self.kinds[kind] = self.kinds.get(kind, 0) + 1
            heappush(self.queue, (self.kinds[kind] + depth, depth, len(self.parents), key, edge.target))

    def way(self, source: Key | None, edge: ExploredStep) -> list[ExploredStep]:
        """The steps from the start to a step."""
        way = [edge]
        while source is not None:
            source, edge = self.parents[source]
            way.append(edge)
        return way[::-1]

    def around(self, mutant: Mutant) -> Iterator[list[ExploredStep]]:
        """Runs that may kill a mutant, first those with a different result on the mutant, short ones first."""
        if any(("transition", index) not in self.found for index in mutant.transitions):
            return
        machine = scripted_machine(mutant.model)
        changed = Explorer(machine, self.parameters, regions=AskingRegions(machine))
        alike: list[list[ExploredStep]] = []
        steps = 0
        for key in self._near(mutant):
            way = self.way(*self.parents[key])
            for edge, elsewhere in distinguishing_steps(self.explorer, changed, mutant, way[-1].target):
                steps += 1
                if elsewhere:
                    yield [*way, edge]
                elif len(alike) < MOST_WAYS:
                    alike.append([*way, edge])
            if steps >= MOST_TOLD:
                break
        yield from alike

    def _near(self, mutant: Mutant) -> list[Key]:
        """The states from which a step may reach a mutation."""
        if mutant.state == 0:
            return list(self.parents)
        entering = self.entering.get(mutant.state, {})
        return [
            key
            for key, (_, edge) in self.parents.items()
            if key in entering or mutant.state in edge.target.state.configuration.active
        ]

    def chosen(self) -> Iterator[tuple[list[ExploredStep], list[Goal]]]:
        """Runs that together reach all reached goals: long ones first, since they cover many goals."""
        wanted = [goal for goal in goals_of(self.machine) if goal in self.found]
        ways = {goal: self.way(*self.found[goal]) for goal in wanted}
        open_goals = set(wanted)
        picked: list[tuple[list[ExploredStep], list[Goal]]] = []
        for goal in sorted(wanted, key=lambda one: -len(ways[one])):
            if goal in open_goals:
                own = [one for edge in ways[goal] for one in goals_on(self.machine, edge) if one in open_goals]
                open_goals.difference_update(own)
                picked.append((ways[goal], [goal]))
        yield from reversed(picked)

    # What was not found.

    def unreached(self) -> Iterator[Unreached]:
        """The unreached goals, each with the reason."""
        model = self.machine.model
        missed_goals = [goal for goal in goals_of(self.machine) if goal not in self.found]
        possible = self._possible() if missed_goals else None
        for goal in missed_goals:
            self.proved = possible is not None and not _can_be(goal, self.machine, possible)
            match goal:
                case ("state", int(index)):
                    place = model.states[index].place
                    text = f"state {model.states[index].name} is not entered"
                    yield Unreached(text, self._bound(), place.line if place else None, self.proved)
                case ("history", int(index), bool(remembered)):
                    how = "something" if remembered else "nothing"
                    text = f"{model.states[index].name} is not entered with {how} remembered"
                    yield Unreached(text, self._bound(), None, self.proved)
                case ("transition" | "path" | "held", int(index), *how):
                    transition = model.transitions[index]
                    missed = self._missed(str(goal[0]), index, *how)
                    reason = self._why_not(index)
                    if goal in self.impossible:
                        reason = f"it cannot be: {self.impossible[goal]}"
                    line = transition.place.line if transition.place else None
                    proved = self.proved or goal in self.impossible
                    yield Unreached(f"{transition_text(model, transition)}{missed}", reason, line, proved)

    def _missed(self, kind: str, index: int, how: Any = None) -> str:
        """The unreached goals of a transition."""
        if kind == "transition":
            return " is not taken"
        if kind == "held":
            return f": never {'true' if how else 'false'}"
        decision = self.machine.generator.decision(index)
        values = ", ".join(
            f"`{expression_text(one)}` {'true' if held else 'false'}"
            for one, held in zip(decision.conditions, decision.values(how), strict=True)
            if held is not None
        )
        return f": never {values}"

    def _bound(self) -> str:
        """How certain it is that a goal cannot be reached."""
        if self.proved:
            return "it cannot be: proved for all runs"
        return f"not found in {self.steps} steps from {len(self.parents)} states"

    def _possible(self) -> Possible | None:
        """The goals that steps may reach, if all steps are known."""
        return examine(self.machine, Assumptions(parameters=self.parameters or {}), only=(NO_FAULT,)).possible

    def _why_not(self, index: int) -> str:
        model = self.machine.model
        transition = model.transitions[index]
        if transition.source and ("state", transition.source) not in self.found:
            return f"{model.states[transition.source].name} is never entered; {self._bound()}"
        decision = self.machine.generator.decision(index)
        ways = [goal[2] for goal in self.found if goal[:2] == ("path", index)]
        if ("transition", index) in self.found:
            return f"whenever it is evaluated, earlier conditions have ruled that out; {self._bound()}"
        if any(decision.outcome(int(str(one))) for one in ways):
            return f"whenever its guard holds, another transition wins; {self._bound()}"
        if ways:
            return f"its guard never held when it was evaluated{self._ranges(decision.conditions)}; {self._bound()}"
        if decision.conditions:
            return f"its guard is never evaluated: another transition always comes first; {self._bound()}"
        if isinstance(transition.trigger, On):
            names = ", ".join(transition.trigger.names)
            return f"{names} never arrives, or another transition handles it first; {self._bound()}"
        return f"another transition always comes first; {self._bound()}"

    def _ranges(self, conditions: Sequence[Expression]) -> str:
        """The ranges of the variables in some conditions over all states."""
        slots = self.machine.generator.variables
        constant = {one.name for one in (*self.machine.model.parameters,)}
        names = dict.fromkeys(
            part.name
            for one in conditions
            for part in parts_of(one)
            if isinstance(part, VariableValue) and part.name not in constant
        )
        told = []
        for name in names:
            seen = [edge.target.state.values[slots[name]] for _, edge in self.parents.values()]
            values = [one for one in seen if isinstance(one, int | float) and not isinstance(one, bool)]
            if values:
                told.append(f"{name} was {min(values):g} to {max(values):g}")
        return f" ({', '.join(told)})" if told else ""


def _trimmed(scenario: Scenario) -> Scenario:
    """The scenario without doubled expectations."""
    steps = [
        step
        for index, step in enumerate(scenario.steps)
        if not (isinstance(step, Expectation) and not step.claims and index)
    ]
    return Scenario(scenario.name, scenario.parameters, scenario.given, tuple(steps), scenario.place)
