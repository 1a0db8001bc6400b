"""Proofs: what is called proved is proved, what is called violated is shown, and the rest is neither."""

import math

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

NAMES = sorted(shipped_machines().keys() - {"tremaux", "pledge_smooth", "explorer"})


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
    "what is done again and again": """
        property p : always n <= 1
        var n : int = 0
        state a
            every 1 s if n < 3 / n += 1
    """,
    "a condition that holds for some time": """
        property p : never in(b)
        state a
            when space.left for 1 s -> b
        state b
    """,
    "any event": """
        property p : never in(b)
        event go
        state a
            on * -> b
        state b
    """,
    "two events on their way": """
        property p : always n <= 1
        event go, late
        var n : int = 0
        state a
            on go / raise late after 1 s
            on late / n += 1
    """,
    "a beat that an event does not put off": """
        property p : after in(b), in(a) within 1.5 s
        event go
        state a
            when space.left -> b
        state b
            on go / raise late after 1 s
            every 2 s -> a
        event late
    """,
    "a time-out of no length": """
        property p : never in(c)
        event go
        var wait : time = 1 s
        state a
            on go if ahead >= 0 m -> b / wait = ahead / (1 m/s)
        state b
            after wait -> c
            when true  -> d
        state c
        state d
    """,
    "an outcome of a state that has begun again": """
        property p : never in(c)
        var n : int = 0
        initial both
        parallel both
            on accepted => both / n += 1
            state one
                do ring()
            state two
                initial turning
                state turning
                    do rotate(90 deg)
                    on done if n == 2 -> c
                    on blocked        / n = 2
                state c
    """,
    "one of two numbers": """
        property p : always d <= 1 m
        event go
        var d : length = 0 m
        state a
            on go / d = ahead if space.left else 0 m
    """,
    "a beat whose duration changes": """
        property p : after in(b), n > 2 within 2 s
        var n : int = 0
        var t : time = 0.5 s
        state a
            when space.left -> b
        state b
            every t if n < 4 / n += 1, t += 0.5 s
    """,
    "one of two durations": """
        property p : after in(b), not in(b) within 1 s
        state a
            when space.left -> b
        state b
            after (0.5 s if space.right else 2 s) -> a
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
    "a beat": """
        property p : after in(b), not in(b) within 1.2 s
        property q : never in(b) and n > 3
        var n : int = 0
        state a
            when space.left -> b
        state b
            every 0.5 s if n < 3 / n += 1
            every 1 s            -> c
        state c
    """,
    "a condition that has held long enough": """
        property p : after in(c), not in(c) within 1.2 s
        state a
            when space.left for 1 s -> b
        state b
            when not space.left -> c
        state c
            when true for 1 s -> a
    """,
    "an event that is on its way": """
        property p : after in(b), in(c) within 1.2 s
        event go, late
        state a
            on go -> b / raise late after 1 s
        state b
            on late -> c
        state c
    """,
    "a beat whose duration changes": """
        property p : after in(b), n > 2 within 3.2 s
        var n : int = 0
        var t : time = 0.5 s
        state a
            when space.left -> b
        state b
            every t if n < 4 / n += 1, t = 0.5 s if t == 1.5 s else t + 0.5 s
    """,
    "an event for other machines": """
        property p : always n <= 1
        event go, told
        var n : int = 0
        state a
            on go if n < 1 / n += 1, send told
    """,
    "one number or another": """
        property p : always n <= 3
        var n : int = 0
        state a
            when space.right / n = (n + 1 if n < 3 else 0) if space.left else n - 1
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


HANDLED = {
    "a float that is not finite": ("var d : length = 0 m", "d = ahead"),
    "a whole number of more than 63 bits": ("var n : int = 1", "n *= 1000"),
    "a signal and one more": ("var n : int = 0", "n = steps, n += 1"),
    "a duration below zero": ("var d : time = 1 s", "d -= 1 s"),
}


@pytest.mark.parametrize(("variable", "action"), HANDLED.values(), ids=HANDLED)
def test_what_handles_a_failing_action_is_not_taken_to_be_unreachable(status_of, variable, action):
    text = f"""
        property p : never in(c)
        event go
        {variable}
        state a
            on go / {action}
            when space.left -> b
            on fault -> c
        state b
            after {"d" if "time" in variable else "1 s"} -> a
            on fault -> c
        state c
    """
    assert status_of(text) is not Status.PROVED


@pytest.mark.parametrize("text", TRUE_CLAIMS.values(), ids=TRUE_CLAIMS)
def test_a_true_claim_is_proved(status_of, text):
    assert status_of(text) is Status.PROVED


UNSAFE_CLAIMS = {
    "an event in the first step": """
        property p : never in(c)
        event go
        state a
            on go     -> c
            when true -> b
        state b
        state c
    """,
    "half a microsecond, which stamps near today's date do not resolve": """
        property p : never in(s3) and in(early)
        initial both
        parallel both
            state one
                initial s0
                state s0
                    after 1 s -> s1
                state s1
                    after 1 s -> s2
                state s2
                    after 1 s -> s3
                state s3
            state two
                initial early
                state early
                    after 2.9999995 s -> late
                state late
    """,
}


@pytest.mark.parametrize("text", UNSAFE_CLAIMS.values(), ids=UNSAFE_CLAIMS)
def test_what_holds_of_scenarios_alone_is_not_proved(status_of, text):
    assert status_of(text) is Status.UNDECIDED


def test_what_hangs_on_half_a_microsecond_can_be_violated_near_today_s_date(machine_of):
    machine = scripted_machine(machine_of(next(text for name, text in UNSAFE_CLAIMS.items() if "today" in name)))
    script = Script({})
    begin = 1_800_000_000.0
    early = 2 * math.ulp(begin)
    run = machine.start(facts=script, time=begin)
    monitor = Monitor(run)
    times = [count / 10 - (count // 10) * early for count in range(31)]
    seen = [one for time in times for one in monitor.look(script, run.step(begin + time, (), script))]
    assert [one.property.name for one in seen] == ["p"]


def test_what_a_verdict_rests_on_is_said(machine_of):
    model = machine_of("""
        event go
        var n : int = 0
        var m : int = 0
        state a
            on go / n += 1, m = 3
    """).model
    told = "\n".join(Assumptions().lines(model))
    assert "fewer than 2^32 changes of n: no overflow" in told
    assert "stamps below 2^32 s" in told
    assert "not while it is stopped" in told


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


def test_a_step_with_too_many_distinctions_is_not_decided(machine_of):
    """Ten sums of unknown signals are compared; that ends by count, not by the clock."""
    machine = machine_of(
        """
        property few : always w <= 3
        property near : always d <= 1 m
        event x
        var d : length = 0 m
        var w : int = 0
        initial a
        state a
            on x if d < 1 m -> a / d += 0.1 m, w = w + steps
            on x -> a / d = 0 m
        """
    )
    verdicts = verdicts_of(machine)
    assert verdicts["near"].status is Status.VIOLATED
    assert verdicts["few"].status is Status.UNDECIDED
    assert "distinctions" in verdicts["few"].reason


def test_a_bound_is_called_a_bound(machine_of):
    machine = machine_of(TRUE_CLAIMS["the order of two conditions"])
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
    for tick in range(10):
        assert not monitor.look(script, run.step(tick / 10, (), script))
    script.signals = {"space.left": True}
    found = monitor.look(script, run.step(time, (), script))
    assert [one.property.name for one in found if not one.assumed] == ["p"] * violated


# Strong.


@pytest.mark.parametrize("name", NAMES)
def test_all_properties_of_shipped_machines_are_proved(name):
    verdicts = check(Machine(load_model(shipped_machines()[name], robot_library())))
    assert [str(one) for one in verdicts if not one.proved] == []
    assert {one.method for one in verdicts} <= set(Method)


@pytest.mark.parametrize("seed", [0, 1, 2, 3, 4, 7, 9, 10, 11, 13])
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
    assert "state c is not entered: impossible: proved for all runs" in told
    scenarios = (tmp_path / "dead.maze-test").read_text(encoding="utf-8").partition("test dead\n")[2]
    status, told = run_test(DEAD_END, scenarios, "--fail-under", 100)
    assert status == 0, told
    assert "c never entered: proved unreachable" in told
    status, told = run_test(DEAD_END, "scenario short\n    expect a\n", "--fail-under", 100)
    assert status == 1, told


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--generate", "--fail-under", 100), "--generate excludes --fail-under"),
        (("--generate", "--mutate"), "--generate excludes --mutate"),
        (("--mutate", "--require", "proved"), "--mutate excludes --require"),
        (("--mutate", "--coverage", "--no-nan"), "--mutate excludes --no-nan, --coverage"),
        (("--fail-under", "nan"), "--fail-under"),
        (("--fail-under", -5), "--fail-under"),
        (("--fail-under", 101), "--fail-under"),
    ],
)
def test_a_gate_that_would_have_no_effect_is_refused(run_test, options, words):
    status, told = run_test(DEAD_END, "scenario short\n    expect a\n", *options)
    assert status != 0
    assert words in told


def test_gates_do_not_pass_by_accident(run_test):
    status, told = run_test(DEAD_END, None, "--coverage", "--fail-under", 1)
    assert status != 0
    assert "there are none beside the machine" in told
    status, told = run_test(DEAD_END, "scenario wrong\n    expect c\n", "--mutate")
    assert status != 0
    assert "these fail on the machine itself" in told


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("other", "tets dead\nscenario s\n    expect a\n", "did you mean `test`?"),
        ("other", "test daed\nscenario s\n    expect a\n", "did you mean `dead`?"),
        ("other", "# nothing yet\n", "the first line must be `test`"),
        ("other", "test dead\n", "there is no scenario below this line"),
        ("dead", "test living\nscenario s\n    expect a\n", "its scenarios are about `living`"),
    ],
)
def test_scenarios_that_would_not_run_are_an_error(run_test, tmp_path, name, text, words):
    (tmp_path / "living.maze-machine").write_text("machine living\nstate a\n", encoding="utf-8")
    (tmp_path / "more.maze-test").write_text("test dead\nscenario good\n    expect a\n", encoding="utf-8")
    (tmp_path / "living.maze-test").write_text("test living\nscenario good\n    expect a\n", encoding="utf-8")
    status, told = run_test(DEAD_END, None, "--fail-under", 1)
    assert status == 0, told
    (tmp_path / f"{name}.maze-test").write_text(text, encoding="utf-8")
    told = CliRunner().invoke(app, ["test", "dead.maze-machine", "--fail-under", "1"])
    assert told.exit_code == 3
    assert f"{name}.maze-test:" in told.output
    assert words in told.output


def test_a_caller_says_what_it_relies_on(run_test):
    claim = DEAD_END.replace("\nstate a\n", "\nproperty p : never in(c)\n\nstate a\n", 1)
    claim = claim.replace(
        "-> a\n", "-> d\n\nstate d\n    when space.left -> e\n\nstate e\n    when not space.left -> a\n"
    )
    assert run_test(claim, None, "--require", "proved")[0] == 0
    status, told = run_test(claim, None, "--require", "proved", "--depth", 1)
    assert status == 1
    assert "required: proved; not met by" in told
    status, told = run_test(claim, None, "--require", "bounded", "--depth", 1)
    assert status == 0
    assert "passed  p" not in told
    assert "at most 0.1 s after the last" in told
