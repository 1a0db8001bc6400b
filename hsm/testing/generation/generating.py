"""Tests generated from the machine: the shortest runs to all goals, and why the other goals cannot be reached."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from functools import partial
from heapq import heappop, heappush
from itertools import islice
from typing import Any

from hsm.engine.machine import Machine
from hsm.model.chart import Model, On
from hsm.model.expressions import Expression, VariableValue
from hsm.model.rewriting import parts_of
from hsm.model.unparse import expression_text
from hsm.model.values import dataclass
from hsm.testing.coverage.items import transition_text
from hsm.testing.exploration.exploring import AskingRegions, ExploredMoment, ExploredStep, Explorer
from hsm.testing.generation.distinguishing import distinguishing_steps
from hsm.testing.generation.goals import Goal, goals_of, goals_on, impossible_goals, owner_of, shown, title_of
from hsm.testing.generation.recording import About, Minimiser, Shows, named, surroundings
from hsm.testing.mutation.mutating import notice, structural, trial
from hsm.testing.mutation.operators import Mutant
from hsm.testing.proofs.possible import Possible
from hsm.testing.proofs.proving import examine
from hsm.testing.proofs.verdicts import NO_FAULT, Assumptions
from hsm.testing.scenarios.driver import TICK, Driver
from hsm.testing.scenarios.replaying import replay
from hsm.testing.scenarios.running import run_scenario
from hsm.testing.scenarios.scenarios import Scenario
from hsm.testing.scenarios.script import scripted_machine
from hsm.testing.scenarios.writing import Writer

Key = tuple[Any, ...]

MOST_WAYS = 60
"""At most this many runs are tried to kill a mutant that survives all tests."""

MOST_RUNS = 4
"""At most this many runs are tried to show a goal."""

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
        moments: the number of different states seen.
        steps: the number of steps tried.
        complete: whether these are all states.
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
    writing = _Writing(ready, Writer(ready.model), tick)
    writing.goals(search)
    writing.mutants(search)
    unreached = tuple(search.unreached(writing.unshown))
    return Generated(writing.scenarios, unreached, len(search.parents), search.steps, search.complete)


@dataclass(slots=True)
class _Writing:
    """Writes scenarios from the runs of a search.

    Which scenarios there are depends on one state at a time: what is written for a state stays when others change.

    Attributes:
        machine: the machine, scripted.
        writer: words the expectations.
        tick: seconds from one step to the next.
        written: the scenarios, each with the state that it is about.
        unshown: goals that are reached only if steps take no time.
    """

    machine: Machine
    writer: Writer
    tick: float
    written: list[tuple[Scenario, int]] = field(default_factory=list)
    unshown: list[Goal] = field(default_factory=list)

    @property
    def scenarios(self) -> tuple[Scenario, ...]:
        """All of them, each with a title of its own."""
        return tuple(named([one for one, _ in self.written], self.writer))

    def goals(self, search: _Search) -> None:
        """Scenarios for all goals that were reached: of each state those first that need the longest runs."""
        by_owner: dict[int, list[Goal]] = {}
        for goal in goals_of(self.machine):
            compound = goal[0] == "state" and self.machine.model.states[int(str(goal[1]))].children
            if goal in search.found and not compound:  # the states inside show that it is reached
                by_owner.setdefault(owner_of(self.machine, goal), []).append(goal)
        for owner, goals in sorted(by_owner.items()):
            left = sorted(goals, key=lambda one: -len(search.ways(one)[0]))
            own: list[Scenario] = []
            while left:
                goal = left.pop(0)
                shows = partial(self._shows, goal)
                ways = (self._smallest(title_of(self.machine, goal), way, owner, shows) for way in search.ways(goal))
                scenario = next((one for one in ways if one is not None), None)
                if scenario is None:
                    self.unshown.append(goal)
                    continue
                own.append(scenario)
                left = self._not_shown_by(scenario, left)
            self.written += [(one, owner) for one in reversed(own)]

    def mutants(self, search: _Search) -> None:
        """A scenario for each mutant that those of its own state do not kill."""
        trials = [(trial(one, self.machine, self.tick), owner) for one, owner in self.written]
        for mutant in structural(self.machine.model):
            near = (one for one, owner in trials if mutant.state in (0, owner) and one.reaches(mutant))
            if notice(mutant, near):
                continue
            changed = scripted_machine(mutant.model)

            def kills(scenario: Scenario, _driver: Driver, changed: Machine = changed) -> bool:
                return not run_scenario(scenario, changed, self.tick).passed

            title = f"{mutant.kind}: {mutant.text}"
            for way in islice(search.around(mutant), MOST_WAYS):
                scenario = self._smallest(title, way, mutant.state, kills)
                if scenario is not None:
                    self.written.append((scenario, mutant.state))
                    trials.append((trial(scenario, self.machine, self.tick), mutant.state))
                    break

    def _shows(self, goal: Goal, _scenario: Scenario, driver: Driver) -> bool:
        return shown(self.machine, goal, driver)

    def _not_shown_by(self, scenario: Scenario, goals: Sequence[Goal]) -> list[Goal]:
        """Those of some other goals that a scenario does not happen to reach as well."""
        seen: list[Driver] = []
        run_scenario(scenario, self.machine, self.tick, [seen.append])
        return [one for one in goals if not (seen and shown(self.machine, one, seen[-1]))]

    def _smallest(self, title: str, way: Sequence[ExploredStep], state: int, shows: Shows) -> Scenario | None:
        """The smallest scenario from a run that shows something; None if none does."""
        found = replay(title, self.machine, [edge.input for edge in way], self.writer, tick=self.tick)
        if found.fault:
            return None
        minimiser = Minimiser(self.machine, self.writer, self.tick)
        near, everything = (surroundings(self.machine.model, one) for one in (state, 0))
        for about in dict.fromkeys((About(near), About(everything), About(everything, values=True))):
            scenario = minimiser.smallest(found.scenario, about, shows)
            if scenario is not None:
                return scenario
        return None


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
    found: dict[Goal, list[tuple[Key | None, ExploredStep]]] = field(default_factory=dict)
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
            for edge in islice(self.explorer.successors(moment), self.limit - self.steps):
                self._take(key, edge, depth + 1)
            idle = idle + self.steps - before if len(self.found) == known else 0
        self.complete = not self.queue and self.steps < self.limit and self.explorer.all_data

    def _take(self, source: Key | None, edge: ExploredStep, depth: int) -> None:
        self.steps += 1
        if edge.fault is not None:
            return
        for goal in goals_on(self.machine, edge):
            known = self.found.setdefault(goal, [])
            if len(known) < MOST_RUNS:
                known.append((source, edge))
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

    def ways(self, goal: Goal) -> list[list[ExploredStep]]:
        """Some runs that reach a goal, first the one that was found first."""
        return [self.way(*one) for one in self.found[goal]]

    # What was not found.

    def unreached(self, unshown: Sequence[Goal]) -> Iterator[Unreached]:
        """The unreached goals, each with the reason.

        Args:
            unshown: those that no scenario shows, although a run reaches them.
        """
        model = self.machine.model
        missed_goals = [goal for goal in goals_of(self.machine) if goal not in self.found]
        possible = self._possible() if missed_goals else None
        for goal in unshown:
            reason = "found only where several steps take no time, which a scenario cannot show"
            yield Unreached(f"{title_of(self.machine, goal)}: not shown", reason, None, proved=False)
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
