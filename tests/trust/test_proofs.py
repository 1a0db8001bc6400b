"""Proofs: what is called proved is proved, what is called violated is shown, and the rest is neither."""

import pytest
from typer.testing import CliRunner

from hsm.dsl import load_model
from hsm.engine.machine import Machine
from hsm.engine.monitoring import Monitor
from hsm.testing.proofs.proving import check
from hsm.testing.proofs.verdicts import NO_FAULT, Assumptions, Method, Status
from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.running import run_suite
from hsm.testing.scenarios.script import Script, scripted_machine
from hsm.testing.scenarios.writing import Writer
from maze_machine.catalogue.library import robot_library
from maze_machine.catalogue.machines import shipped_machines
from maze_machine.cli import app
from tests.trust.foreign import MACHINES, MISTAKES, foreign_machine
from tests.trust.random_machines import cross_checked, replays

NAMES = sorted(shipped_machines().keys() - {"tremaux", "pledge", "pledge_smooth", "explorer"})


def verdicts_of(machine, assumptions=None, **wanted):
    return {one.name: one for one in check(machine, assumptions, **wanted)}


@pytest.fixture
def status_of(machine_of):
    """The status of the one property of a machine."""

    def decide(text, assumptions=None, **wanted):
        machine = machine_of(text)
        verdict = verdicts_of(machine, assumptions, only={machine.model.properties[0].name}, **wanted)
        (found,) = verdict.values()
        if found.violated:
            assert replays(machine, found)
        return found.status

    return decide


# True.

FALSE_CLAIMS = {
    "a variable that takes a signal's value": """
        property p : always mark <= 1 m
        var mark : length = 0 m
        state a
            do drive()
            on blocked -> b / mark = ahead
        state b
            do stop()
    """,
    "two events in one step": """
        property p : never in(c)
        event go, back
        initial a
        state a
            on go -> b
        state b
            on back   -> c
            when true -> a
        state c
    """,
    "an event and an outcome in one step": """
        property p : never in(c)
        event go
        state a
            do rotate(90 deg)
            on done -> b
        state b
            on go     -> c
            when true -> a
        state c
    """,
    "a raised event that comes from outside": """
        property p : never in(c)
        event alarm
        state a
            when steps > 3 and steps < 3 -> b / raise alarm
            on alarm -> c
        state b
        state c
    """,
    "floats are not real numbers": """
        property p : always d <= 1.05 m
        event go
        var d : length = 0 m
        state a
            on go if d < 1 m / d += 0.1 m
    """,
    "what is not a number is below nothing": """
        property p : never in(c)
        state a
            when not (ahead < 1 m) and not (ahead >= 1 m) -> c
        state c
    """,
    "a time between two ticks": """
        property p : after in(b), not in(b) within 1.02 s
        state a
            when space.left -> b
        state b
            after 1 s -> a
    """,
    "a time-out that stays due": """
        property p : after in(b), not in(b) within 3 s
        state a
            when space.left -> b
        state b
            after 1 s if space.right -> a
    """,
    "a variable of an enumeration": """
        property p : always hue == red
        var hue : Light = red
        event go
        state a
            on go / hue = light
    """,
    "a condition kept in a variable": """
        property p : never seen and in(b)
        var seen : bool = false
        state a
            when space.left -> b / seen = space.left and space.right
        state b
    """,
    "a duration that is a variable": """
        property p : after in(b), not in(b) within 2 s
        var wait : time = 1 s
        event go
        state a
            on go if wait < 3 s / wait += 1 s
            when space.left -> b
        state b
            after wait -> a
    """,
}


@pytest.mark.parametrize("text", FALSE_CLAIMS.values(), ids=FALSE_CLAIMS)
def test_a_false_claim_is_shown_to_be_false(status_of, text):
    assert status_of(text) is Status.VIOLATED


TRUE_CLAIMS = {
    "a count that comes back": """
        property p : always n <= 3
        var n : int = 0
        event go, back
        state a
            on go if n < 3 / n += 1
            on back        / n -= 1
    """,
    "a region of a signal": """
        property p : always mark <= 1 m
        var mark : length = 0 m
        event go
        state a
            on go if ahead <= 1 m / mark = ahead
    """,
    "the shorter of two time-outs": """
        property p : never in(c)
        state a
            after 1 s -> b
            after 2 s -> c
        state b
        state c
    """,
    "time-outs of two regions": """
        property p : never in(late) and in(early)
        initial both
        parallel both
            state one
                initial early
                state early
                    after 1 s -> past
                state past
            state two
                initial soon
                state soon
                    after 1.5 s -> late
                state late
    """,
    "a tick more than the time-out": """
        property p : after in(b), not in(b) within 1.2 s
        state a
            when space.left -> b
        state b
            after 1 s -> c
        state c
    """,
    "whatever the events are": """
        property p : always eventually in(a) within 3 s
        event go
        state a
            on go -> b
        state b
            on go -> c
            after 1 s -> a
        state c
            after 1 s -> a
    """,
    "the order of two conditions": """
        property p : after in(a), in(b) before in(c)
        state a
            when space.left -> b
            when ahead > 2 m and ahead < 1 m -> c
        state b
            do ring()
            on accepted -> c
        state c
    """,
}


@pytest.mark.parametrize("text", TRUE_CLAIMS.values(), ids=TRUE_CLAIMS)
def test_a_true_claim_is_proved(status_of, text):
    assert status_of(text) is Status.PROVED


def test_what_is_assumed_decides(status_of):
    late = """
        property p : after in(b), not in(b) within 1.2 s
        state a
            when space.left -> b
        state b
            after 1 s -> c
        state c
    """
    assert status_of(late, Assumptions(longest_tick=0.3)) is Status.VIOLATED
    no_number = FALSE_CLAIMS["what is not a number is below nothing"]
    assert status_of(no_number, Assumptions(not_a_number=False)) is Status.PROVED


def test_a_parameter_may_be_left_free(machine_of):
    machine = machine_of("""
        param most : int = 3
        property p : always n <= 3
        var n : int = 0
        event go
        state a
            on go if n < most / n += 1
    """)
    assert verdicts_of(machine)["p"].proved
    found = verdicts_of(machine, Assumptions(free=frozenset({"most"})))["p"]
    assert found.violated
    assert found.counterexample.parameters["most"] > 3


def test_what_is_not_followed_is_named(status_of, machine_of):
    text = """
        property p : never in(b)
        state a
            when ahead > 1 m and ahead * ahead > 4 m * 1 m and ahead < 2 m -> b
        state b
    """
    machine = machine_of(text)
    verdict = verdicts_of(machine)["p"]
    assert verdict.status is Status.UNDECIDED
    assert "`*` of ahead" in verdict.reason


def test_a_bound_is_called_a_bound(machine_of):
    machine = machine_of(TRUE_CLAIMS["whatever the events are"])
    verdict = verdicts_of(machine, depth=1)["p"]
    assert (verdict.status, verdict.depth) == (Status.BOUNDED, 1)
    assert "no violation to depth 1" in str(verdict)
    assert not verdict.meets(Status.PROVED)
    assert verdict.meets(Status.BOUNDED)


def test_an_endless_step_is_found_and_only_where_it_can_be(machine_of):
    text = """
        state a
            when space.left -> b
        state b
            when {} -> a
    """
    assert verdicts_of(machine_of(text.format("not space.left")))[NO_FAULT].proved
    found = verdicts_of(machine_of(text.format("not space.right")))[NO_FAULT]
    assert found.violated


def test_the_shortest_run_mentions_only_what_matters(machine_of, library):
    machine = machine_of("""
        property p : never in(c)
        state a
            when space.left and ahead < 1 m -> b
            when space.right -> a
        state b
            do rotate(90 deg)
            on done -> c
        state c
    """)
    verdict = verdicts_of(machine)["p"]
    lines = Writer(machine.model).scenario(verdict.counterexample)
    assert lines == [
        "scenario counterexample to p",
        "    given space.left",
        "    expect b, doing rotate(angle = 90 deg)",
        "    when rotate reports done",
        "    expect c",
    ]
    suite = parse_suite(Writer(machine.model).suite([verdict.counterexample]), machine.model, library)
    assert all(one.passed for one in run_suite(suite, machine))


# The monitor.


@pytest.mark.parametrize(("time", "violated"), [(0.95, False), (1.0, False), (1.05, True)])
def test_an_answer_that_comes_too_late_is_a_violation(machine_of, time, violated):
    machine = scripted_machine(
        machine_of("""
        property p : after in(a), in(b) within 1 s
        state a
            when space.left -> b
        state b
    """)
    )
    script = Script({"space.left": False})
    run = machine.start(facts=script)
    monitor = Monitor(run)
    assert not monitor.look(script, run.step(0.0, (), script))
    assert not monitor.look(script, run.step(0.9, (), script))
    script.signals = {"space.left": True}
    assert bool(monitor.look(script, run.step(time, (), script))) is violated


# Strong.


@pytest.mark.parametrize("name", NAMES)
def test_all_properties_of_shipped_machines_are_proved(name):
    verdicts = check(Machine(load_model(shipped_machines()[name], robot_library())))
    assert [str(one) for one in verdicts if not one.proved] == []
    assert {one.method for one in verdicts} <= set(Method)


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4, 5, 7, 9, 10, 11, 12, 13])
def test_proofs_of_random_machines_are_not_contradicted_by_random_runs(seed):
    found = cross_checked(seed, runs=30)
    assert not found.contradicted


@pytest.mark.parametrize("name", MACHINES)
def test_properties_of_other_machines_are_proved(name):
    assert [str(one) for one in check(foreign_machine(name)) if not one.proved] == []


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda one: f"{one.machine}: {one.what}")
def test_a_mistake_in_one_of_them_is_found(mistake):
    machine = foreign_machine(mistake.machine, mistake)
    (verdict,) = check(machine, only={mistake.broken})
    assert verdict.violated
    assert replays(machine, verdict)


def test_random_runs_do_find_violations():
    assert any(cross_checked(seed, runs=30).shown for seed in range(3))


# Gates.

DEAD_END = """machine dead

state a
    when space.left -> b
    when space.left and space.right -> c

state b
    when not space.left -> a

state c
    do stop()
"""


@pytest.fixture
def run_test(tmp_path, monkeypatch):
    """Runs ``maze-machine test`` on a machine beside some scenarios; the exit status and what was printed."""
    monkeypatch.chdir(tmp_path)

    def run(machine, scenarios, *arguments):
        (tmp_path / "dead.maze-machine").write_text(machine, encoding="utf-8")
        (tmp_path / "dead.maze-test").unlink(missing_ok=True)
        if scenarios is not None:
            (tmp_path / "dead.maze-test").write_text(f"test dead\n{scenarios}", encoding="utf-8")
        done = CliRunner().invoke(app, ["test", "dead.maze-machine", *map(str, arguments)])
        return done.exit_code, done.output

    return run


def test_what_is_proved_unreachable_is_named_and_does_not_count(run_test, tmp_path):
    status, told = run_test(DEAD_END, None, "--generate", "--output", tmp_path / "dead.maze-test")
    assert status == 0, told
    assert "state c is not entered: it cannot be: proved for all runs" in told
    scenarios = (tmp_path / "dead.maze-test").read_text(encoding="utf-8").partition("test dead\n")[2]
    status, told = run_test(DEAD_END, scenarios, "--fail-under", 100)
    assert status == 0, told
    assert "c never entered: proved unreachable" in told
    status, told = run_test(DEAD_END, "scenario short\n    expect a\n", "--fail-under", 100)
    assert status == 1, told


def test_gates_do_not_pass_by_accident(run_test):
    status, told = run_test(DEAD_END, None, "--coverage", "--fail-under", 1)
    assert status != 0
    assert "there are none beside the machine" in told
    status, told = run_test(DEAD_END, "scenario wrong\n    expect c\n", "--mutate")
    assert status != 0
    assert "on the machine itself fails" in told


def test_a_caller_says_what_it_relies_on(run_test):
    claim = DEAD_END.replace("\nstate a\n", "\nproperty p : never in(c)\n\nstate a\n", 1)
    claim = claim.replace(
        "-> a\n", "-> d\n\nstate d\n    when space.left -> e\n\nstate e\n    when not space.left -> a\n"
    )
    assert run_test(claim, None, "--require", "proved")[0] == 0
    status, told = run_test(claim, None, "--require", "proved", "--depth", 1)
    assert status == 1
    assert "required: proved; it is not so of" in told
    status, told = run_test(claim, None, "--require", "bounded", "--depth", 1)
    assert status == 0
    assert "passed  p" not in told
    assert "at most 0.1 s after the last" in told
