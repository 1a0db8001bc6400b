"""Charts with a data model: a safe subset of expressions, and what changes data and sends events."""

import contextlib
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsm import MachineError, SnapshotError, build
from hsm.interchange.scxml import read_file, read_text, write_text
from hsm.interchange.scxml.datamodel.ecmascript import EcmaScriptLanguage
from hsm.interchange.scxml.datamodel.expressions import DataError, Environment
from hsm.interchange.scxml.datamodel.tokens import InvalidExpressionError, UnsupportedError
from hsm.interchange.scxml.translation import to_machine_text
from hsm.model.messages import ScxmlEvent, Store

ENVIRONMENT = Environment(
    Store(
        {"x": 3, "names": ["a", "b"], "point": {"x": 1, "deep": {"y": 2}}, "none": None}, ScxmlEvent("e", data={"n": 7})
    ),
    {1},
    {"s": 1, "t": 2},
    {"_name": "chart"},
)


def value(text):
    return EcmaScriptLanguage.read(text)(ENVIRONMENT)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 + 2 * 3", 7),
        ("(1 + 2) * 3", 9),
        ("-x + 1", -2),
        ("7 % 4 / 2", 1.5),
        ("'a' + 'b' + 1", "ab1"),
        ("x == 3 && names.length === 2", True),
        ("x != 3 || !true", False),
        ("x > 2 ? 'big' : 'small'", "big"),
        ("names[1]", "b"),
        ("names[9]", None),
        ("point.deep.y", 2),
        ("point['x']", 1),
        ("[1, [2]].length", 2),
        ("{'a': 1, b: 'c'}.b", "c"),
        ("names.concat(['c'])", ["a", "b", "c"]),
        ("typeof nowhere", "undefined"),
        ("typeof x === 'number'", True),
        ("_event.name + _event.data.n", "e7"),
        ("In('s') && !In('t')", True),
        ("_name == 'chart'", True),
        ("none == null", True),
        ("'abc'.startsWith('a')", True),
        ("'x' in point", True),
        ("1 == true", True),
        ("!0", True),
        ("names instanceof Array", True),
        ("point instanceof Array", False),
        ("point instanceof Object", True),
        ("'scxml' == 'http://www.w3.org/TR/scxml/#SCXMLEventProcessor'", True),
        ("'scxml' == 'http'", False),
    ],
)
def test_what_an_expression_means(text, expected):
    assert value(text) == expected


@pytest.mark.parametrize("text", ["nowhere", "x.y", "none.y", "In('u')", "1 / 0", "'a' - 1", "names.startsWith('a')"])
def test_what_cannot_be_evaluated(text):
    with pytest.raises(DataError):
        value(text)


@pytest.mark.parametrize("text", ["1 = 1", "return", "", "(1", "1 +", "x y", "#", "a.", "'open"])
def test_what_is_no_expression(text):
    with pytest.raises(InvalidExpressionError):
        EcmaScriptLanguage.read(text)


@pytest.mark.parametrize(
    "text",
    [
        "function() {}",
        "x => x",
        "x++",
        "new Date()",
        "__import__('os')",
        "''.__class__()",
        "names.sort()",
        "eval('1')",
        "(" * 100 + "1" + ")" * 100,
    ],
)
def test_what_is_not_in_the_subset_is_refused(text):
    with pytest.raises(UnsupportedError):
        EcmaScriptLanguage.read(text)


@pytest.mark.parametrize("text", ["''.__class__", "names.__len__", "x.real", "_event.__dict__", "point.__class__"])
def test_no_object_of_the_program_is_reached(text):
    with contextlib.suppress(DataError):
        assert value(text) is None


@given(st.text(alphabet="x1'\"+-*/()[]{}.,:?!=<>&| andotrue_eventIn", max_size=30))
def test_any_text_is_an_expression_or_says_why_not(text):
    with contextlib.suppress(DataError, InvalidExpressionError, UnsupportedError):
        value(text)


def run(body, head="", model="ecmascript", until=5.0):
    text = f'<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="c" datamodel="{model}">{head}{body}'
    text += '<final id="pass"/><final id="fail"/></scxml>'
    started = build(read_text(text)).start()
    time = 0.0
    while started.outcome is None and time < until:
        time += 0.1
        started.step(time)
    return started.outcome


PASS_OR_FAIL = '<transition event="*" target="fail"/>'


def test_data_is_assigned_and_decides():
    body = (
        '<state id="a"><onentry><assign location="n" expr="n + 1"/></onentry><transition cond="n == 3" target="pass"/>'
    )
    body += '<transition target="a"/></state>'
    assert run(body, '<datamodel><data id="n" expr="0"/></datamodel>') == "pass"


def test_branches_and_loops():
    body = """<state id="a"><onentry>
      <foreach array="[1, 2, 3]" item="one" index="at">
        <if cond="one == 2"><assign location="sum" expr="sum + 10"/>
        <elseif cond="at == 2"/><assign location="sum" expr="sum + 100"/>
        <else/><assign location="sum" expr="sum + one"/></if>
      </foreach></onentry>
      <transition cond="sum == 111" target="pass"/><transition target="fail"/></state>"""
    assert run(body, '<datamodel><data id="sum" expr="0"/></datamodel>') == "pass"


def test_events_carry_data_and_come_after_a_computed_delay():
    body = """<state id="a"><onentry>
      <send eventexpr="'go' + 1" delayexpr="wait" namelist="wait"><param name="n" expr="6 * 7"/></send></onentry>
      <transition event="go1" cond="_event.data.n == 42 &amp;&amp; _event.data.wait == '1.5s'" target="pass"/>
      <transition event="*" target="fail"/></state>"""
    head = """<datamodel><data id="wait" expr="'1.5s'"/></datamodel>"""
    assert run(body, head) == "pass"
    assert run(body, head, until=1.3) is None


def test_a_completion_carries_data():
    body = """<state id="a"><state id="b"><transition target="f"/></state>
      <final id="f"><donedata><param name="n" expr="1 + 1"/></donedata></final>
      <transition event="done.state.a" cond="_event.data.n == 2" target="pass"/>
      <transition event="*" target="fail"/></state>"""
    assert run(body) == "pass"


@pytest.mark.parametrize(
    "content",
    [
        '<assign location="nowhere" expr="1"/>',
        '<assign location="_name" expr="1"/>',
        '<assign location="n" expr="nowhere"/>',
        '<assign location="n" expr="1 = 1"/>',
        '<foreach array="n" item="one"/>',
        '<send event="x" target="nonsense"/>',
        '<send event="x" type="nonsense"/>',
        '<send event="x" delayexpr="\'soon\'"/>',
        '<log expr="nowhere"/>',
    ],
)
def test_an_error_ends_its_block_and_is_an_event(content):
    body = f"""<state id="a"><onentry>{content}<raise event="after"/></onentry>
      <transition event="error.execution" target="pass"/><transition event="*" target="fail"/></state>"""
    assert run(body, '<datamodel><data id="n" expr="0"/></datamodel>') == "pass"


def test_a_condition_that_fails_does_not_hold_and_is_an_event():
    body = """<state id="a"><transition cond="nowhere" target="fail"/><transition target="b"/></state>
      <state id="b"><onentry><raise event="e"/></onentry>
      <transition event="error.execution" target="pass"/><transition event="*" target="fail"/></state>"""
    assert run(body) == "pass"


def test_what_cannot_be_reached_is_a_communication_error():
    body = """<state id="a"><onentry><send event="x" target="#_parent" id="s"/></onentry>
      <transition event="error.communication" cond="_event.sendid == 's'" target="pass"/>
      <transition event="*" target="fail"/></state>"""
    assert run(body) == "pass"


@pytest.mark.parametrize(("binding", "outcome"), [("early", "pass"), ("late", "fail")])
def test_when_data_is_set(binding, outcome):
    text = f"""<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" binding="{binding}">
      <state id="a"><transition cond="n == 1" target="pass"/><transition target="fail"/></state>
      <state id="b"><datamodel><data id="n" expr="1"/></datamodel></state>
      <final id="pass"/><final id="fail"/></scxml>"""
    assert build(read_text(text)).start().outcome == outcome


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ('<assign location="n" expr="eval(1)"/>', "the function `eval`"),
        ("<script>for (;;) {}</script>", "is not supported in a <script>"),
        ('<send event="x" type="http://www.w3.org/TR/scxml/#BasicHTTPEventProcessor"/>', "HTTP"),
    ],
)
def test_what_is_not_supported_is_refused_by_name(content, reason):
    with pytest.raises(MachineError, match=reason):
        run(f'<state id="a"><onentry>{content}</onentry></state>')


def test_an_unknown_data_model_is_refused():
    with pytest.raises(MachineError, match="the data model `xpath` is not supported"):
        run('<state id="a"/>', model="xpath")


def test_a_chart_with_data_says_what_cannot_be_done_with_it():
    text = """<scxml version="1.0" datamodel="ecmascript" name="c">
      <datamodel><data id="n" expr="0"/></datamodel><state id="a"/></scxml>"""
    model = read_text(text)
    with pytest.raises(MachineError, match="cannot be exported"):
        write_text(model)
    with pytest.raises(MachineError, match="a data model"):
        to_machine_text(model)


SAVED = """<scxml version="1.0" datamodel="ecmascript" name="c" binding="late">
  <datamodel><data id="n" expr="0"/><data id="list" expr="[]"/></datamodel>
  <state id="a">
    <datamodel><data id="local" expr="n + 100"/></datamodel>
    <transition event="add"><assign location="n" expr="n + 1"/>
      <assign location="list" expr="list.concat([n])"/></transition>
    <transition event="later"><send event="back" delay="2s"><param name="was" expr="list"/></send></transition>
    <transition event="back"><assign location="list" expr="_event.data.was"/></transition>
    <transition event="go" target="b"/>
  </state>
  <state id="b"><transition event="go" target="a"/></state></scxml>"""


@given(st.lists(st.sampled_from(["add", "later", "go", "wait"]), max_size=12), st.integers(0, 12))
def test_a_restored_run_with_data_goes_on_the_same(events, split):
    machine = build(read_text(SAVED))
    one, time = machine.start(), 0.0
    other = one
    for number, event in enumerate(events):
        if number == split:
            other = machine.restore(json.loads(json.dumps(one.snapshot())))
        time += 1.5
        for run in {id(one): one, id(other): other}.values():
            run.step(time, [] if event == "wait" else [event])
        assert one.snapshot() == other.snapshot()


def test_a_chart_that_has_changed_keeps_its_data_if_it_has_the_same():
    one = build(read_text(SAVED)).start()
    one.step(1.0, ["add", "later"])
    one.reload(build(read_text(SAVED.replace("n + 1", "n + 5"))))
    one.step(2.0, ["add"])
    assert one.snapshot()["data"]["values"]["n"] == 6
    with pytest.raises(SnapshotError, match="do not have the same data: `list`"):
        one.reload(build(read_text(SAVED.replace("list", "other"))))


def test_a_snapshot_of_a_chart_with_other_data_is_refused():
    saved = build(read_text(SAVED)).start().snapshot()
    with pytest.raises(SnapshotError, match="do not have the same data"):
        build(read_text(SAVED.replace("list", "other"))).restore(saved)


def test_a_chart_that_names_a_data_model_and_uses_none_is_as_one_without():
    text = '<scxml version="1.0" datamodel="ecmascript" name="c"><state id="a"/></scxml>'
    assert read_text(write_text(read_text(text))).states[1].name == "a"


def test_one_chart_gives_one_trace():
    text = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript" name="c">
      <datamodel><data id="n" expr="0"/></datamodel>
      <state id="a"><onentry><assign location="n" expr="n + 1"/><send event="again" delay="1s"/></onentry>
      <transition event="again" cond="n &lt; 4" target="a"/><transition event="again" target="b"/></state>
      <final id="b"/></scxml>"""
    machine = build(read_text(text))
    first, second = machine.start(), machine.start()
    for tick in range(1, 60):
        assert first.step(tick / 10) == second.step(tick / 10)
    assert first.outcome == second.outcome == "b"


@pytest.mark.parametrize(
    "body",
    [
        '<script>n = 1</script><state id="a"><transition cond="n == 1" target="pass"/></state>',
        '<datamodel><data id="n" expr="1"/></datamodel><state id="a"><transition cond="n == 1" target="pass"/></state>',
        '<state id="a"><onentry><assign location="n" expr="1"/></onentry>'
        '<transition event="error.execution" target="pass"/></state>',
        '<state id="a"><onentry><send event="go" namelist="n"/></onentry>'
        '<transition event="error.execution" target="pass"/></state>',
    ],
)
def test_a_chart_with_data_that_names_no_data_model_has_ecmascript(body):
    namespace = 'xmlns="http://www.w3.org/2005/07/scxml" version="1.0"'
    with_it, without = (
        build(read_text(f'<scxml {namespace}{model}>{body}<final id="pass"/></scxml>')).start()
        for model in (' datamodel="ecmascript"', "")
    )
    assert with_it.outcome == without.outcome == "pass"
    with pytest.raises(MachineError):
        read_text(f'<scxml {namespace} datamodel="null">{body}<final id="pass"/></scxml>')


@pytest.mark.parametrize("model", ["ecmascript", "python"])
@pytest.mark.parametrize("spelling", ["scxml", "http://www.w3.org/TR/scxml/#SCXMLEventProcessor"])
def test_both_spellings_of_the_type_of_an_event_are_equal(model, spelling):
    text = f"""<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="{model}">
      <datamodel><data id="kind" expr="0"/></datamodel>
      <state id="a"><onentry><send event="e"/></onentry>
        <transition event="e" target="b"><assign location="kind" expr="_event.origintype"/></transition></state>
      <state id="b"><transition event="on" cond="kind == '{spelling}'" target="c"/></state><final id="c"/></scxml>"""
    machine = build(read_text(text))
    run = machine.start()
    run.step(0.1)
    restored = machine.restore(run.snapshot())
    restored.step(0.2, ["on"])
    assert restored.outcome == "c"


def test_data_in_a_file_beside_the_chart(tmp_path):
    chart = tmp_path / "chart.scxml"

    def outcome(content, condition):
        (tmp_path / "data.txt").write_bytes(content)
        chart.write_text(
            f"""<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">
            <datamodel><data id="n" src="file:data.txt"/></datamodel>
            <state id="a"><transition cond="{condition}" target="pass"/></state><final id="pass"/></scxml>"""
        )
        return build(read_file(chart)).start().outcome

    assert outcome(b"[1, 2, 3]", "n instanceof Array &amp;&amp; n[2] == 3") == "pass"
    assert outcome(b"two \n words", "n == 'two words'") == "pass"
    for content, words in (
        (b"<root/>", "XML as data"),
        (b"\xff\xfe", "not text in UTF-8"),
        (b"1" * 10_001, "more than 10,000 characters"),
    ):
        with pytest.raises(MachineError, match=words):
            outcome(content, "true")
    (tmp_path / "data.txt").unlink()
    with pytest.raises(MachineError, match=r"data\.txt cannot be read"):
        read_file(chart)
