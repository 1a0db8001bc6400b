"""From a path through a graph to a run of the engine: times, signals, outcomes and events, written as a scenario.

The run is made on the engine with the properties watched. The path is only a plan: a violation counts only when the
engine's own monitor reports it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from hsm.engine.inputs import settled
from hsm.engine.machine import Machine
from hsm.model.expressions import Expression
from hsm.model.faults import MachineFault
from hsm.model.values import dataclass
from hsm.testing.proofs.automata import Branch
from hsm.testing.proofs.courses import Origin
from hsm.testing.proofs.diagrams import FALSE, Diagram
from hsm.testing.proofs.graph import FREE, Edge, Graph
from hsm.testing.proofs.ordinals import ordinal
from hsm.testing.proofs.points import ENDED, FailingStep, Label, Part, Place
from hsm.testing.proofs.search import Visit
from hsm.testing.proofs.timing import MARGIN, Schedule, first_solved
from hsm.testing.proofs.valuations import Assigned, Valuations, readable
from hsm.testing.proofs.values import Exact
from hsm.testing.proofs.zones import PROMISE
from hsm.testing.scenarios.driver import TICK, Driver
from hsm.testing.scenarios.replaying import ScenarioRecorder
from hsm.testing.scenarios.running import run_scenario
from hsm.testing.scenarios.scenarios import Expectation, Scenario, Stimulus
from hsm.testing.scenarios.watching import property_watch
from hsm.testing.scenarios.writing import Writer

ATTEMPTS = 6
"""At most this many choices of signals and free parameters are tried for one way."""

_NANOSECONDS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class PlannedStep:
    """One step of a run that is planned.

    Attributes:
        time: in nanoseconds since the start.
        edge: the step of the graph.
        among: the signals that are possible.
        end: the result of the step, within the graph.
        label: an outcome or event that is handled there.
    """

    time: int
    edge: Edge
    among: Diagram
    end: Place
    label: Label = None


class Replayer:
    """Makes runs of a machine from paths through its graph.

    Args:
        machine: the machine.
        graph: its graph, or that of a slice of it.
        parameters: of the machine, by name; ``FREE`` for one that may have any value.
        stated: conditions that a scenario may have to give signals for.
        longest_tick: in nanoseconds.
    """

    def __init__(
        self,
        machine: Machine,
        graph: Graph,
        parameters: Mapping[str, Any],
        stated: Sequence[Expression],
        longest_tick: int,
    ) -> None:
        self._graph = graph
        self._machine = machine
        self._parameters = parameters
        self._writer = Writer(self._machine.model, stated)
        self._longest = longest_tick
        self._tick = longest_tick
        self._free = {one.name: one.type for one in self._machine.model.parameters if parameters[one.name] is FREE}

    def violation(self, way: Sequence[Visit], name: str) -> Scenario | None:
        """A run on the engine that violates a property, reported as a scenario; None where none was found.

        Args:
            way: from the first step to the one that violates the property.
            name: of the property.
        """
        ticks = self._planned(way)
        return None if ticks is None else self._tried(ticks, name, self._chosen(way[-1].location))

    def fault(self, way: Sequence[Visit], due: frozenset[int], failure: FailingStep, name: str) -> Scenario | None:
        """A run on the engine that fails in the step after a way; None where none was found.

        Args:
            way: to the location in which the step begins.
            due: the time-outs that come due in the step.
            failure: the step.
            name: title of the scenario.
        """
        last = way[-1]
        edge = Edge(last.location, last.location, due, frozenset(), (), failure.among, failure.place[1])
        ticks = self._planned(
            [*way, Visit(last.location, last.memory, None, -1, edge, Branch(last.memory, edge.among))]
        )
        if ticks is None:
            return None
        ticks[-1] = PlannedStep(ticks[-1].time, edge, edge.among, failure.place, failure.label)
        return self._tried(ticks, name, self._chosen(last.location), failing=True)

    def _chosen(self, location: int) -> dict[str, Any]:
        """The parameters, those that may be anything with a value that leads to a location."""
        found = {}
        values = self._graph.locations[location].values
        for declared, (name, value) in zip(self._machine.model.parameters, self._parameters.items(), strict=True):
            kept = values[self._graph.evaluator.slots[name]]
            if value is not FREE:
                found[name] = value
            elif isinstance(kept, Exact):
                found[name] = kept.value
            else:
                default = 0 if declared.required else declared.default
                fits = kept.least <= ordinal(default, declared.type) <= kept.most
                found[name] = default if fits else readable(kept.least, kept.most, declared.type)
        return found

    # Times.

    def _planned(self, way: Sequence[Visit]) -> list[PlannedStep] | None:
        """All steps with their times, those between two places in which nothing changes as well."""
        times, moments = None, list[tuple[int, int | None]]()
        for apart in (self._tick, 0):
            schedule, moments = self._schedule(way, apart)
            grids = [self._tick, max(1, self._tick // 10), max(1, self._tick // 100), 1]
            times = first_solved([schedule], grids)
            if times is not None:
                break
        if times is None:
            return None
        ticks: list[PlannedStep] = []
        for number, visit in enumerate(way):
            moment, idle = moments[number]
            if visit.repeated:
                ticks += self._filled(visit.edge, visit.branch, ticks[-1].time, times[moment])
            ticks.append(PlannedStep(times[moment], visit.edge, visit.branch.among, (ENDED, visit.edge.point, ())))
            if idle is not None and visit.idle is not None:
                ticks += self._filled(*visit.idle, times[moment], times[idle], last=True)
        return ticks

    def _filled(self, edge: Edge, branch: Branch, begin: int, end: int, *, last: bool = False) -> list[PlannedStep]:
        """Steps in which nothing changes, as far apart as a scenario has them."""
        times = list(range(begin + self._tick, end, self._tick))
        if last and end > begin:
            times.append(end)
        return [PlannedStep(one, edge, branch.among, (ENDED, edge.point, ())) for one in times]

    def _schedule(self, way: Sequence[Visit], apart: int) -> tuple[Schedule, list[tuple[int, int | None]]]:
        """The moments of all steps, each with the last one of those in which nothing changes after it."""
        schedule = Schedule()
        since: dict[int, tuple[int, int]] = {}
        moments: list[tuple[int, int | None]] = []
        before = 0
        for number, visit in enumerate(way):
            moment = schedule.moment() if number else 0
            if number:
                schedule.at_least(before, moment, apart)
                if not visit.repeated:
                    schedule.at_most(before, moment, self._longest)
                branch = Branch(visit.memory, FALSE) if visit.repeated else visit.branch
                self._bound(schedule, since, moment, (way[number - 1].location, visit.edge, branch))
            since.update(dict.fromkeys(visit.edge.fresh, (moment, 0)))
            if visit.edge.beats:
                lasted = {one.transition: one.least for one in self._graph.locations[visit.edge.source].timers}
                for timer in visit.edge.beats:
                    begun, offset = since.get(timer.clock, (moment, 0))
                    since[timer.clock] = begun, offset + lasted[timer.transition]
            if visit.branch.restarts or not number:
                since[PROMISE] = moment, 0
            idle = None
            if visit.idle is not None and number + 1 < len(way):
                idle = schedule.moment()
                schedule.at_least(moment, idle, 0)
                self._bound(schedule, since, idle, (visit.location, *visit.idle))
            moments.append((moment, idle))
            before = moment if idle is None else idle
        return schedule, moments

    def _bound(
        self, schedule: Schedule, since: Mapping[int, tuple[int, int]], moment: int, step: tuple[int, Edge, Branch]
    ) -> None:
        """What holds of the time of a step, by its time-outs and the time of the property."""
        location, edge, branch = step
        for timer in self._graph.locations[location].timers:
            if timer.due or timer.clock not in since:
                continue
            begun, offset = since[timer.clock]
            if timer.transition in edge.due:
                schedule.at_least(begun, moment, offset + timer.least)
            else:
                schedule.at_most(begun, moment, offset + timer.most - MARGIN)
        if PROMISE in since and branch.least is not None:
            schedule.at_least(since[PROMISE][0], moment, -(-branch.least // MARGIN) * MARGIN)
        if PROMISE in since and branch.most is not None:
            schedule.at_most(since[PROMISE][0], moment, branch.most // MARGIN * MARGIN)

    # The run.

    def _tried(
        self, ticks: Sequence[PlannedStep], name: str, parameters: Mapping[str, Any], *, failing: bool = False
    ) -> Scenario | None:
        for seed in range(ATTEMPTS):
            valuations = Valuations(self._graph.symbols, seed)
            chosen = valuations.varied(parameters, self._free) if seed else parameters
            found = self._run(ticks, name, chosen, valuations, failing=failing)
            if found is not None and (failing or self._again(found, name)):
                return found
        return None

    def _again(self, scenario: Scenario, name: str) -> bool:
        """Whether a scenario, run in the normal way, violates a property."""
        watch = property_watch(self._machine.model.properties, self._machine.model.assumptions)
        seen: list[str] = []

        def note(driver: Driver) -> None:
            seen.extend(watch(driver))

        result = run_scenario(scenario, self._machine, self._tick / _NANOSECONDS, [note])
        return name in seen and result.passed

    def _run(
        self,
        ticks: Sequence[PlannedStep],
        name: str,
        parameters: Mapping[str, Any],
        valuations: Valuations,
        *,
        failing: bool,
    ) -> Scenario | None:
        watch = property_watch(self._machine.model.properties, self._machine.model.assumptions)
        seen: list[str] = []

        def note(driver: Driver) -> None:
            seen.extend(one for one in watch(driver) if one == name)

        first = valuations.choose(ticks[0].among, parameters, {})
        if first is None:
            return None
        given = _spoken(valuations.signals(first), {})
        steps: list[Stimulus | Expectation] = []
        try:
            driver = Driver(self._machine, parameters, given, tick=self._tick / _NANOSECONDS, watch=note)
            recorder = ScenarioRecorder(self._machine, driver, self._writer, steps)
            recorder.expect()
            for tick in ticks[1:]:
                if seen or driver.outcome is not None:
                    break
                if not self._taken(tick, driver, recorder, valuations):
                    return None
        except MachineFault:
            if not failing:
                return None
            seen.append(name)
        if not seen:
            return None
        shown = _joined(steps, self._tick / _NANOSECONDS)
        # A derived parameter would follow the changed ones; so its value is written out.
        usual = settled(self._machine.model, {})
        plain = {one: value for one, value in parameters.items() if usual[one] != value}
        follows = settled(self._machine.model, plain)
        changed = {one: value for one, value in parameters.items() if one in plain or follows[one] != value}
        period = self._tick / _NANOSECONDS
        title = f"counterexample to {name}"
        return Scenario(title if period == TICK else f"{title} (tick {period:g} s)", changed, given, shown)

    def _taken(self, tick: PlannedStep, driver: Driver, recorder: ScenarioRecorder, valuations: Valuations) -> bool:
        """Execute one step; return whether it went as planned."""
        chosen = valuations.choose(tick.among, driver.variables, _known(driver))
        if chosen is None:
            return False
        labels = self._labels(tick, valuations, chosen, driver.variables)
        if labels is None:
            return False
        ended = [one for one in labels if one is not None and one[0] == "report"]
        if any(state not in driver.doing for _, state, _ in ended):
            return False
        reports = {recorder.subject(state): outcome for _, state, outcome in ended}
        events = tuple(one[1] for one in labels if one is not None and one[0] == "event")
        signals = _spoken(valuations.signals(chosen), driver.signals)
        after = max(0.0, round(tick.time / _NANOSECONDS - driver.time, 9))
        recorder.steps.append(Stimulus(after, signals, reports, events=events))
        try:
            driver.step(signals, reports, events, after=after)
        except LookupError:
            return False
        if not tick.edge.idle:
            recorder.expect()
        return True

    def _labels(
        self, tick: PlannedStep, valuations: Valuations, chosen: Assigned, variables: Mapping[str, Any]
    ) -> list[Label] | None:
        """The outcomes and events, with their data, that lead to the end of a step with these signals."""
        symbols, stepper = self._graph.symbols, self._graph.stepper
        point, among = self._graph.begin(tick.edge.source, tick.edge.due)
        cube = valuations.cube({one: value for one, value in chosen.items() if symbols[one].what != "event"})
        among = symbols.diagrams.both(among, cube)
        if among == FALSE:
            return None
        parents: dict[Place, Origin] = {}
        stepper.step(point, among, parents)
        place = tick.end
        if place not in parents and place[0].part is not Part.ARRIVALS:
            return None
        # From the end back: the signals and data for which the rest of the way is possible.
        left = symbols.diagrams.both(tick.among, cube)
        way: list[tuple[Origin, Place, Diagram]] = []
        while place in parents:
            origin = parents[place]
            left = symbols.diagrams.both(left, origin.among)
            way.append((origin, place, left))
            left = stepper.released(left, origin.fresh)
            place = origin.place
        labels: list[Label] = []
        for origin, reached, possible in reversed(way):
            label = origin.label
            if origin.fresh and label is not None and label[0] == "event":
                cube = stepper.released(cube, origin.fresh)
                found = valuations.choose(symbols.diagrams.both(possible, cube), variables, {})
                if found is None:
                    return None
                carried = valuations.carried(found, origin.fresh)
                cube = symbols.diagrams.both(cube, valuations.cube(carried))
                label = ("event", stepper.event_text(reached, carried), "")
            labels.append(label)
        return [*labels, tick.label]


def _known(driver: Driver) -> dict[tuple[str, tuple[Any, ...]], Any]:
    return {(key, ()) if isinstance(key, str) else key: value for key, value in driver.signals.items()}


def _spoken(
    signals: Mapping[tuple[str, tuple[Any, ...]], Any], known: Mapping[Any, Any]
) -> dict[str | tuple[str, tuple[Any, ...]], Any]:
    """The signals that change, as a scenario names them; false and zero are what is read anyway."""
    found: dict[str | tuple[str, tuple[Any, ...]], Any] = {}
    for (name, arguments), value in signals.items():
        key: str | tuple[str, tuple[Any, ...]] = (name, arguments) if arguments else name
        unchanged = known[key] == value if key in known else isinstance(value, bool | int | float) and value == 0
        if not unchanged:
            found[key] = value
    return found


def _joined(steps: Sequence[Stimulus | Expectation], tick: float) -> tuple[Stimulus | Expectation, ...]:
    """The steps without empty expectations, and with the waits of a scenario."""
    kept: list[Stimulus | Expectation] = []
    for step in steps:
        if isinstance(step, Expectation):
            if step.claims or not kept:
                kept.append(step)
            continue
        own = tick if step.after is None else step.after
        plain = not (step.signals or step.reports or step.events)
        last = kept[-1] if kept else None
        even = abs(own - tick) < 1e-9
        if isinstance(last, Stimulus) and even and _waits(last) and _even(last.after, tick):
            kept[-1] = Stimulus(round((last.after or 0.0) + own, 9), step.signals, step.reports, events=step.events)
        else:
            kept.append(Stimulus(None if even and not plain else own, step.signals, step.reports, events=step.events))
    return tuple(kept)


def _waits(step: Stimulus) -> bool:
    return not (step.signals or step.reports or step.events) and step.after is not None


def _even(after: float | None, tick: float) -> bool:
    """Whether a time is a whole number of ticks."""
    return after is not None and abs(after / tick - round(after / tick)) < 1e-6
