"""Scenarios: what their text means, how they run, what is said when they fail or cannot be read."""

import pytest

from hsm.model.diagnostics import MachineError
from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.running import run_suite
from hsm.testing.scenarios.scenarios import Expectation, Stimulus
from hsm.testing.scenarios.script import FAULT
from hsm.testing.scenarios.writing import Writer

LIGHTS = """
param pause : time = 2 s
var rounds : int = 0
initial closed
state closed
    do stop()
    when light == green and ahead > 0.5 m -> open
    on fault                              -> broken
state open
    entry / log(rounds)
    do rotate(90 deg)
    on done                               -> closed  / rounds += 1
    after pause                           -> closed
state broken
"""


@pytest.fixture
def lights(machine_of):
    return machine_of(LIGHTS)


def run(machine, library, text):
    suite = parse_suite(f"test m\n{text}", machine.model, library, "m.maze-test")
    return run_suite(suite, machine)


def test_signals_outcomes_time_states_and_variables(lights, library):
    (result,) = run(
        lights,
        library,
        """
scenario round
    given pause = 3 s, light = red
    expect closed, not open, rounds == 0, doing stop, pause == 3 s
    when light = green, ahead = 0.6 m
    expect open, doing rotate(90 deg), doing rotate(angle = 90 deg), called log(0), not doing stop
    when rotate reports done, light = red
    expect closed, rounds == 1, not called log
    when light = green
    after 2.9 s
    expect open, in(open) and rounds < 2
    after 0.1 s, ahead = 0 m
    expect closed
""",
    )
    assert result.failure is None


def test_what_is_expected_within_a_time_may_come_late_but_not_too_late(lights, library):
    late, never = run(
        lights,
        library,
        "scenario late\n    given light = green, ahead = 1 m\n    expect open\n    when ahead = 0 m\n"
        "    expect closed within 2 s\n"
        "scenario never\n    given light = green, ahead = 1 m\n    when ahead = 0 m\n    expect closed within 1 s\n",
    )
    assert late.passed
    assert "expected closed within 1 s" in never.failure.message


def test_a_failing_activity_and_a_failing_signal(lights, library):
    activity, signal = run(
        lights,
        library,
        "scenario activity\n    when stop fails\n    expect broken\n"
        "scenario signal\n    when light fails\n    expect broken\n",
    )
    assert activity.passed
    assert signal.passed


def test_a_failure_tells_step_configuration_variables_and_guards(lights, library):
    (result,) = run(lights, library, "scenario wrong\n    given light = green, ahead = 0.4 m\n    expect open\n")
    told = "\n".join(result.failure.lines())
    assert "m.maze-test:4:5: expected open" in told
    assert "in closed" in told
    assert "rounds = 0" in told
    assert "`ahead > 0.5 m` was false (light = green, ahead = 0.4)" in told


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("given lihgt = red", "did you mean `light`"),
        ("given light = gren", "did you mean `green`"),
        ("given ahead", "`ahead` is not a condition"),
        ("given ahead = 3 s", "length in m"),
        ("when rotat reports done", "did you mean `rotate`"),
        ("when rotate reports doen", "did you mean `done`"),
        ("when event xyz", "nothing in the machine waits for `xyz`"),
        ("expect opn", "did you mean `open`"),
        ("expect doing rotate(angel = 1 deg)", "no such argument"),
        ("expect called lag", "did you mean `log`"),
        ("expect raised alarm", "never raises `alarm`"),
        ("after -1 s", "not negative"),
        ("after", "found the end of the line"),
        ("wehn space.left", "did you mean `when`"),
        ("expect rounds = 3", "found `= 3`"),
        ("given pause = nan s", "`nan s` is not a finite number"),
        ("when ahead = 1e400 m", "too large"),
        ("when ahead = inf s", "with their own unit"),
        ("when ahead = inf m - 1 m", "`inf m` is not a finite number"),
        ("expect rounds < inf", "`inf` is not a finite number"),
        ("expect open within inf s", "`inf s` is not a finite number"),
        ("expect open within 1e300 s", "more than 1,000,000 steps"),
        ("after 1e300 s", "more than 1,000,000 steps"),
        ("after nan", "`nan` is not a finite number"),
        ("after 1e400 s", "too large"),
    ],
)
def test_a_line_at_fault_is_told_with_its_place_and_a_way_out(lights, library, line, message):
    text = f"test m\nscenario s\n    expect closed\n    {line}\n    expect nowhere\n"
    with pytest.raises(MachineError) as raised:
        parse_suite(text, lights.model, library, "m.maze-test")
    first, second = raised.value.diagnostics if "given" not in line else raised.value.diagnostics[-2:]
    assert first.place.line == 4
    assert message in f"{first.message} ({first.suggestion})"
    assert second.place.line == 5  # the line at fault hides no other


NO_SUITES = [
    "",
    "scenario s\n    expect closed\n",
    "test other\n",
    "test m\n    expect closed\n",
    "test m\nscenario s\n",
    "test m\nscenario s\nexpect closed\n",
    "test m\nscenario s\n    expect closed\nscenario s\n    expect closed\n",
]


@pytest.mark.parametrize("text", NO_SUITES)
def test_a_file_that_is_no_suite_is_refused(lights, library, text):
    with pytest.raises(MachineError):
        parse_suite(text, lights.model, library)


def test_what_is_written_reads_back_the_same(lights, library, walker):
    for machine, suites in ((walker.machine, walker.suites),):
        for suite in suites:
            again = parse_suite(Writer(machine.model).suite(suite.scenarios), machine.model, library)
            for one, other in zip(suite.scenarios, again.scenarios, strict=True):
                assert (one.name, one.given, one.parameters) == (other.name, other.given, other.parameters)
                for first, second in zip(one.steps, other.steps, strict=True):
                    if isinstance(first, Stimulus):
                        assert (first.after, first.signals, first.reports, first.events) == (
                            second.after,
                            second.signals,
                            second.reports,
                            second.events,
                        )
                    else:
                        assert isinstance(second, Expectation)
                        assert [claim.text for claim in first.claims] == [claim.text for claim in second.claims]


def test_a_report_of_a_failure_is_a_fault(lights, library):
    suite = parse_suite("test m\nscenario s\n    when stop fails\n    expect broken\n", lights.model, library)
    assert suite.scenarios[0].steps[0].reports == {"stop": FAULT}


@pytest.mark.parametrize("tick", ["0 s", "-0 s", "5e-324 s", "1e308 s", "1e400 s", "nan", "inf s", "-inf s"])
def test_steps_are_neither_endless_nor_without_end(lights, library, tick):
    with pytest.raises(MachineError) as raised:
        parse_suite(f"test m\ntick {tick}\nscenario s\n    after 1 s\n    expect closed\n", lights.model, library)
    assert [one.place.line for one in raised.value.diagnostics] == [2]


@pytest.mark.parametrize(("value", "opens"), [("nan", False), ("nan m", False), ("inf m", True), ("-inf m", False)])
def test_a_signal_may_be_no_finite_number(lights, library, value, opens):
    text = f"test m\nscenario s\n    when light = green, ahead = {value}\n    expect {'open' if opens else 'closed'}\n"
    (result,) = run(lights, library, text.removeprefix("test m\n"))
    assert result.failure is None
    suite = parse_suite(text, lights.model, library)
    assert Writer(lights.model).suite(suite.scenarios).count("ahead = ") == 1
    again = parse_suite(Writer(lights.model).suite(suite.scenarios), lights.model, library)
    assert repr(again.scenarios[0].steps[0].signals) == repr(suite.scenarios[0].steps[0].signals)


def test_an_argument_that_is_expected_may_be_no_finite_number(lights, library):
    (result,) = run(lights, library, "scenario s\n    expect not doing rotate(inf), not doing rotate(nan)\n")
    assert result.failure is None


def test_names_that_begin_as_those_numbers_are_names(machine_of, library):
    machine = machine_of("var inf : int = 1\ninitial nan\nstate nan\n    do stop()\n")
    (result,) = run(machine, library, "scenario s\n    expect nan, inf == 1, inf + 1 > 1\n")
    assert result.failure is None
