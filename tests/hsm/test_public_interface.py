"""What Python programs import from ``hsm``: typed, checked, and the same as what the command line does."""

import inspect
import json
import math
import re
import shutil
import subprocess
import sys
from collections import deque
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import hsm
from tests.hsm.typed import lamp
from tests.hsm.typed.lamp import TEXT, Light, Mode, Room, library

ROOT = Path(__file__).parents[2]
DARK, BRIGHT = Room(dark=True, distance=9.0), Room(dark=False, distance=9.0)
PARAMETERS = """\
machine typed

param count : int   = 3
param far   : length = 2 m
param armed : bool  = false
param side  : Mode  = dim
param share : number

initial only

state only
    on knock if armed and count > 0 and side == dim and near(far) and share > 0 -> over

final over
"""


@pytest.fixture
def machine():
    return hsm.loads(TEXT, library, "lamp.maze-machine")


def checked(path):
    command = [
        sys.executable,
        "-m",
        "mypy",
        "--strict",
        "--explicit-package-bases",
        "--no-error-summary",
        "--show-error-codes",
        str(path),
    ]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)


def test_a_typed_program_passes_a_strict_type_checker_and_runs():
    done = checked("tests/hsm/typed/lamp.py")
    assert (done.returncode, done.stdout) == (0, "")
    assert lamp.main() == 5.0


def test_a_type_checker_finds_wrong_facts_effects_and_times():
    lines = (ROOT / "tests/hsm/typed/mistakes.py").read_text().splitlines()
    marked = [number for number, line in enumerate(lines, 1) if "  # " in line]
    found = {
        int(number)
        for number in re.findall(r"mistakes\.py:(\d+): error", checked("tests/hsm/typed/mistakes.py").stdout)
    }
    assert sorted(found) == marked


def test_pyright_says_the_same(tmp_path):
    typed, site = Path("tests/hsm/typed"), Path(np.__file__).parents[1]
    settings = {"include": ["."], "extraPaths": [str(ROOT), str(site)], "typeCheckingMode": "strict"}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings))
    for name in ("lamp.py", "mistakes.py"):
        shutil.copy(ROOT / typed / name, tmp_path)
    done = subprocess.run(
        [sys.executable, "-m", "basedpyright", "--outputjson"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    found = json.loads(done.stdout)["generalDiagnostics"]
    places = {(Path(one["file"]).name, one["range"]["start"]["line"] + 1) for one in found}
    assert {name for name, _ in places} == {"mistakes.py"}
    assert len(places) == len([line for line in (tmp_path / "mistakes.py").read_text().splitlines() if "  # " in line])


def test_everything_public_is_documented_and_typed():
    for name in hsm.__all__:
        one = getattr(hsm, name)
        if not (inspect.isclass(one) or inspect.isfunction(one)):
            continue
        assert inspect.getdoc(one), name
        if inspect.isfunction(one):
            assert set(inspect.signature(one).parameters) <= set(one.__annotations__), name


def test_a_machine_comes_from_a_text_or_from_a_file(tmp_path, machine):
    path = tmp_path / "lamp.maze-machine"
    path.write_text(TEXT)
    assert hsm.load(path, library).model == hsm.loads(TEXT, library, str(path)).model
    assert machine.start(facts=BRIGHT).configuration == {"off"}


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: hsm.loads(b"machine a\n", library), "the text of a machine is a str, not bytes"),
        (lambda: hsm.loads(TEXT, "lamp"), "the library of a machine is a Library, not str"),
        (lambda: hsm.load(3, library), "the path of a machine is a str, not int"),
        (lambda: hsm.load("lamp.maze-machine", None), "the library of a machine is a Library, not NoneType"),
        (lambda: hsm.loads(TEXT, library, 3), "the file name of a machine is a str, not int"),
        (lambda: hsm.build(None), "a machine is built from a Model, not from None (NoneType)"),
        (lambda: hsm.to_transitions("lamp"), "what is converted is a Machine, not str"),
        (lambda: hsm.transition(None, {}, hsm.Inputs(1.0)), "a transition is of a Machine, not of None (NoneType)"),
        (lambda: hsm.transition(hsm.loads(TEXT, library), {}, 3), "the inputs of a transition are Inputs, not 3 (int)"),
        (
            lambda: hsm.transition(hsm.loads(TEXT, library), {}, hsm.Inputs(1.0, outcomes=["on"])),
            "outcomes are a mapping from states to outcomes, not ['on'] (list)",
        ),
        (lambda: hsm.loads(TEXT, library).start(["armed"]), "parameters are given as a mapping from names to values"),
        (lambda: hsm.loads(TEXT, library).start("armed=1"), "parameters are given as a mapping from names to values"),
    ],
)
def test_a_wrong_argument_is_named(call, words):
    with pytest.raises(TypeError, match=re.escape(words)):
        call()


@pytest.mark.parametrize("text", ["machine bad\n\nstate a\n    when nothing -> b\n", ""])
def test_a_wrong_text_raises_all_its_diagnostics(text):
    with pytest.raises(hsm.MachineError) as raised:
        hsm.loads(text, library)
    assert raised.value.diagnostics
    assert all(isinstance(one, hsm.Diagnostic) for one in raised.value.diagnostics)


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        ({"count": 2.5}, TypeError, "`count` of machine typed is a whole number, not 2.5 (float)"),
        ({"count": True}, TypeError, "a whole number"),
        ({"count": "3"}, TypeError, "not '3' (str)"),
        ({"far": "2 m"}, TypeError, "its length in m, not '2 m' (str)"),
        ({"far": None}, TypeError, "(NoneType)"),
        ({"far": False}, TypeError, "(bool)"),
        ({"armed": 1}, TypeError, "true or false"),
        ({"side": "left"}, TypeError, "a Mode (dim, bright)"),
        ({"share": math.nan}, ValueError, "cannot hold nan"),
        ({"share": math.inf}, ValueError, "cannot hold inf"),
        ({"share": 10**400}, ValueError, "cannot hold 1000000"),
        ({"count": 10**5000}, ValueError, "cannot hold a number that is too large (int) in its parameter `count`"),
        ({"count": 2**63}, ValueError, "cannot hold"),
        ({"colour": 1}, ValueError, "has no parameter `colour`; its parameters: count, far, armed, side, share"),
        ({"share": ...}, TypeError, "a number, not Ellipsis"),
    ],
)
def test_parameters_given_from_python_are_checked(given, error, words):
    with pytest.raises(error, match=re.escape(words)):
        hsm.loads(PARAMETERS, library).start({"share": 0.5, **given}, facts=BRIGHT)


def test_a_missing_parameter_is_named():
    with pytest.raises(ValueError, match="needs a value for its parameter `share`"):
        hsm.loads(PARAMETERS, library).start(facts=BRIGHT)


def test_parameters_may_be_any_numbers_of_the_right_kind():
    given = {"count": np.int64(4), "far": np.float32(0.5), "share": 1, "side": "bright"}
    values = hsm.loads(PARAMETERS, library).start(given, facts=BRIGHT).variables
    assert values == {"count": 4, "far": 0.5, "armed": False, "side": Mode.BRIGHT, "share": 1.0}
    assert [type(values[name]) for name in ("count", "far", "side", "share")] == [int, float, Mode, float]


@pytest.mark.parametrize(
    ("time", "error", "words"),
    [
        (math.nan, ValueError, "not nan"),
        (math.inf, ValueError, "not inf"),
        (-1.0, ValueError, "time runs backwards"),
        ("1", TypeError, "not '1' (str)"),
        (None, TypeError, "not None (NoneType)"),
        (True, TypeError, "not True (bool)"),
        (10**400, ValueError, "a finite number of seconds, not 1000000"),
        pytest.param(10**5000, ValueError, "seconds, not a number that is too large", id="digits"),
    ],
)
def test_times_are_checked_and_nothing_has_changed(time, error, words, machine):
    run = machine.start(facts=BRIGHT)
    before = run.snapshot()
    for step in (
        run.step,
        lambda time, events, facts: hsm.transition(machine, before, hsm.Inputs(time, events, {}, facts)),
    ):
        with pytest.raises(error, match=re.escape(words)):
            step(time, (), BRIGHT)
    assert run.snapshot() == before
    if not isinstance(time, float) or not math.isfinite(time):
        with pytest.raises(error, match=re.escape(words)):
            machine.start(facts=BRIGHT, time=time)


def test_a_time_of_any_kind_of_number_is_a_float_for_the_machine(machine):
    run = machine.start(facts=BRIGHT, time=np.int64(1))
    for time in (2, np.float32(2.5), np.float64(3.0), Fraction(7, 2)):
        step = run.step(time, facts=BRIGHT)
        assert type(run.time) is type(step.time) is float
        assert run.time == float(time)


@pytest.mark.parametrize(
    ("events", "error", "words"),
    [
        ("knock", TypeError, "events are a list of names: ['knock'], not 'knock'"),
        (["ring"], ValueError, "no event `ring` is declared for machine lamp; its events: knock"),
        (["knock", "k"], ValueError, "no event `k` is declared"),
        (DARK, TypeError, "events are a list of names, not Room("),
        ([7], TypeError, "an event is a text or an Occurrence, not 7 (int)"),
        ({"knock"}, TypeError, "events are a list of names, not {'knock'} (set)"),
        ({"knock": 1}, TypeError, "events are a list of names, not {'knock': 1} (dict)"),
        (b"knock", TypeError, "events are a list of names, not b'knock' (bytes)"),
        ([hsm.Occurrence(3)], TypeError, "the name of an event is a text, not 3 (int)"),
        ([hsm.Occurrence("knock", 3)], TypeError, "the data of event `knock` is a mapping from names to values, not 3"),
    ],
)
def test_events_are_checked_and_nothing_has_changed(events, error, words, machine):
    run = machine.start(facts=BRIGHT)
    before = run.snapshot()
    for time in (0.1, 0.0, 5.0):
        with pytest.raises(error, match=re.escape(words)):
            run.step(time, events, DARK)
    with pytest.raises(error, match=re.escape(words)):
        hsm.transition(machine, before, hsm.Inputs(0.1, events, facts=DARK))
    assert run.snapshot() == before


@pytest.mark.parametrize("kind", [tuple, iter, np.array, deque])
def test_events_may_be_given_in_any_order_that_is_one(kind, machine):
    run = machine.start({"patience": 1.0}, facts=BRIGHT)
    assert run.step(0.1, kind(["knock"]), DARK) == machine.start({"patience": 1.0}, facts=BRIGHT).step(
        0.1, ["knock"], DARK
    )


def no_tick(own):
    own.activity("idle")(Room)


@pytest.mark.parametrize(
    ("declare", "words"),
    [
        (lambda own: own.signal("near by")(lamp.near), "'near by' cannot be a name"),
        (lambda own: own.signal(3)(lamp.near), "3 cannot be a name"),
        (lambda own: own.event(""), "'' cannot be a name"),
        (lambda own: own.signal("near")(lambda facts: True), "`near`: the signal's function has no annotation"),
        (lambda own: own.action("ring")(lambda facts, times: None), "its argument `times` has no annotation"),
        (lambda own: own.action("ring")(None), "`ring`: None is neither a function nor a class"),
        (lambda own: own.activity("shine", outcomes="dark")(lamp.Shine), "outcomes are a list of names"),
        (lambda own: own.activity("shine", outcomes=3)(lamp.Shine), "outcomes are a list of names"),
        (lambda own: own.activity("shine", holds=("a bulb",))(lamp.Shine), "holds are a list of names"),
        (no_tick, "`idle`: the class Room has no method `tick`"),
        (lambda own: own.event("go", data=["floor"]), "the data of an event is a mapping from names to types"),
    ],
)
def test_a_wrong_declaration_is_named(declare, words):
    with pytest.raises(hsm.RegistryError, match=re.escape(words)):
        declare(hsm.Library("own"))


def test_charts_that_declare_no_events_may_be_sent_any():
    chart = hsm.build(hsm.scxml.read_text('<scxml><state id="a"><transition event="go.*" target="a"/></state></scxml>'))
    assert chart.start().step(0.0, ["go.on", "anything"]).ignored == ("anything",)


def test_a_transition_is_a_step_of_a_restored_run_and_changes_nothing(machine):
    run = machine.start(facts=BRIGHT)
    snapshot, time = json.loads(json.dumps(run.snapshot())), 0.0
    before = json.dumps(snapshot)
    inputs = hsm.Inputs(0.1, ["knock"], facts=DARK)
    first = hsm.transition(machine, snapshot, inputs)
    assert first == hsm.transition(machine, snapshot, inputs)
    assert json.dumps(snapshot) == before
    for events, facts in [((), BRIGHT), (("knock",), DARK), ((), DARK), (("knock",), BRIGHT), ((), BRIGHT)] * 3:
        time += 0.7
        restored = machine.restore(snapshot)
        step = restored.step(time, events, facts)
        snapshot, same = hsm.transition(machine, snapshot, hsm.Inputs(time, events, facts=facts))
        assert same == step
        assert same.considered == step.considered
        assert snapshot == restored.snapshot()


def test_a_transition_is_told_how_activities_ended(machine):
    run = machine.start(facts=BRIGHT)
    run.step(0.1, ["knock"], DARK)
    after, step = hsm.transition(machine, run.snapshot(), hsm.Inputs(0.2, outcomes={"on": "burnt_out"}, facts=BRIGHT))
    assert (step.exited, step.entered) == (("on",), ("off",))
    assert [one.action.name for one in step.actions] == ["ring"]
    assert run.configuration == {"on"}
    for outcomes, words in [({"off": "burnt_out"}, "no activity runs in state `off`"), ({"on": "done"}, "burnt_out")]:
        with pytest.raises(ValueError, match=words):
            hsm.transition(machine, run.snapshot(), hsm.Inputs(0.2, outcomes=outcomes, facts=BRIGHT))
    with pytest.raises(ValueError, match="no activity runs in state `on`"):
        hsm.transition(machine, after, hsm.Inputs(0.3, outcomes={"on": "burnt_out"}, facts=BRIGHT))


def test_an_effect_is_what_the_activity_gave(machine):
    run = machine.start(facts=BRIGHT)
    run.step(0.1, ["knock"], DARK)
    assert run.act(DARK) == [("on", Light(5.0))]
