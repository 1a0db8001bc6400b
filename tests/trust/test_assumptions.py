"""Assumptions that a machine states: proofs rely on them, and a run that breaks one is no counterexample."""

import pytest

from hsm.dsl import load_model
from hsm.dsl.loading import ASSUMED
from hsm.engine.machine import Machine
from hsm.engine.monitoring import Monitor
from hsm.model.diagnostics import MachineError
from hsm.testing.exploration.violations import search
from hsm.testing.proofs.proving import check
from hsm.testing.proofs.verdicts import Assumptions
from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.running import run_scenario
from hsm.testing.scenarios.script import Script, scripted, scripted_machine
from hsm.testing.scenarios.watching import watches
from tests.trust.library import make_library

TEXT = """machine m

{assumed}
property shut : never in(b)
property near : always d >= 0 m

var d : length = 0 m

initial a

state a
    do ring()
    when door.open -> c
    after 6 s      -> b
    on go                / d = ahead

state b
    do stop()

state c
    do drive()
    on blocked -> a
"""


def loaded(tmp_path, assumed, text=TEXT):
    path = tmp_path / "m.maze-machine"
    path.write_text(text.format(assumed=assumed))
    return load_model(path, make_library())


def decided(tmp_path, assumed, text=TEXT):
    return {one.name: one for one in check(loaded(tmp_path, assumed, text), seconds=10)}


@pytest.mark.parametrize(
    ("assumed", "proved"),
    [
        ("", set()),
        ("assume r : always ahead >= 0 m", {"near"}),
        ("assume r : always ahead >= 0 m and ahead < 100 m", {"near", "no step fails"}),
        ("assume r : never not (ahead >= 0 m)", {"near"}),
        ("assume o : after doing(ring), door.open within 5 s", {"shut"}),
        ("assume o : after doing(ring), door.open within 5.999 s", {"shut"}),
        ("assume o : after doing(ring), door.open within 6 s", set()),
        ("assume o : always eventually door.open within 5 s", {"shut"}),
        ("assume o : after in(a), door.open before in(b) or in(c)", set()),
        ("assume o : never in(b)", {"shut"}),
    ],
)
def test_what_is_proved_under_an_assumption(tmp_path, assumed, proved):
    found = decided(tmp_path, assumed)
    assert {name for name, one in found.items() if one.proved} == proved
    assert all(one.proved or one.violated for one in found.values())


def test_a_counterexample_keeps_to_the_assumptions(tmp_path):
    found = decided(tmp_path, "assume r : always ahead > -2 m and ahead < 100 m")["near"]
    assert found.violated
    values = [
        value
        for step in found.counterexample.steps
        for name, value in getattr(step, "signals", {}).items()
        if name == "ahead"
    ]
    assert values
    assert all(-2 < value < 100 for value in values)


def test_an_answer_that_others_give_is_assumed(tmp_path):
    text = """machine m
{assumed}
property short : after in(b), in(a) within 0.7 s
event go, back
initial a
state a
    on go -> b
state b
    on back   -> a
    after 2 s -> a
"""
    assert decided(tmp_path, "", text)["short"].violated
    assert decided(tmp_path, "assume back : after in(b), in(a) within 0.5 s", text)["short"].proved
    assert decided(tmp_path, "assume back : after in(b), in(a) within 0.8 s", text)["short"].violated


def test_an_instance_brings_its_assumptions(tmp_path):
    part = "machine part\n{assumed}\ninitial p\nstate p\n    when ahead < 0 m -> bad\nfinal bad\n"
    whole = (
        "machine m\nimport part\nproperty good : never in(b)\ninitial a\nstate a = part()\n    on bad -> b\nfinal b\n"
    )
    for assumed, status in (("", False), ("assume r : always ahead >= 0 m", True)):
        (tmp_path / "part.maze-machine").write_text(part.format(assumed=assumed))
        (tmp_path / "m.maze-machine").write_text(whole)
        model = load_model(tmp_path / "m.maze-machine", make_library())
        assert [one.name for one in model.assumptions] == ["a.r"] * status
        assert {one.name: one for one in check(model, seconds=10)}["good"].proved is status


@pytest.mark.parametrize(
    "assumed",
    [
        "assume none : always space.front and not space.front",
        "assume none : always ahead > 1 m\nassume other : always ahead < 0.5 m",
        "assume none : never in(a) or in(b) or in(c)",
    ],
)
def test_nothing_is_proved_where_the_assumptions_exclude_every_run(tmp_path, assumed):
    for one in decided(tmp_path, assumed).values():
        assert not one.proved
        assert not one.violated
        assert one.reason in ("no run satisfies the assumptions", "no first step succeeds")


def test_assumptions_are_listed(tmp_path):
    model = loaded(tmp_path, "assume r : always ahead >= 0 m")
    assert "r: always ahead >= 0 m" in Assumptions().lines(model)


def test_a_scenario_that_breaks_one_says_so_where_a_property_fails(tmp_path):
    model = loaded(tmp_path, "assume o : after doing(ring), door.open within 5 s")
    suite = "test m\n\nscenario late\n    after 6 s\n    expect b\n"
    (scenario,) = parse_suite(suite, model, make_library()).scenarios
    failure = run_scenario(scenario, model, 0.1, watches(model.properties, model.assumptions)).failure
    assert "property shut is violated" in str(failure.lines())
    assert "the assumption o was broken" in str(failure.lines())


@pytest.mark.parametrize(
    "assumed",
    [
        "assume o : after doing(ring), door.open within 5 s\nassume n : never door.open",
        "assume o : always eventually in(b) within 3 s\nassume n : never in(b)",
        "assume o : never in(b)\nassume n : never in(c)",
    ],
)
def test_nothing_is_decided_where_assumptions_contradict_each_other_later(tmp_path, assumed):
    for one in decided(tmp_path, assumed).values():
        assert (one.proved, one.violated, one.reason) == (False, False, "no complete run satisfies the assumptions")


def test_a_proof_says_where_the_assumptions_leave_no_run(tmp_path):
    text = """machine m
{assumed}
property early : never in(c)
event go
initial a
state a
    on go -> b
state b
    do ring()
    after 5 s -> c
state c
"""
    opens = "assume o : after in(b), door.open within 2 s"
    assert decided(tmp_path, opens, text)["early"].violated
    found = decided(tmp_path, f"{opens}\nassume n : never door.open", text)["early"]
    assert str(found).endswith("; the assumptions allow no complete run after b on")


def test_a_search_leaves_out_what_breaks_an_assumption(tmp_path):
    text = """machine m
{assumed}
property p : never in(b)
initial a
state a
    when ahead > 5 m -> b
    when ahead < 1 m -> c
state b
state c
    when ahead > 5 m -> b
"""
    for assumed, shown in (("", True), ("assume near : always ahead < 4 m", False)):
        searched = search(scripted_machine(loaded(tmp_path, assumed, text)), {}, steps=200)
        assert (("p" in searched.violations), searched.complete) == (shown, True)


def test_an_assumption_from_the_command_line_is_one_of_the_machine(tmp_path):
    loaded(tmp_path, "")
    given = ["o : after doing(ring), door.open within 5 s", "r : always ahead >= 0 m"]
    model = load_model(tmp_path / "m.maze-machine", make_library(), given)
    assert [one.name for one in model.assumptions] == ["o", "r"]
    assert {one.name for one in check(model, seconds=10) if one.proved} == {"shut", "near"}


@pytest.mark.parametrize("given", ["o", "o : always nothing", "o : never (in(a)", "shut : never in(b)", ": in(a)"])
def test_a_wrong_assumption_from_the_command_line_has_its_own_place(tmp_path, given):
    loaded(tmp_path, "")
    with pytest.raises(MachineError) as raised:
        load_model(tmp_path / "m.maze-machine", make_library(), ["r : always ahead >= 0 m", given])
    assert any(one.place.file == ASSUMED and one.place.line == 2 for one in raised.value.diagnostics)


def test_the_longest_tick_is_monitored(tmp_path):
    machine = Machine(scripted(loaded(tmp_path, "")))
    script = Script({"door.open": False, "ahead": 1.0})
    run = machine.start(facts=script)
    monitor, told = Monitor(run), []
    for time in (0.0, 0.1, 0.2, 0.301, 0.4, 0.9):
        told += monitor.look(script, run.step(time, (), script))
    (broken,) = told
    assert broken.assumed
    assert str(broken) == "assumption longest tick is broken at 0.301 s in a: a step comes at most 0.1 s after the last"


SLOW = """machine m

assume pace : always tick <= {pace}

property quick : always eventually not in(b) within 2.6 s

initial a

state a
    when door.open -> b

state b
    after 2 s -> c

state c
    after 1 s -> a
"""


@pytest.mark.parametrize(("pace", "proved"), [("0.2 s", True), ("250 ms", True), ("0.5 s", False)])
def test_the_longest_tick_is_stated_in_the_file(tmp_path, pace, proved):
    path = tmp_path / "m.maze-machine"
    path.write_text(SLOW.format(pace=pace))
    model = load_model(path, make_library())
    assert f"at most {'0.25' if 'ms' in pace else pace[:3]} s after the last" in Assumptions().lines(model)[0]
    (verdict,) = check(model, only={"quick"})
    assert verdict.proved is proved
    assert verdict.violated is not proved
    assert Assumptions(longest_tick=2.0).pace(model) == Assumptions().pace(model)
    assert Assumptions(longest_tick=0.01).pace(model) == 0.01


def test_the_stated_longest_tick_is_monitored_instead_of_the_usual_one(tmp_path):
    path = tmp_path / "m.maze-machine"
    path.write_text(SLOW.format(pace="0.25 s"))
    script = Script({"door.open": False, "ahead": 1.0})
    run = Machine(scripted(load_model(path, make_library()))).start(facts=script)
    monitor, told = Monitor(run), []
    for time in (0.0, 0.1, 0.35, 0.6, 0.851, 0.9, 1.9):
        told += monitor.look(script, run.step(time, (), script))
    (broken,) = told
    assert broken.assumed
    assert "assumption pace is broken at 0.851 s in a: always tick <= 0.25 s" in str(broken)


@pytest.mark.parametrize("line", ["property pace : always tick <= 0.25 s", "assume pace : always tick < 0.25 s"])
def test_the_longest_tick_is_stated_in_one_way(tmp_path, line):
    path = tmp_path / "m.maze-machine"
    path.write_text(SLOW.replace("assume pace : always tick <= {pace}", line))
    with pytest.raises(MachineError, match="tick"):
        load_model(path, make_library())


@pytest.mark.parametrize("limit", ["0 s", "-1 s", "far", "3 m"])
def test_a_longest_tick_is_a_constant_time_above_zero(tmp_path, limit):
    path = tmp_path / "m.maze-machine"
    path.write_text(SLOW.replace("{pace}", limit))
    with pytest.raises(MachineError):
        load_model(path, make_library())


def test_a_variable_may_have_the_name_of_the_tick(tmp_path):
    path = tmp_path / "m.maze-machine"
    path.write_text(SLOW.format(pace="3").replace("initial a\n", "var tick : int = 0\ninitial a\n", 1))
    model = load_model(path, make_library())
    assert Assumptions().pace(model) == 0.1
