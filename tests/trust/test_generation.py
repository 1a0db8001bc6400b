"""Generated tests, exhaustive checks and mutants on machines whose answers are known."""

import pytest
from typer.testing import CliRunner

from hsm.testing.coverage.items import ItemKind, points
from hsm.testing.exploration.exploring import AskingRegions
from hsm.testing.exploration.feasible import CONTRADICTION, TAKEN_BEFORE
from hsm.testing.generation.generating import generate
from hsm.testing.mutation.mutating import mutants, structural, survey
from hsm.testing.proofs.proving import check
from hsm.testing.proofs.verdicts import NO_FAULT
from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.running import run_suite
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
    assert all("it cannot be" in why for why in reasons.values())


def test_what_logic_rules_out_is_told_without_a_search(machine_of):
    machine = machine_of(
        "state a\n    when space.left or ahead > 1 m -> b\n    when ahead < 0.5 m and space.left -> c\n"
        "    when not space.left -> c\nstate b\n    when tilt > 2 deg and tilt < 1 deg -> a\n    after 1 s -> a\n"
        "state c\n    do rotate(90 deg)\n    on done if space.left -> a\n    on done if space.left -> b\n"
        "    on blocked if not space.left -> b\n    on blocked if space.left -> b\n"
    )
    reasons = {one.text: one.reason for one in generate(machine).unreached}
    assert reasons.pop("a: when ahead < 0.5 m and space.left -> c is not taken") == f"it cannot be: {TAKEN_BEFORE}"
    assert reasons.pop("b: when tilt > 2 deg and tilt < 1 deg -> a is not taken") == f"it cannot be: {CONTRADICTION}"
    assert reasons.pop("c: on done if space.left -> b is not taken") == f"it cannot be: {TAKEN_BEFORE}"
    assert all(": never " in text for text in reasons)
    assert not any("c: on blocked if space.left" in text and "never true" in text for text in reasons)


def test_generation_gives_the_same_twice(machine_of):
    assert generate(machine_of(TEXTS["counter"])) == generate(machine_of(TEXTS["counter"]))


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
    monkeypatch.setattr("hsm.testing.mutation.mutating._reaches", lambda coverage, mutant: True)
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
