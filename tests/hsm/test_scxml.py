"""SCXML charts: those that nobody here wrote, and what is refused."""

import json
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsm import MachineError, build
from hsm.interchange import scxml

FOREIGN = Path(__file__).parents[2].parent / "shared" / "data" / "scxml"
CHARTS = sorted(FOREIGN.rglob("*.scxml")) if FOREIGN.is_dir() else []
OWN = sorted((Path(__file__).parent / "scxml").glob("*.scxml"))


def leaves(run):
    """The active atomic states."""
    states = run.machine.model.states
    parents = {states[states[run.machine.indices[name]].parent].name for name in run.configuration}
    return run.configuration - parents


@pytest.mark.parametrize("path", [*CHARTS, *OWN], ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_charts_do_what_their_scripts_say(path):
    script = json.loads(path.with_suffix(".json").read_text())
    run = scxml.load(path).start()
    assert leaves(run) == set(script["initialConfiguration"])
    time = 0.0
    for line in script["events"]:
        time += line.get("after", 0) / 1000 + 0.001
        run.step(time, [line["event"]["name"]])
        assert leaves(run) == set(line["nextConfiguration"])


def chart(body, attributes=""):
    text = f'<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" {attributes}>{body}</scxml>'
    return scxml.read_text(text, "chart.scxml")


def start(body, attributes=""):
    return build(chart(body, attributes)).start()


def test_events_match_by_the_first_parts_of_their_names():
    body = '<state id="a"><transition event="door.open error.*" target="b"/></state><state id="b"/>'
    for name, fires in [("door.open", 1), ("door.open.left", 1), ("door.opened", 0), ("error", 1), ("error.x", 1)]:
        assert bool(start(body).step(1.0, [name])) == bool(fires), name


def test_any_event():
    assert start('<state id="a"><transition event="*" target="b"/></state><state id="b"/>').step(1.0, ["x.y"])


def test_completion_has_its_standard_name():
    run = start(
        """<state id="a"><transition event="done.state.a" target="c"/>
        <state id="b"><transition event="go" target="f"/></state><final id="f"/></state><state id="c"/>"""
    )
    assert run.step(1.0, ["go"]).entered == ("f", "c")


def test_completion_of_a_parallel_state():
    run = start(
        """<parallel id="p"><transition event="done.state.p" target="c"/>
        <state id="a"><state id="a1"><transition event="x" target="a2"/></state><final id="a2"/></state>
        <state id="b"><state id="b1"><transition event="y" target="b2"/></state><final id="b2"/></state>
        </parallel><state id="c"/>"""
    )
    run.step(1.0, ["x"])
    assert "p" in run.configuration
    run.step(2.0, ["y"])
    assert run.configuration == {"c"}


def test_conditions_on_what_is_active():
    body = """<parallel id="p">
        <state id="a">
        <state id="a1"><transition event="go" target="a2" cond="In('b2') &amp;&amp; !In(&quot;c&quot;)"/></state>
        <state id="a2"/></state>
        <state id="b"><state id="b1"><transition event="next" target="b2"/></state><state id="b2"/></state></parallel>
        <state id="c"/>"""
    run = start(body)
    assert not run.step(1.0, ["go"])
    run.step(2.0, ["next"])
    assert run.step(3.0, ["go"]).entered == ("a2",)


def test_sent_events_arrive_in_logical_time():
    run = start(
        """<state id="a"><onentry><send event="late" delay="1.5s"/><send event="soon" delay="200ms"/></onentry>
        <transition event="soon" target="b"/></state>
        <state id="b"><transition event="late" target="c"/></state><state id="c"/>"""
    )
    assert not run.step(0.1)
    assert run.step(0.2).handled == ("soon",)
    assert not run.step(1.4)
    restored = run.machine.restore(json.loads(json.dumps(run.snapshot())))
    assert run.step(1.5).entered == ("c",)
    assert restored.step(1.5).entered == ("c",)


def test_events_arrive_in_the_order_of_their_times():
    run = start(
        """<state id="a"><onentry><send event="two" delay="2s"/><send event="one" delay="1s"/></onentry>
        <transition event="one" target="b"/></state><state id="b"><transition event="two" target="c"/></state>
        <state id="c"/>"""
    )
    assert run.step(5.0).entered == ("b", "c")


def test_a_sent_event_can_be_taken_back():
    run = start(
        """<state id="a"><onentry><send event="late" delay="1s" id="x"/></onentry>
        <transition event="never" ><cancel sendid="x"/></transition><transition event="late" target="b"/></state>
        <state id="b"/>"""
    )
    run.step(0.5, ["never"])
    assert not run.step(2.0)


def test_an_event_sent_without_delay_comes_after_those_that_wait():
    run = start(
        """<state id="a"><transition event="go" target="b"><send event="sent"/></transition></state>
        <state id="b"><transition event="waits" target="c"/><transition event="sent" target="wrong"/></state>
        <state id="c"><transition event="sent" target="d"/></state><state id="d"/><state id="wrong"/>"""
    )
    assert run.step(1.0, ["go", "waits"]).entered == ("b", "c", "d")


def test_an_internal_transition_of_a_compound_state_does_not_leave_it():
    body = """<state id="a"><transition event="go" type="{}" target="c"/><state id="b"/><state id="c"/></state>"""
    assert start(body.format("internal")).step(1.0, ["go"]).exited == ("b",)
    assert start(body.format("external")).step(1.0, ["go"]).exited == ("b", "a")


def test_initial_states():
    assert "b" in start('<state id="a"/><state id="b"/>', 'initial="b"').configuration
    assert "c" in start('<state id="a" initial="c"><state id="b"/><state id="c"/></state>').configuration
    with_actions = '<state id="a"><initial><transition target="c"><raise event="x"/></transition></initial>'
    with_actions += '<state id="b"/><state id="c"><transition event="x" target="b"/></state></state>'
    assert start(with_actions).configuration == {"a", "b"}


def test_a_deep_initial_state():
    body = '<state id="a"><state id="b"><state id="c"/><state id="d"/></state></state>'
    assert start(body, 'initial="d"').configuration == {"a", "b", "d"}


def test_logs_are_read_over():
    assert start('<state id="a"><onentry><log label="x" expr="1"/></onentry></state>').configuration == {"a"}


@pytest.mark.parametrize(
    ("body", "code", "words"),
    [
        ('<state id="a"><onentry><script>x = 1</script></onentry></state>', "E0903", "<script>"),
        ('<state id="a"><invoke type="http://x"/></state>', "E0904", "http://x"),
        ('<state id="a"><invoke/></state>', "E0909", "<invoke>"),
        ('<invoke/><state id="a"/>', "E0903", "<invoke>"),
        ('<state id="a"><invoke src="nowhere.scxml"/></state>', "E0902", "nowhere.scxml"),
        ('<state id="a"><invoke><content><scxml/></content></invoke></state>', "E0909", "no state"),
        ('<datamodel><data id="x" expr="1"/></datamodel><state id="a"/>', "E0903", "<datamodel>"),
        ('<state id="a"><onentry><assign location="x" expr="1"/></onentry></state>', "E0903", "<assign>"),
        ('<state id="a"><onentry><if cond="true"/></onentry></state>', "E0903", "<if>"),
        ('<state id="a"><onentry><foreach item="x" array="y"/></onentry></state>', "E0903", "<foreach>"),
        ('<final id="a"><donedata/></final>', "E0903", "<donedata>"),
        ('<state id="a"><onentry><send event="x" target="#_parent"/></onentry></state>', "E0904", "#_parent"),
        ('<state id="a"><onentry><send eventexpr="x"/></onentry></state>', "E0904", "eventexpr"),
        ('<state id="a"><onentry><send event="x" delayexpr="d"/></onentry></state>', "E0904", "delayexpr"),
        (
            '<state id="a"><onentry><send event="x"><param name="n" expr="1"/></send></onentry></state>',
            "E0903",
            "<param>",
        ),
        ('<state id="a"><onentry><send event="x" type="http"/></onentry></state>', "E0904", "http"),
        ('<script>x = 1</script><state id="a"/>', "E0903", "<script>"),
        (
            '<state id="a"><initial><transition event="e" target="b"/></initial><state id="b"/></state>',
            "E0904",
            "event",
        ),
        ('<state id="a"/><parallel id="p" initial="q"><state id="q"/></parallel>', "E0904", "initial"),
        ('<state id="a"><transition cond="x == 1" target="a"/></state>', "E0905", "x == 1"),
        ('<state id="a"><transition cond="In(\'a\') or" target="a"/></state>', "E0905", "ends"),
        ('<state id="a"><transition event="e" target="bb"/></state><state id="b"/>', "E0906", "`bb`"),
        ('<state id="a"><transition event="e" cond="In(\'z\')" target="a"/></state>', "E0906", "`z`"),
        ('<state id="a"/><state id="a"/>', "E0907", "`a`"),
        ('<state id="a" initial="c"><state id="b"/></state><state id="c"/>', "E0908", "`c`"),
        ('<state id="a" initial="a"><state id="b"/></state>', "E0908", "`a`"),
        ('<state id="a"><transition/></state>', "E0909", "needs"),
        ('<state id="a"><history id="h"/><state id="b"/></state>', "E0909", "history"),
        ("", "E0909", "no state"),
        ('<state id="a"><onentry><send event="e" delay="soon"/></onentry></state>', "E0910", "`soon`"),
        ('<state id="a"><transition event="e" target="a b"/></state><state id="b"/>', "E0911", "together"),
        ("<state", "E0901", "XML"),
    ],
)
def test_what_is_wrong_is_said_by_name_with_its_place(body, code, words):
    with pytest.raises(MachineError) as raised:
        chart(body, 'datamodel="null"')
    found = [one for one in raised.value.diagnostics if one.code == code]
    assert found
    assert words in found[0].message
    assert found[0].suggestion or code not in ("E0903", "E0904", "E0905")
    assert found[0].place.file == "chart.scxml"
    assert found[0].place.line == 1


def test_a_chart_with_data_needs_no_name_of_a_data_model():
    body = '<datamodel><data id="x" expr="1"/></datamodel><state id="a"><transition cond="x == 1" target="b"/></state>'
    assert start(body + '<state id="b"/>').configuration == {"b"}


def test_all_faults_are_told_at_once():
    with pytest.raises(MachineError) as raised:
        chart('<state id="a"><transition event="e" target="x"/><transition event="e" target="y"/><invoke/></state>')
    assert len(raised.value.diagnostics) == 3


def test_a_suggestion():
    with pytest.raises(MachineError, match="did you mean `straight`"):
        chart('<state id="a"><transition event="e" target="strait"/></state><state id="straight"/>')


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(MachineError, match="cannot be read"):
        scxml.load(tmp_path / "no.scxml")


def test_another_document():
    with pytest.raises(MachineError, match="not an <scxml>"):
        scxml.read_text("<html/>")


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.one_of(st.binary(max_size=60), st.text(max_size=60)))
def test_any_text_is_read_or_refused(text):
    with suppress(MachineError):
        scxml.read_text(text)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.data())
def test_a_mutated_chart_is_read_or_refused(data):
    text = """<scxml initial="a"><state id="a"><transition event="e" target="h"/></state><state id="b">
    <history id="h" type="deep"><transition target="c"/></history><state id="c"><onentry><raise event="x"/></onentry>
    <transition cond="In('a')" target="a"/></state></state><parallel id="p"><state id="q"/><final id="r"/></parallel>
    </scxml>"""
    at = data.draw(st.integers(0, len(text) - 1))
    length = data.draw(st.integers(0, 30))
    source = data.draw(st.integers(0, len(text) - 1))
    mutated = text[:at] + text[source : source + data.draw(st.integers(0, 30))] + text[at + length :]
    with suppress(MachineError):
        build(scxml.read_text(mutated)).start().step(1.0, ["e"])
