"""Runs scenarios on a machine; the results are values."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from hsm.engine.coverage import Coverage
from hsm.engine.machine import Machine
from hsm.model.chart import Model, Transition
from hsm.model.diagnostics import Place
from hsm.model.faults import MachineFault
from hsm.model.types import Type
from hsm.model.unparse import trigger_text, value_text
from hsm.model.values import dataclass
from hsm.testing.scenarios.driver import Driver
from hsm.testing.scenarios.scenarios import (
    ConditionHolds,
    Expectation,
    ExpectationClause,
    InState,
    Performs,
    Raises,
    Scenario,
    Stimulus,
    Suite,
)
from hsm.testing.scenarios.script import scripted_machine


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a scenario failed.

    Attributes:
        message: what is not as expected.
        place: the step in the scenario.
        time: seconds since the start.
        configuration: the active states, in document order.
        variables: variables by name, as text.
        doing: what runs.
        considered: each transition that the last step considered, with the reason why it fired or did not.
    """

    message: str
    place: Place | None
    time: float
    configuration: tuple[str, ...]
    variables: tuple[tuple[str, str], ...]
    doing: tuple[str, ...]
    considered: tuple[str, ...]

    def lines(self) -> list[str]:
        """The failure for a person."""
        variables = ", ".join(f"{name} = {value}" for name, value in self.variables)
        told = [
            f"{f'{self.place}: ' if self.place else ''}{self.message}",
            f"    at {self.time:.10g} s in {', '.join(self.configuration) or 'no state'}",
        ]
        if self.doing:
            told.append(f"    doing {', '.join(self.doing)}")
        if variables:
            told.append(f"    with {variables}")
        if self.considered:
            told.append("    the transitions that were considered:")
            told.extend(f"        {one}" for one in self.considered)
        return told


@dataclass(frozen=True, slots=True)
class ScenarioResult:
    """The result of a scenario.

    Attributes:
        scenario: the scenario.
        failure: the first failed expectation, or None.
        coverage: the coverage of its run.
    """

    scenario: Scenario
    failure: Failure | None
    coverage: Coverage

    @property
    def passed(self) -> bool:
        """Whether all expectations were met."""
        return self.failure is None


RunWatch = Callable[[Driver], str | None]
"""Checks a run after each step; returns a message, or None."""


class _Unmet(Exception):  # noqa: N818 - how a scenario ends early
    def __init__(self, message: str, place: Place | None) -> None:
        self.message = message
        self.place = place
        super().__init__(message)


def run_suite(
    suite: Suite, machine: Machine | Model, watches: Callable[[], Sequence[RunWatch]] = tuple
) -> list[ScenarioResult]:
    """Run all scenarios of a suite.

    Args:
        suite: the scenarios.
        machine: the machine that they test.
        watches: creates the watches of a run.
    """
    ready = scripted_machine(machine)
    return [run_scenario(one, ready, suite.tick, watches()) for one in suite.scenarios]


def run_scenario(
    scenario: Scenario, machine: Machine | Model, tick: float, watches: Iterable[RunWatch] = ()
) -> ScenarioResult:
    """Run one scenario to its end or to the first failed expectation."""
    run = _Run(scenario, tick, tuple(watches))
    failure = None
    try:
        run.start(machine)
        for step in scenario.steps:
            if isinstance(step, Stimulus):
                run.act(step)
            else:
                run.check(step)
    except _Unmet as unmet:
        failure = run.failure(unmet.message, unmet.place)
    coverage = run.driver.supervisor.coverage if run.driver else Coverage()
    return ScenarioResult(scenario, failure, coverage)


class _Run:
    def __init__(self, scenario: Scenario, tick: float, watches: tuple[RunWatch, ...]) -> None:
        self._scenario = scenario
        self._tick = tick
        self._watches = watches
        self._place = scenario.place
        self.driver: Driver | None = None

    def start(self, machine: Machine | Model) -> None:
        try:
            self.driver = Driver(
                machine, self._scenario.parameters, self._scenario.given, tick=self._tick, watch=self._watch
            )
        except (MachineFault, ValueError) as error:
            raise _Unmet(str(error), self._place) from None

    def act(self, step: Stimulus) -> None:
        driver, self._place = self._driven(), step.place
        if driver.outcome is not None:
            raise _Unmet(f"the machine ended before, as {driver.outcome}", step.place)
        try:
            driver.perform(step)
        except LookupError as error:
            raise _Unmet(str(error.args[0]), step.place) from None
        except MachineFault as error:
            raise _Unmet(str(error), step.place) from None

    def check(self, step: Expectation) -> None:
        driver, self._place = self._driven(), step.place
        try:
            unmet = await_claims(driver, step)
        except MachineFault as error:
            raise _Unmet(str(error), step.place) from None
        if unmet:
            limit = "" if step.within is None else f" within {step.within:.10g} s"
            raise _Unmet(f"expected {', '.join(one.text for one in unmet)}{limit}", step.place)

    def failure(self, message: str, place: Place | None) -> Failure:
        driver = self.driver
        if driver is None:
            return Failure(message, place, 0.0, (), (), (), ())
        indices = driver.machine.indices
        model = driver.machine.model
        types: dict[str, Type] = {one.name: one.type for one in model.parameters}
        types.update((one.name, one.type) for one in model.variables)
        return Failure(
            message,
            place,
            driver.time,
            tuple(sorted(driver.configuration, key=indices.__getitem__)),
            tuple((name, value_text(value, types[name])) for name, value in driver.variables.items()),
            tuple(performed_text(driver, state) for state in driver.doing),
            _considered(driver),
        )

    def _driven(self) -> Driver:
        assert self.driver is not None, "a run is started first"
        return self.driver

    def _watch(self, driver: Driver) -> None:
        for watch in self._watches:
            message = watch(driver)
            if message:
                self.driver = driver
                raise _Unmet(message, self._place)


def await_claims(driver: Driver, expected: Expectation) -> list[ExpectationClause]:
    """Let a run continue until what is expected holds or its time is over; the claims that do not hold then.

    Raises:
        MachineFault: the machine failed meanwhile.
    """
    end = driver.time + (expected.within or 0.0)
    unmet = unmet_claims(driver, expected.claims)
    while unmet and driver.outcome is None and driver.tick > 0 and driver.time + driver.tick <= end + 1e-9:
        driver.step()
        unmet = unmet_claims(driver, expected.claims)
    return unmet


def unmet_claims(driver: Driver, claims: Iterable[ExpectationClause]) -> list[ExpectationClause]:
    """The claims that do not hold now."""
    return [one for one in claims if not _met(driver, one)]


def _met(driver: Driver, claim: ExpectationClause) -> bool:
    match claim.content:
        case InState(state, negated):
            return (state in driver.configuration) != negated
        case Performs() as performs:
            among = driver.calls if performs.action else driver.doing.values()
            return any(map(performs.matches, among)) != performs.negated
        case Raises(event, negated, sent):
            return (event in (driver.sent if sent else driver.raised)) != negated
        case ConditionHolds(condition):
            return driver.value(condition) is True


def _considered(driver: Driver) -> tuple[str, ...]:
    """Why each transition that the last step considered fired or did not."""
    return tuple(
        f"{_line(one.transition)}{trigger_text(one.transition.trigger, one.transition.guard)}: {one.reason}"
        for one in driver.last.considered
    )


def _line(transition: Transition) -> str:
    return f"line {transition.place.line}: " if transition.place else ""


def performed_text(driver: Driver, state: str) -> str:
    """What an active state does, with its arguments."""
    performed = driver.doing[state]
    call = driver.machine.model.states[driver.machine.indices[state]].activity
    assert call is not None, "only states with an activity do something"
    given = zip(call.activity.parameters, performed.arguments, strict=False)
    return f"{performed.name}({', '.join(f'{one.name} = {value_text(value, one.type)}' for one, value in given)})"
