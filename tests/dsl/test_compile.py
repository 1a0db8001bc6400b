"""What a model looks like: numbering, instances, history, targets, actions."""

import itertools
from contextlib import suppress

import pytest
from hypothesis import given, settings

from hsm import Spin
from hsm.dsl import check_text, parse_model
from hsm.engine.machine import build
from hsm.model.chart import After, Assign, Call, On, Raise, StateKind, TransitionKind, When
from hsm.model.expressions import Binary, Literal, VariableValue
from hsm.model.types import INTEGER, NUMBER, Quantity
from tests.dsl.library import Junction, Side, make_library
from tests.dsl.machines_at_random import machines

LIBRARY = make_library()


def model_of(body, head="machine m\n", file="<text>"):
    return parse_model(head + body, LIBRARY, file)


def names(model, indices):
    return [model.states[index].name for index in indices]


def is_well_formed(model):
    assert [state.index for state in model.states] == list(range(len(model.states)))
    assert [one.index for one in model.transitions] == list(range(len(model.transitions)))
    assert sorted(itertools.chain(*(state.transitions for state in model.states))) == list(
        range(len(model.transitions))
    )
    assert len({state.name for state in model.states}) == len(model.states)
    assert len({one.name for one in (*model.variables, *model.parameters)}) == len(model.variables) + len(
        model.parameters
    )
    for state in model.states:
        assert all(model.transitions[number].source == state.index for number in state.transitions)
        assert list(state.children) == sorted(state.children)
        last = state.index
        for child in state.children:
            assert model.states[child].parent == state.index
            assert child == last + 1
            last = model.states[child].last
        assert state.last == last
        assert all(state.index < one <= state.last or state.kind in HISTORIES for one in state.initial)
        if state.kind is StateKind.COMPOUND:
            assert len(state.initial) == 1


HISTORIES = (StateKind.SHALLOW_HISTORY, StateKind.DEEP_HISTORY)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(machines())
def test_random_machines_are_well_formed_and_can_be_started(text):
    model = parse_model(text, LIBRARY)
    is_well_formed(model)
    with suppress(Spin):  # what is raised on entry may be raised again by what it fires
        assert build(model).start(facts=object()).configuration


@pytest.fixture
def doors(tmp_path):
    (tmp_path / "bell.maze-machine").write_text(
        "machine bell\nparam times : int = 2\nvar rung : int = 0\n"
        "state ringing\n    do ring()\n    on done if rung < times -> ringing / rung += 1\n"
        "    on done, refused -> rang\nfinal rang\n"
    )
    (tmp_path / "door.maze-machine").write_text(
        "machine door\nimport bell\nparam timeout : time = 5 s\n"
        "when exit.crossed -> gone\n"
        "state attention = bell(times = 3)\n    on rang -> waiting\n"
        "state waiting\n    after timeout -> gone\n    when in(attention.ringing) -> gone\n"
        "final gone\n"
    )
    return str(tmp_path / "m.maze-machine")


def test_instances_nest_and_keep_their_own_variables(doors):
    body = (
        "import door\nparam patience : time = 8 s\n"
        "state one = door(timeout = patience)\n    on gone -> two\n"
        "state two = door(3 s)\n    on gone -> one.history\n    after 60 s => one.deep_history\n    entry / beep()\n"
    )
    model = model_of(body, file=doors)
    is_well_formed(model)
    assert [state.name for state in model.states] == [
        "m",
        *("one", "one.attention", "one.attention.ringing", "one.attention.rang", "one.waiting", "one.gone"),
        *("one.history", "one.deep_history"),
        *("two", "two.attention", "two.attention.ringing", "two.attention.rang", "two.waiting", "two.gone"),
    ]
    assert [(one.name, names(model, [one.scope])[0], one.constant) for one in model.variables] == [
        ("one.timeout", "one", True),
        ("one.attention.times", "one.attention", True),
        ("one.attention.rung", "one.attention", False),
        ("two.timeout", "two", True),
        ("two.attention.times", "two.attention", True),
        ("two.attention.rung", "two.attention", False),
    ]
    assert isinstance(model.variables[0].initial, VariableValue)
    one, two = model.states[1], model.states[9]
    assert (one.instance, two.instance, model.states[2].instance) == ("door", "door", "bell")
    assert [model.states[index].kind for index in (7, 8)] == list(HISTORIES)
    assert names(model, model.states[7].initial) == ["one.attention"]
    assert [type(model.transitions[number].trigger) for number in two.transitions] == [When, On, After]
    assert [model.transitions[number].kind for number in two.transitions] == [
        TransitionKind.LOCAL,
        TransitionKind.LOCAL,
        TransitionKind.EXTERNAL,
    ]
    supervisor = build(model).start(facts=False)
    assert supervisor.configuration == {"one", "one.attention", "one.attention.ringing"}
    assert supervisor.variables["one.timeout"] == 8.0
    assert supervisor.variables["one.attention.times"] == 3


def test_history_is_asked_for_by_its_name():
    model = model_of("state a\n    state b\n        on bumped -> c\n    state x\nstate c\n    on bumped -> a.history\n")
    history = model.states[4]
    assert (history.name, history.kind, names(model, history.initial)) == (
        "a.history",
        StateKind.SHALLOW_HISTORY,
        ["b"],
    )
    assert names(model, model.transitions[1].targets) == ["a.history"]


def test_several_targets_in_several_regions():
    body = (
        "state s\n    on bumped -> b, d\n"
        "parallel p\n    state one\n        state a\n        state b\n    state two\n        state c\n        state d\n"
    )
    model = model_of(body)
    assert names(model, model.transitions[0].targets) == ["b", "d"]
    supervisor = build(model).start()
    supervisor.step(1.0, ["bumped"])
    assert supervisor.configuration == {"p", "one", "b", "two", "d"}


def test_transitions_at_the_top_hold_in_every_state():
    model = model_of("on bumped -> e\nentry / beep()\nstate a\n    state b\nfinal e\n")
    supervisor = build(model).start()
    supervisor.step(1.0, ["bumped"])
    assert supervisor.outcome == "e"


def test_actions():
    model = model_of(
        "var n : int = 1\nstate a\n    on bumped / n -= 1, n = n * 2, beep(times = 2), raise go\n    on go -> a\n"
    )
    subtract, double, beep, go = model.transitions[0].actions
    assert isinstance(subtract, Assign)
    assert isinstance(subtract.value, Binary)
    assert subtract.value.operator == "-"
    assert isinstance(double, Assign)
    assert isinstance(beep, Call)
    assert beep.arguments[0].value == 2
    assert isinstance(go, Raise)
    assert go.event == "go"
    supervisor = build(model).start()
    supervisor.step(1.0, ["bumped"])
    assert supervisor.variables["n"] == 0


def test_keywords_are_keywords_only_where_a_line_begins():
    model = model_of(
        "state exit\n    on bumped -> state\nstate state\n    on bumped -> when\nstate when\n    on bumped -> exit\n"
    )
    assert [state.name for state in model.states[1:]] == ["exit", "state", "when"]


def test_docs_are_the_comments_above():
    model = parse_model(
        "# The machine.\n# In two lines.\nmachine m\n\n# First.\nstate a\n\n# Not this.\n\nstate b\n", LIBRARY
    )
    assert [model.doc, *(state.doc for state in model.states[1:])] == ["The machine.\nIn two lines.", "First.", ""]


@pytest.mark.parametrize(
    ("declaration", "value", "kind"),
    [
        ("length = 50 cm", 0.5, Quantity(length=1)),
        ("time = 250 ms", 0.25, Quantity(time=1)),
        ("angle = 180 deg", 3.141592653589793, Quantity(angle=1)),
        ("turn_rate = 90 deg/s", 1.5707963267948966, Quantity(time=-1, angle=1)),
        ("frequency = 10 Hz", 10.0, Quantity(time=-1)),
        ("acceleration = 1.5 m/s^2", 1.5, Quantity(length=1, time=-2)),
        ("speed = 1 m / 2 s", 0.5, Quantity(length=1, time=-1)),
        ("length = -(1 m + 20 cm) * 2", -2.4, Quantity(length=1)),
        ("number = 3", 3.0, NUMBER),
        ("number = 1 / 4", 0.25, NUMBER),
        ("int = 2 * 3 - 1", 5, INTEGER),
        ("int = max(1, 2, min(7, 5))", 5, INTEGER),
        ("bool = true", True, None),
        ("Side = left", Side.LEFT, None),
        ("Junction = dead_end", Junction.DEAD_END, None),
    ],
)
def test_values_are_plain_si(declaration, value, kind):
    kind_name, _, written = declaration.partition(" = ")
    model = model_of(f"param p : {kind_name} = {written}\nstate a\n")
    (parameter,) = model.parameters
    assert (
        parameter.default == pytest.approx(value) if isinstance(value, float) else parameter.default is value or value
    )
    assert type(parameter.default) is type(value)
    assert kind is None or parameter.type == kind


@pytest.mark.parametrize(
    ("condition", "code"),
    [
        ("ahead < 2", "E0302"),
        ("ahead < 2 s", "E0302"),
        ("ahead + 1 m > heading", "E0302"),
        ("ahead", "E0301"),
        ("space.left and 3", "E0301"),
        ("not ahead", "E0301"),
        ("junction.kind == left", "E0202"),
        ("junction.kind < dead_end", "E0302"),
        ("junction.kind == 3", "E0302"),
        ("left == right", None),
        ("abs(space.left) > 1", "E0302"),
        ("min(ahead) > 1 m", "E0213"),
        ("ahead * ahead < 4 m", "E0302"),
        ("steps > 1.5", None),
        ("(ahead * ahead) > 4 m * 1 m", None),
        ("(ahead / 2 s) > 1 m/s", None),
        ("ahead > 2 * 30 cm", None),
        ("space.left == space.right", None),
        ("junction.kind == dead_end or dead_end == junction.kind", None),
        ("junction.kind != junction.kind", None),
        ("clear() and clear(1 m) and clear(distance = 1 m)", None),
        ("clear(2 s)", "E0301"),
        ("clear(1 m, 2 m)", "E0213"),
        ("unheard(3)", "E0202"),
        ("in(a)", None),
        ("in(nowhere)", "E0201"),
    ],
)
def test_types_and_units_of_conditions(condition, code):
    checked = check_text(f"machine m\nstate a\n    when {condition} -> b\nfinal b\n", LIBRARY, remarks=False)
    assert [one.code for one in checked.diagnostics if one.code[0] == "E"] == ([code] if code else [])


def test_a_bare_name_of_two_enumerations_is_found_by_its_type():
    assert isinstance(
        model_of("var s : Side = left\nstate a\n    when s == right -> a\n").variables[0].initial, Literal
    )


@pytest.mark.parametrize(
    "claim", ["never not (in(a) or in(b))", "always eventually (in(b)) within 10 s", "never (in(a) and (in(b)))"]
)
@pytest.mark.parametrize("end", ["", "  ", "  # (why"])
def test_the_text_of_a_property_is_its_whole_claim(claim, end):
    model = model_of(f"event e\ninitial a\nstate a\n    on e -> b\nstate b\n    on e -> a\nproperty p : {claim}{end}\n")
    assert [one.text for one in model.properties] == [claim]
