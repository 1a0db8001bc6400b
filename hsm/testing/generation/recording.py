"""From a run to the shortest scenario that still shows what it is for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

from hsm.engine.machine import Machine
from hsm.model.chart import Model, StateKind
from hsm.model.faults import MachineFault
from hsm.model.values import dataclass
from hsm.testing.scenarios.driver import Driver
from hsm.testing.scenarios.replaying import ScenarioRecorder
from hsm.testing.scenarios.scenarios import Expectation, Scenario, Stimulus
from hsm.testing.scenarios.script import SignalKey
from hsm.testing.scenarios.writing import Writer

Shows = Callable[[Scenario, Driver], bool]
"""Whether a scenario shows what it is for, given its run, which is over."""


@dataclass(frozen=True, slots=True)
class About:
    """What the expectations of a scenario are about, apart from calls and events.

    Attributes:
        states: active states and what they do, by index.
        values: the first values of variables, too, not only changes.
    """

    states: frozenset[int]
    values: bool = False


@dataclass(frozen=True, slots=True)
class Minimiser:
    """Makes scenarios small: what happens in them is left out where the rest shows the same.

    Attributes:
        machine: the machine, scripted.
        writer: words the expectations.
        tick: seconds from one step to the next.
    """

    machine: Machine
    writer: Writer
    tick: float

    def smallest(self, scenario: Scenario, about: About, shows: Shows) -> Scenario | None:
        """The scenario without the inputs that do not matter, and with short numbers.

        An input does not matter if without it the scenario shows the same, and the machine does the same in the
        states that the scenario is about. Later inputs are left out first.

        Args:
            scenario: its expectations are written again.
            about: what it is about.
            shows: whether it shows what it is for.

        Returns:
            The scenario; None if it does not show it at all.
        """
        best = self._recorded(scenario, about)
        if best is None or not shows(*best):
            return None
        found, wanted = best[0], _claims(best[0])
        for changed in (*_removals(found), *_roundings(found)):
            simpler = changed(found, self.tick)
            tried = None if simpler == found else self._recorded(simpler, about)
            if tried is not None and _claims(tried[0]) == wanted and shows(*tried):
                found = tried[0]
        return found

    def _recorded(self, scenario: Scenario, about: About) -> tuple[Scenario, Driver] | None:
        """A scenario with the expectations that the machine meets, and its run; None if it is not possible."""
        steps: list[Stimulus | Expectation] = []
        try:
            driver = Driver(self.machine, scenario.parameters, scenario.given, tick=self.tick)
            seen = {} if about.values else dict(driver.variables)
            recorder = ScenarioRecorder(self.machine, driver, self.writer, steps, seen=seen, about=about.states)
            recorder.expect()
            for one in scenario.steps:
                if not isinstance(one, Stimulus):
                    continue
                if driver.outcome is not None:
                    return None
                steps.append(one)
                driver.perform(one)
                recorder.expect()
        except (MachineFault, LookupError):
            return None
        return replace(scenario, steps=_trimmed(steps)), driver


def _claims(scenario: Scenario) -> list[tuple[str, ...]]:
    """What a scenario expects, apart from what happens in it."""
    return [tuple(claim.text for claim in one.claims) for one in scenario.steps if isinstance(one, Expectation)]


Change = Callable[[Scenario, float], Scenario]
"""Makes one input of a scenario simpler, given the time from one step to the next."""


def _removals(scenario: Scenario) -> Iterator[Change]:
    """All inputs that may be left out, the last ones first; outcomes and waiting times are what drives a machine on."""
    for index in reversed(range(len(scenario.steps))):
        step = scenario.steps[index]
        if isinstance(step, Stimulus):
            yield from (partial(_without_event, index, event) for event in reversed(step.events))
            yield from (partial(_without_signal, index, key) for key in reversed(list(step.signals)))
    yield from (partial(_not_given, key) for key in reversed(list(scenario.given)))


def _roundings(scenario: Scenario) -> Iterator[Change]:
    """Numbers with fewer digits, as few as possible."""
    for digits in (2, 3, 4):
        for index, step in enumerate(scenario.steps):
            if isinstance(step, Stimulus):
                yield from (partial(_rounded, index, key, digits) for key in step.signals)
        yield from (partial(_given_rounded, key, digits) for key in scenario.given)


def _rounded(index: int, key: str | SignalKey, digits: int, scenario: Scenario, tick: float) -> Scenario:
    step = _stimulus(scenario, index)
    if not isinstance(step.signals.get(key), float):
        return scenario
    return _with(scenario, index, replace(step, signals={**step.signals, key: _short(step.signals[key], digits)}), tick)


def _given_rounded(key: str | SignalKey, digits: int, scenario: Scenario, _tick: float) -> Scenario:
    value = scenario.given.get(key)
    if not isinstance(value, float):
        return scenario
    return replace(scenario, given={**scenario.given, key: _short(value, digits)})


def _short(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def _not_given(key: str | SignalKey, scenario: Scenario, _tick: float) -> Scenario:
    return replace(scenario, given={one: value for one, value in scenario.given.items() if one != key})


def _without_signal(index: int, key: str | SignalKey, scenario: Scenario, tick: float) -> Scenario:
    step = _stimulus(scenario, index)
    return _with(
        scenario, index, replace(step, signals={one: v for one, v in step.signals.items() if one != key}), tick
    )


def _without_event(index: int, event: str, scenario: Scenario, tick: float) -> Scenario:
    step = _stimulus(scenario, index)
    events = list(step.events)
    if event in events:
        events.remove(event)
    return _with(scenario, index, replace(step, events=tuple(events)), tick)


def _stimulus(scenario: Scenario, index: int) -> Stimulus:
    step = scenario.steps[index]
    assert isinstance(step, Stimulus), "inputs are in stimuli"
    return step


def _with(scenario: Scenario, index: int, step: Stimulus, tick: float) -> Scenario:
    """The scenario with another step; a step in which nothing happens is one tick."""
    if step.after is None and not (step.signals or step.reports or step.events):
        step = replace(step, after=tick)
    return replace(scenario, steps=(*scenario.steps[:index], step, *scenario.steps[index + 1 :]))


def _trimmed(steps: Sequence[Stimulus | Expectation]) -> tuple[Stimulus | Expectation, ...]:
    """The steps without expectations of nothing."""
    return tuple(one for one in steps if not isinstance(one, Expectation) or one.claims)


def surroundings(model: Model, state: int) -> frozenset[int]:
    """The states that belong to a state: those of its region, and those outside all regions; all for the machine."""
    outer = next((one for one in model.states if one.kind is StateKind.PARALLEL), None)
    regions = [model.states[child] for child in outer.children] if outer is not None else []
    everything = frozenset(range(len(model.states)))
    if not any(state in one.subtree for one in regions):
        return everything
    others = (one.subtree for one in regions if state not in one.subtree)
    return everything.difference(*others)


def named(scenarios: Sequence[Scenario], writer: Writer) -> Iterator[Scenario]:
    """The scenarios with titles of which no two are alike: what happens in one is added where titles are alike."""
    taken: set[str] = set()
    for scenario in scenarios:
        happens = [
            " ".join(map(str.strip, writer.stimulus(one))) for one in scenario.steps if isinstance(one, Stimulus)
        ]
        given = [f"given {', '.join(writer.settings(scenario.given))}"] if scenario.given else []
        longer = ("; ".join([*given, *happens][-count:]) for count in range(1, len(happens) + 2))
        titles = (scenario.name, *(f"{scenario.name}; {one}" for one in longer))
        title = next((one for one in titles if one not in taken), None)
        if title is not None:  # otherwise the same happens in both
            taken.add(title)
            yield replace(scenario, name=title)
