"""The language's words beyond the plain three triggers, each with its meaning and its mistakes."""

import json

import pytest

import hsm
from hsm.dsl import check_text
from hsm.dsl.format.formatter import format_text
from hsm.dsl.syntax.lexer import IN_PLACE
from hsm.model.chart import Else, Every, Held
from hsm.model.unparse import action_text, trigger_text
from hsm.testing.generation.generating import generate

LIBRARY = hsm.Library("words")
BROKEN = OSError("no data")


@LIBRARY.signal("near")
def near(facts: object) -> bool:
    """What the test says."""
    if facts is BROKEN:
        raise BROKEN
    return bool(facts)


@LIBRARY.signal("ahead")
def ahead(facts: object) -> float:
    """What the test says."""
    return float(facts)


def model(text):
    checked = check_text(text, LIBRARY, "words.maze-machine")
    assert checked.model is not None, checked.diagnostics
    return checked.model


def start(text, **options):
    return hsm.build(model(text)).start(**options)


def codes(text):
    return [one.code for one in check_text(text, LIBRARY, "words.maze-machine").diagnostics]


# Definitions.

DEFINED = """machine m
var left : bool = true
define open_hand = (left == true and near) or calm
define calm = not near and count < most
define most = 2 + 1
var count : int = 0
state a
    when open_hand -> b
state b
    stay
"""


def test_a_definition_stands_for_its_expression():
    run = start(DEFINED)
    run.step(0.1, (), False)
    assert run.configuration == {"b"}
    assert trigger_text(run.machine.model.transitions[0].trigger) == (
        "when left == true and near or not near and count < 3"
    )


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("define x = y\ndefine y = x", "E0202"),
        ("define near = true", "E0211"),
        ("define in = true", "E0211"),
        ("define x = nowhere", "E0202"),
        ("define x = 1 + true", "E0302"),
        ("define a1 = true", "W0606"),
        ("define x = true\ndefine x = false", "E0209"),
        ("define a = true", "E0209"),
    ],
)
def test_mistakes_in_definitions(line, code):
    assert code in codes(
        f"machine m\n{line}\nvar y2 : int = 0\nstate a\n    when {'x' if 'x' in line else 'near'} -> b\nfinal b"
    )


def test_definitions_that_double_each_other_end():
    lines = ["define d0 = near and near"] + [f"define d{n} = d{n - 1} and d{n - 1}" for n in range(1, 40)]
    text = "machine m\n" + "\n".join(lines) + "\nstate a\n    when d39 -> b\nfinal b"
    assert "E0106" in codes(text)


# Else.

TABLE = "machine m\nvar n : int = 0\nstate a\n    when near if n > 0 -> b\n    when ahead > 2.0 -> c\n    else -> d\n"
TABLE += "final b\nfinal c\nfinal d\n"


@pytest.mark.parametrize(("value", "outcome"), [(0.0, "d"), (1.0, "d"), (3.0, "c")])
def test_else_is_the_remaining_case(value, outcome):
    run = start(TABLE)
    run.step(0.1, (), value)
    assert run.outcome == outcome
    assert isinstance(run.machine.model.transitions[2].trigger, Else)
    assert trigger_text(run.machine.model.transitions[2].trigger) == "else"


def test_else_leaves_no_gap_and_no_overlap():
    found = codes("machine m\nstate a\n    when near and ahead > 1.0 -> b\n    else -> c\nfinal b\nfinal c")
    assert found == []


def test_a_when_below_else_never_fires_and_else_needs_a_when():
    assert "W0503" in codes(
        "machine m\nstate a\n    when near -> b\n    else -> c\n    when ahead > 1.0 -> b\nfinal b\nfinal c"
    )
    assert "E0402" in codes("machine m\nevent go\nstate a\n    on go -> b\n    else -> b\nfinal b")


# Enumerations.

ENUMERATED = """machine m
enum Mode = slow, fast
event go
param first : Mode = slow
var mode : Mode = fast
state a
    on go if mode == fast -> a / mode = first
    on go -> b
final b
"""


def test_an_enumeration_of_ones_own():
    run = start(ENUMERATED)
    run.step(0.1, ["go"])
    assert run.variables["mode"] == "slow"
    other = run.machine.restore(json.loads(json.dumps(run.snapshot())))
    other.step(0.2, ["go"])
    assert other.outcome == "b"
    assert start(ENUMERATED, parameters={"first": "fast"}).variables["first"] == "fast"


def test_an_enumeration_of_an_imported_machine(tmp_path):
    inner = (
        "machine inner\nenum Pace = slow, fast\nparam pace : Pace = slow\nstate i\n    when pace == fast -> f\nfinal f"
    )
    (tmp_path / "inner.maze-machine").write_text(inner)
    outer = "machine m\nimport inner\nstate d = inner(pace = fast)\n    on f -> over\nfinal over"
    (tmp_path / "outer.maze-machine").write_text(outer)
    run = hsm.load(tmp_path / "outer.maze-machine", LIBRARY).start()
    run.step(0.1)
    assert run.outcome == "over"


@pytest.mark.parametrize(
    ("line", "code"),
    [("enum Mode = slow, slow", "E0209"), ("enum Mode = near", "E0211"), ("enum Mode = slow\nenum Mode = b", "E0209")],
)
def test_mistakes_in_enumerations(line, code):
    assert code in codes(f"machine m\n{line}\nvar x : Mode = slow\nstate a\n    when x == slow -> b\nfinal b")


def test_a_value_that_an_enumeration_does_not_have():
    found = check_text(ENUMERATED.replace("mode == fast", "mode == fsat"), LIBRARY).diagnostics
    assert [(one.code, one.suggestion) for one in found if one.code[0] == "E"] == [("E0202", "did you mean `fast`?")]


# Any event.


def test_any_event_from_outside_or_raised_but_no_outcome():
    text = "machine m\nevent go, stop\nvar n : int = 0\nstate a\n    on go -> b / raise later\n    on * / n += 1\n"
    text += "state b\n    state b1\n        when near -> f\n    final f\n    on f / n += 100\n    on * / n += 10\n"
    run = start(text)
    run.step(0.1, ["stop"], False)
    assert run.variables["n"] == 1
    run.step(0.2, ["go"], False)
    assert run.variables["n"] == 11  # `later` was raised
    run.step(0.3, ["stop"], True)
    assert run.variables["n"] == 121


# Raised later.

LATER = "machine m\nevent go, no\nstate a\n    on go / raise tired after 2 s\n    on no / cancel tired\n"
LATER += "    on tired -> b\nfinal b\n"


def test_an_event_is_raised_later_and_can_be_cancelled():
    run = start(LATER)
    run.step(1.0, ["go"])
    run.step(2.9)
    assert run.configuration == {"a"}
    restored = run.machine.restore(json.loads(json.dumps(run.snapshot())))
    for one in (run, restored):
        one.step(3.0)
        assert one.outcome == "b"
    run = start(LATER)
    run.step(1.0, ["go"])
    run.step(2.0, ["no"])
    run.step(9.0)
    assert run.configuration == {"a"}
    texts = [action_text(action) for one in run.machine.model.transitions for action in one.actions]
    assert texts == ["raise tired after 2 s", "cancel tired"]


def test_mistakes_in_raising_later():
    assert "E0203" in codes(LATER.replace("cancel tired", "cancel tried"))
    assert "E0307" in codes(LATER.replace("2 s", "-2 s"))
    assert "E0303" in codes(LATER.replace("event go, no", "event go, no\nparam p : time = 1 s").replace("2 s", "p"))
    assert "E0301" in codes(LATER.replace("2 s", "2 m"))


# Every.


def test_every_repeats_without_drift_whatever_the_ticks_are():
    run = start("machine m\nvar n : int = 0\nstate a\n    every 0.3 s / n += 1", time=1732740000.0)
    for tick in range(1, 601):
        run.step(1732740000.0 + tick / 10)
    assert run.variables["n"] == 200


def test_every_comes_once_in_a_long_step_and_keeps_its_beat():
    run = start("machine m\nvar n : int = 0\nstate a\n    every 1 s / n += 1")
    seen = []
    for time in (0.9, 1.0, 3.5, 3.9, 4.0):
        run.step(time)
        seen.append(run.variables["n"])
    assert seen == [0, 1, 2, 2, 3]


def test_every_with_a_guard_or_a_target():
    run = start("machine m\nvar n : int = 0\nstate a\n    every 1 s if near / n += 1")
    for time, value in ((1.0, False), (1.2, True), (1.9, True), (2.0, True)):
        run.step(time, (), value)
    assert run.variables["n"] == 2
    run = start("machine m\nstate a\n    every 1 s -> b\nstate b\n    every 2 s -> a")
    for time in (1.0, 2.9, 3.0):
        run.step(time)
    assert run.configuration == {"a"}


def test_every_zero_is_refused():
    assert "E0307" in codes("machine m\nvar n : int = 0\nstate a\n    every 0 s / n += 1")
    with pytest.raises(hsm.MachineFault, match="a nanosecond or more"):
        start("machine m\nparam p : time = 0 s\nvar n : int = 0\nstate a\n    every p / n += 1")


# A condition that holds for some time.

HELD = "machine m\nvar n : int = 0\nstate a\n    when near for 0.5 s -> b\nfinal b\n"


@pytest.mark.parametrize(
    ("values", "end"),
    [
        ([True] * 5, None),
        ([True] * 6, 0.6),
        ([True, True, False] * 4, None),
        ([False, True, True, True, True, True, True], 0.7),
        ([True] * 5 + [False] + [True] * 5, None),
    ],
)
def test_a_condition_must_hold_all_the_time(values, end):
    run, ended = start(HELD), None
    for tick, value in enumerate(values, 1):
        run = run.machine.restore(json.loads(json.dumps(run.snapshot())))
        run.step(tick / 10, (), value)
        if run.outcome and ended is None:
            ended = tick / 10
    assert ended == end


def test_without_a_target_it_acts_once_for_each_time_that_it_holds():
    run = start("machine m\nvar n : int = 0\nstate a\n    when near for 0.2 s / n += 1")
    for tick in range(1, 10):
        run.step(tick / 10, (), True)
    assert run.variables["n"] == 1
    run.step(1.0, (), False)
    for tick in range(11, 20):
        run.step(tick / 10, (), True)
    assert run.variables["n"] == 2


def test_leaving_the_state_forgets_how_long_it_held():
    text = "machine m\nevent out\nstate a\n    when near for 0.5 s -> b\n    on out -> a\nfinal b\n"
    run = start(text)
    for tick in range(1, 20):
        run.step(tick / 10, ["out"] if tick % 4 == 0 else [], True)
    assert run.outcome is None


def test_a_signal_that_fails_while_it_is_watched_is_a_fault():
    run = start(HELD.replace("-> b\n", "-> b\n    on fault -> c\n") + "final c")
    run.step(0.1, (), BROKEN)
    assert run.outcome == "c"
    with pytest.raises(hsm.MachineFault, match="signal `near` failed"):
        start(HELD).step(0.1, (), BROKEN)


def test_what_is_due_is_explained():
    run = start(HELD)
    step = run.step(0.1, (), True)
    assert str(step.considered[0]).endswith("it was not due: 0.5 s to go")


# All of them together.

ALL = """machine everything

enum Mode = slow, fast

event go, stop

param wait : time = 2 s

var mode : Mode = slow
var n    : int  = 0

define eager = mode == fast and near

initial a

state a
    on go                   -> a / mode = fast, raise tired after 3 s
    on stop, tired          -> b / cancel tired
    on *                    / n += 1
    when eager for wait     -> b
    when ahead > 2.0        -> b
    else                    / mode = slow, n = 2
    every 2 s if near       / n += 1

final b
"""


def test_the_formatter_keeps_and_aligns_them():
    once = format_text(ALL)
    assert format_text(once) == once
    assert [type(one.trigger) for one in model(once).transitions] == [
        type(one.trigger) for one in model(ALL).transitions
    ]


def test_words_are_keywords_only_where_they_mean_something():
    text = "machine m\nevent every, define\nvar cancel : int = 0\nvar for : int = 0\nstate after\n"
    text += "    on every -> enum / cancel = for + 1, for = cancel\n    when for > 3 for 2 s -> enum\nfinal enum\n"
    assert [type(one.trigger) for one in model(text).transitions][1] is Held
    assert isinstance(
        model("machine m\nvar n : int = 0\nstate a\n    every 1 s / n += 1").transitions[0].trigger, Every
    )


def test_they_are_explored_and_tests_are_generated_for_them():
    text = "machine m\nenum Pace = slow, fast\nevent go, other\nvar pace : Pace = slow\nvar n : int = 0\nstate a\n"
    text += "    on go -> b / pace = fast\n    on * if n < 1 / n += 1\n    when near for 0.5 s if n > 0 -> c\n"
    text += "    every 2 s if n < 2 / n += 1\nstate b\n    when near if pace == slow -> a\n    else -> c\nfinal c\n"
    found = generate(hsm.build(model(text)), steps=4000)
    missed = [one.text for one in found.unreached]
    assert not any("is not taken" in one and "when near if" not in one for one in missed), missed
    assert found.scenarios


# Words that are keywords in places only.


def as_names(word):
    """A machine in which a word is the name of an event, a variable or a state, wherever such a name can be."""
    return (
        f"machine m\nevent go, {word}\nstate a\n"
        f"    on go, {word} if near -> b / raise {word} after 3 s, cancel {word}\n"
        f"    on go / raise {word}, send {word}\nstate b\n    on {word} -> a\n    defer go, {word} if near\n",
        f"machine m\nvar {word} : bool = true\nexpose {word}\nproperty one : never {word}\n"
        f"property two : after {word}, (near and {word}) before not {word}\n"
        f"state a\n    when {word} for 2 s -> a / {word} = {word}\n"
        f"    when near if {word} / {word} = {word} == near, {word} = true\n    stay when {word}\n",
        f"machine m\nproperty one : never in({word}) and (near or in({word}))\n"
        f"state {word}\n    when near for 1 s -> {word}\n"
        f"    when ahead > (1.0 if near\n        else 2.0) -> {word}\n",
    )


@pytest.mark.parametrize("word", sorted(IN_PLACE))
def test_a_word_that_is_a_keyword_in_places_is_a_name_elsewhere(word):
    for text in as_names(word):
        checked = check_text(text, LIBRARY, "words.maze-machine")
        assert checked.model is not None, checked.diagnostics
        assert format_text(format_text(text)) == format_text(text)


def test_blanks_before_what_an_action_word_is_about_do_not_matter():
    text = "machine m\nevent go\nstate a\n    on go / raise go after 1 s, cancel   go, send    go\n"
    assert format_text(text).endswith("/ raise go after 1 s, cancel go, send go\n")


def test_a_bracket_that_is_open_where_a_line_with_else_begins_was_never_closed():
    text = "machine m\nstate a\n    when (near -> b\n    else -> b\nfinal b\n"
    assert codes(text) == ["E0104"]
