"""Generated tests, exhaustive checks and mutants on machines whose answers are known."""

import re
from dataclasses import replace

import pytest
from typer.testing import CliRunner

import hsm
from hsm.dsl import check_text
from hsm.testing.coverage.items import ItemKind, points
from hsm.testing.exploration.exploring import AskingRegions
from hsm.testing.exploration.feasible import CONTRADICTION, TAKEN_BEFORE
from hsm.testing.exploration.violations import search
from hsm.testing.generation.generating import generate
from hsm.testing.generation.goals import goals_of, shown, title_of
from hsm.testing.mutation.mutating import mutants, structural, survey
from hsm.testing.proofs.proving import check
from hsm.testing.proofs.verdicts import NO_FAULT
from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.running import run_scenario, run_suite
from hsm.testing.scenarios.scenarios import Stimulus
from hsm.testing.scenarios.script import scripted_machine
from hsm.testing.scenarios.writing import Writer
from maze_machine.cli import app


def suite_of(machine, library):
    text = Writer(machine.model).suite(generate(machine).scenarios)
    return parse_suite(text, machine.model, library)


TEXTS = {
    "thresholds": "state a\n    when ahead < 0.4 m and tilt > 3 deg -> b\n"
    "state b\n    when ahead - 0.1 m >= 2 * 0.5 m -> a\n",
    "not linear": "state a\n    when abs(tilt) > 20 deg -> b\nstate b\n    when abs(ahead - 1 m) < 0.3 m -> a\n",
    "two signals": "state a\n    when steps > 3 -> b\nstate b\n    when steps == 2 -> a\n",
    "enumeration": "state a\n    when light == green -> b\nstate b\n    when light != green -> a\n",
    "remembered": "var mark : length = 0 m\nstate a\n    when ahead > mark + 1 m -> b / mark = ahead\n"
    "state b\n    after 1 s -> a\n",
    "counter": "var n : int = 0\nevent go\nstate a\n    on go if n < 3 -> b / n += 1\n    on go -> c\nstate b\n"
    "    after 0.5 s -> a\nstate c\n    do stop()\n    on fault -> a / n = 0\n",
    "history": "state out\n    state one\n        when space.left -> two\n    state two\n"
    "        when space.right -> one\n    after 5 s -> pause\nstate pause\n"
    "    do ring()\n    on accepted, refused -> out.history\n",
    "arguments": "state a\n    when clear(0.3 m) -> b\nstate b\n    when not clear(2 m) -> a\n",
}


@pytest.mark.parametrize("text", TEXTS.values(), ids=list(TEXTS))
def test_generated_tests_reach_everything_and_notice_every_change(text, machine_of, library):
    machine = machine_of(text)
    found = generate(machine)
    assert not found.unreached
    suite = suite_of(machine, library)
    results = run_suite(suite, machine)
    assert [result.failure for result in results if not result.passed] == []
    coverage = results[0].coverage
    for result in results[1:]:
        coverage = coverage.merge(result.coverage)
    kinds = (
        ItemKind.STATE,
        ItemKind.TRANSITION,
        ItemKind.GUARD,
        ItemKind.CONDITION,
        ItemKind.OUTCOME,
        ItemKind.TIME_OUT,
    )
    assert [one.text for one in points(machine.model, coverage) if one.kind in kinds and not one.covered] == []
    noticed = survey(machine.model, [suite], structural)
    assert noticed.score == 100, [(one.kind, one.text) for one in noticed.survivors]


def test_the_way_to_a_state_is_a_shortest_one(machine_of):
    machine = machine_of(
        "state a\n    when space.left -> b\n    when space.right -> d\nstate b\n    when space.front -> c\n"
        "state c\n    when space.right -> d\nstate d\n    when space.left -> a\n"
    )
    reaching = [one for one in generate(machine).scenarios if "reach c" in one.name or len(one.steps) <= 7]
    assert reaching


def test_what_cannot_be_reached_is_told_with_a_reason(machine_of):
    machine = machine_of(
        "var n : int = 0\nstate a\n    when space.left -> b / n = 1\n    when space.left and space.right -> c\n"
        "state b\n    when n == 2 -> c\n    when space.right -> a\nstate c\n    when space.front -> a\n"
    )
    reasons = {one.text: one.reason for one in generate(machine).unreached}
    assert any("c is not entered" in text for text in reasons)
    assert any("b: when n == 2 -> c is not taken" in text and "n was 0 to 1" in why for text, why in reasons.items())
    assert all("impossible: " in why for why in reasons.values())


def test_what_logic_rules_out_is_told_without_a_search(machine_of):
    machine = machine_of(
        "state a\n    when space.left or ahead > 1 m -> b\n    when ahead < 0.5 m and space.left -> c\n"
        "    when not space.left -> c\nstate b\n    when tilt > 2 deg and tilt < 1 deg -> a\n    after 1 s -> a\n"
        "state c\n    do rotate(90 deg)\n    on done if space.left -> a\n    on done if space.left -> b\n"
        "    on blocked if not space.left -> b\n    on blocked if space.left -> b\n"
    )
    reasons = {one.text: one.reason for one in generate(machine).unreached}
    assert reasons.pop("a: when ahead < 0.5 m and space.left -> c is not taken") == f"impossible: {TAKEN_BEFORE}"
    assert reasons.pop("b: when tilt > 2 deg and tilt < 1 deg -> a is not taken") == f"impossible: {CONTRADICTION}"
    assert reasons.pop("c: on done if space.left -> b is not taken") == f"impossible: {TAKEN_BEFORE}"
    assert all(": never " in text for text in reasons)
    assert not any("c: on blocked if space.left" in text and "never true" in text for text in reasons)


def test_generation_gives_the_same_twice(machine_of):
    assert generate(machine_of(TEXTS["counter"])) == generate(machine_of(TEXTS["counter"]))


TWO_REGIONS = """
event go, back
initial both
parallel both
    state one
        initial a
        state a
            when space.left and ahead < 1 m -> b
            on go                           -> c
        state b
            do rotate(90 deg)
            on done -> a
            after 2 s -> c
        state c
            when not space.left -> a
    state other
        initial d
        state d
            when space.right -> e
        state e
            do ring()
            on back -> d
"""

UNRELATED = {
    "a comment": ("event go, back", "# Nothing changes.\nevent go, back"),
    "a parameter": ("event go, back", "param unused : time = 3 s\nevent go, back"),
    "a variable": ("event go, back", "var unused : int = 0\nevent go, back"),
    "a transition": ("            on back -> d\n", "            on back -> d\n            when space.front -> d\n"),
    "a state": (
        "            on back -> d\n",
        "            on back -> d\n            on go -> f\n        state f\n            on back -> e\n",
    ),
    "a threshold": ("when space.right -> e", "when space.right and tilt < 3 deg -> e"),
}


def texts_of(machine):
    """The scenarios that are generated for a machine, each with its text by its title."""
    writer = Writer(machine.model)
    return {one.name: "\n".join(writer.scenario(one)) for one in generate(machine).scenarios}


@pytest.mark.parametrize("change", UNRELATED.values(), ids=list(UNRELATED))
def test_scenarios_stay_as_they_are_when_other_lines_change(change, machine_of):
    before, after = texts_of(machine_of(TWO_REGIONS)), texts_of(machine_of(TWO_REGIONS.replace(*change)))
    mine = [title for title in before if re.search(r"\b[abc]\b[: ]", title)]
    assert len(mine) > 8
    assert [title for title in mine if after.get(title) != before[title]] == []


def test_scenarios_mention_only_what_matters_for_what_they_try(machine_of):
    found = texts_of(machine_of(TWO_REGIONS))
    taken = found["take a: when space.left and ahead < 1 m -> b"].partition("\n")[2]
    assert "space.right" not in taken
    assert "space.left" in taken
    assert "ahead" not in taken  # zero is what it is anyway
    assert not any("space.left" in text for title, text in found.items() if title.startswith(("take d", "take e")))


@pytest.mark.parametrize("text", [*TEXTS.values(), TWO_REGIONS], ids=[*TEXTS, "two regions"])
def test_no_input_of_a_scenario_can_be_left_out(text, machine_of):
    machine = machine_of(text)
    kinds = {one.kind for one in mutants(machine.model)}
    for one in generate(machine).scenarios:
        if one.name.partition(":")[0] in kinds:  # only its mutant knows what it needs
            continue
        for index, step in enumerate(one.steps):
            for key in step.signals if isinstance(step, Stimulus) else ():
                left = {other: value for other, value in step.signals.items() if other != key}
                if not (left or step.reports or step.events or step.after):
                    continue
                steps = [*one.steps[:index], replace(step, signals=left), *one.steps[index + 1 :]]
                shorter = replace(one, steps=tuple(steps))
                result = run_scenario(shorter, machine, 0.1)
                reached = run_scenario(one, machine, 0.1).coverage
                assert not result.passed or result.coverage != reached, (one.name, key)


@pytest.mark.parametrize("text", [*TEXTS.values(), TWO_REGIONS], ids=[*TEXTS, "two regions"])
def test_a_scenario_shows_what_its_title_names(text, machine_of):
    machine = machine_of(text)
    ready = scripted_machine(machine)
    goals = {title_of(ready, goal): goal for goal in goals_of(ready)}
    scenarios = generate(machine).scenarios
    assert len({one.name for one in scenarios}) == len(scenarios)
    assert not any(re.match(r"\d", one.name) for one in scenarios)
    named = [(one, goal) for one in scenarios for title, goal in goals.items() if one.name == title]
    assert len(named) > len(scenarios) / 3
    for one, goal in named:
        drivers = []
        assert run_scenario(one, ready, 0.1, [drivers.append]).passed
        assert shown(ready, goal, drivers[-1]), one.name


def test_what_only_steps_without_time_reach_is_not_claimed(machine_of):
    machine = machine_of(
        "event go\nstate a\n    on go -> b\n    after 0.1 s -> a\nstate b\n    on go -> c\n"
        "    after 0.05 s -> a\nstate c\n    after 1 s -> a\n"
    )
    found = generate(machine)
    covered = {index for one in found.scenarios for index in run_scenario(one, machine, 0.1).coverage.states}
    names = [one.text for one in found.unreached]
    for state in machine.model.states[1:]:
        assert state.index in covered or any(state.name in text for text in names)


PROPERTIES = """
property safe : never in(b) and in(c)
property bound : always n < 3
property leaves : always eventually not in(b) within 4 s
property answered : after in(a), in(b) within 2 s
property order : after in(a), in(b) before in(c)
var n : int = 0
state a
    when space.left and not space.right -> b / n += 1
    after 1 s -> b
    {shortcut}
state b
    do stop()
    after 3 s -> c
state c
    when space.right {bound} -> a
"""


def test_properties_that_hold_are_proved(machine_of):
    machine = machine_of(PROPERTIES.format(shortcut="", bound="and n < 2"))
    verdicts = check(machine)
    assert [(one.name, one.proved) for one in verdicts] == [
        (name, True) for name in (NO_FAULT, "safe", "bound", "leaves", "answered", "order")
    ]


def test_a_violation_comes_with_a_run_that_shows_it(machine_of, library):
    machine = machine_of(PROPERTIES.format(shortcut="when space.front and not space.right -> c", bound=""))
    verdicts = {one.name: one for one in check(machine)}
    assert [name for name, one in verdicts.items() if one.violated] == ["bound", "answered", "order"]
    for name in ("bound", "order"):
        example = verdicts[name].counterexample
        text = Writer(machine.model).suite([example])
        suite = parse_suite(text, machine.model, library)
        assert all(result.passed for result in run_suite(suite, machine))  # it is a scenario that runs as it says


def test_a_fault_that_nothing_handles_is_found(machine_of):
    machine = machine_of(
        "var n : number = 1.0\nstate a\n    when (ahead / n) > 1 m -> a / n -= 1\n    after 1 s -> b\nstate b\n"
    )
    verdict = check(machine, only={NO_FAULT})[0]
    assert verdict.violated


def test_mutants_are_of_every_kind_and_differ_from_the_machine(walker):
    found = list(mutants(walker.machine.model))
    assert {one.kind for one in found} == {
        "dropped transition", "negated condition", "negated guard", "swapped targets", "dropped action",
        "shifted constant", "comparison", "logical operator", "wrong unit", "dropped guard", "swapped event",
        "doubled time-out", "dropped activity", "wrong argument", "wrong initial state", "boundary", "wrong activity",
    }  # fmt: skip
    assert all(one.model != walker.machine.model for one in found)


def test_a_scenario_that_does_not_come_by_a_mistake_need_not_run(walker, monkeypatch):
    skipping = survey(walker.machine.model, walker.suites[:1], structural)
    monkeypatch.setattr("hsm.testing.mutation.mutating.Trial.reaches", lambda trial, mutant: True)
    assert skipping == survey(walker.machine.model, walker.suites[:1], structural)


def test_what_no_scenario_notices_is_named(walker):
    survivors = survey(walker.machine.model, [walker.suites[0]], structural).survivors
    assert any("ringing: after 2 s -> waiting" in one.text for one in survivors)
    assert all(one.place is not None for one in survivors if one.kind != "shifted constant")


def test_tests_are_found_anew_for_a_machine_that_those_beside_it_no_longer_fit(tmp_path):
    machine = tmp_path / "lamp.maze-machine"
    machine.write_text("machine lamp\n\nstate off\n    after 1 s -> lit\n\nstate lit\n    after 1 s -> off\n")
    tests = tmp_path / "lamp.maze-test"
    tests.write_text("test lamp\n\nscenario it shines\n    expect shining\n")
    assert CliRunner().invoke(app, ["test", str(machine)]).exit_code == 3
    assert CliRunner().invoke(app, ["test", str(machine), "--generate", "--output", str(tests)]).exit_code == 0
    assert CliRunner().invoke(app, ["test", str(machine)]).exit_code == 0


def test_a_signal_is_that_of_the_region_that_asks_for_it_whoever_asks_where_no_region_is_active(machine_of):
    machine = machine_of("""
        initial both
        parallel both
            when space.front -> aside
            state one
                when space.left -> aside
            state two
                when space.right and space.front -> aside
        state aside
            when not space.left and not space.right and steps > 3 -> both
    """)
    regions = AskingRegions(machine)
    assert regions.of_signal("space.left") == machine.indices["one"]
    assert regions.of_signal("space.right") == machine.indices["two"]
    assert regions.of_signal("space.front") == -1
    assert regions.of_signal("steps") == -1
    assert not generate(machine).unreached


def test_an_event_with_much_data_is_tried_within_the_limit_of_steps():
    """Each event has more combinations of data than are tried: the search ends at its limit and does not say `all`."""
    lines = ["machine many", *(f"event e{n}(x : int, y : int, z : int, w : int)" for n in range(12)), "var n : int = 0"]
    lines += ["property small : always n < 1000", "state a"]
    lines += [
        f"    on e{n} if e{n}.x > n and e{n}.y > {n} and e{n}.z != n and e{n}.w < {n} / n += 1" for n in range(12)
    ]
    checked = check_text("\n".join([*lines, ""]), hsm.Library("many"))
    assert checked.model is not None, checked.diagnostics
    searched = search(scripted_machine(hsm.build(checked.model)), {}, steps=200)
    assert searched.steps <= 200
    assert not searched.complete
    assert "all" not in searched.extent
