"""Charts that invoke charts: what they tell each other, when they begin and end, and what is said of mistakes."""

from textwrap import dedent

import pytest

from hsm import MachineError, MachineFault, SnapshotError, build
from hsm.interchange.scxml import load, read_text
from hsm.interchange.scxml.translation import to_machine_text


def chart(body, attributes='datamodel="ecmascript"'):
    return build(read_text(f'<scxml name="c" {attributes}>{dedent(body)}</scxml>', "c.scxml"))


def inline(body, attributes='datamodel="ecmascript"', about=""):
    return f"<invoke {about}><content><scxml {attributes}>{body}</scxml></content></invoke>"


ENDS = '<final id="pass"/><final id="fail"/>'


def test_a_chart_begins_with_its_state_and_tells_when_it_ends():
    child = '<state id="x"><transition event="t" target="y"/><onentry><send event="t" delay="1s"/></onentry></state>'
    child += '<final id="y"/>'
    run = chart(
        f'<state id="a">{inline(child)}<transition event="done.invoke.a.1" target="pass"/></state>{ENDS}'
    ).start()
    run.step(0.9)
    assert run.outcome is None
    step = run.step(1.0)
    assert run.outcome == "pass"
    assert step.handled == ("done.invoke.a.1",)


def test_it_is_given_data_and_gives_a_result():
    child = """
        <datamodel><data id="n" expr="1"/><data id="m" expr="n + 1"/></datamodel>
        <final id="over"><donedata><param name="sum" expr="n + m"/></donedata></final>
    """
    body = f"""
        <datamodel><data id="k" expr="20"/><data id="got" expr="0"/></datamodel>
        <state id="a">
          <invoke id="adder"><param name="n" expr="k * 2"/>
            <content><scxml datamodel="ecmascript">{child}</scxml></content></invoke>
          <transition event="done.invoke.adder" target="pass"
            cond="_event.data.sum == 81 &amp;&amp; _event.invokeid == 'adder'"/>
          <transition event="*" target="fail"/>
        </state>{ENDS}
    """
    assert chart(body).start().outcome == "pass"


def test_both_send_each_other_events():
    child = """
        <state id="x"><transition event="ping" target="y"/></state>
        <state id="y">
          <onentry><send event="pong" target="#_parent"/></onentry>
          <transition event="stop" target="z"/>
        </state>
        <final id="z"/>
    """
    body = f"""
        <state id="a">
          {inline(child, about='id="kid"')}
          <transition event="go"><send event="ping" target="#_kid"/></transition>
          <transition event="pong"><send event="stop" targetexpr="_event.origin"/></transition>
          <transition event="done.invoke" target="pass"/>
        </state>{ENDS}
    """
    run = chart(body).start()
    assert run.outcome is None
    step = run.step(1.0, ["go"])
    assert step.handled == ("go", "pong", "done.invoke.kid")
    assert run.outcome == "pass"


def test_a_state_that_is_left_ends_its_charts():
    child = '<state id="x"><onentry><send event="late" target="#_parent" delay="1s"/></onentry></state>'
    body = f"""
        <state id="a">{inline(child, about='id="kid"')}<transition event="go" target="b"/></state>
        <state id="b">
          <onentry><send event="hello" target="#_kid"/></onentry>
          <transition event="error.communication" target="c"/>
        </state>
        <state id="c"><transition event="late" target="fail"/></state>{ENDS}
    """
    run = chart(body).start()
    run.step(0.5, ["go"])
    assert run.configuration == {"c"}
    run.step(5.0)
    assert run.configuration == {"c"}


def test_a_state_that_is_entered_and_left_within_a_step_begins_none():
    child = '<state id="x"><onentry><send event="born" target="#_parent"/></onentry></state>'
    body = f"""
        <state id="a"><transition target="b"/>{inline(child)}</state>
        <state id="b"><transition event="born" target="fail"/></state>{ENDS}
    """
    run = chart(body).start()
    run.step(1.0)
    assert run.configuration == {"b"}


def test_events_are_forwarded_and_finalized():
    child = """
        <state id="x"><transition event="go" target="y"/></state>
        <final id="y"><onentry><send event="went" target="#_parent"><param name="n" expr="7"/></send></onentry></final>
    """
    body = f"""
        <datamodel><data id="n" expr="0"/></datamodel>
        <state id="a">
          <invoke autoforward="true"><content><scxml datamodel="ecmascript">{child}</scxml></content>
            <finalize><assign location="n" expr="_event.data.n"/></finalize></invoke>
          <transition event="went" cond="n == 7" target="pass"/>
          <transition event="went" target="fail"/>
        </state>{ENDS}
    """
    run = chart(body).start()
    run.step(1.0, ["go"])
    assert run.outcome == "pass"


def test_charts_within_charts_within_charts():
    inner = '<final id="z"><onentry><send event="deep" target="#_parent"/></onentry></final>'
    middle = f"""
        <state id="y">{inline(inner)}
          <transition event="deep" target="over"><send event="up" target="#_parent"/></transition>
        </state><final id="over"/>
    """
    run = chart(f'<state id="a">{inline(middle)}<transition event="up" target="pass"/></state>{ENDS}').start()
    assert run.outcome == "pass"


def test_sessions_have_identifiers_of_their_own():
    child = """<final id="z"><donedata><content expr="_sessionid"/></donedata></final>"""
    body = f"""
        <datamodel><data id="first"/></datamodel>
        <state id="a">{inline(child)}
          <transition event="done.invoke" target="b"><assign location="first" expr="_event.data"/></transition></state>
        <state id="b">{inline(child)}
          <transition event="done.invoke" target="pass"
            cond="_event.data != first &amp;&amp; first != _sessionid"/></state>
        {ENDS}
    """
    assert chart(body).start().outcome == "pass"


def test_charts_without_data_invoke_and_are_invoked():
    child = '<state id="x"><onentry><send event="born" target="#_parent"/></onentry></state>'
    run = chart(f'<state id="a">{inline(child, "")}<transition event="born" target="pass"/></state>{ENDS}', "").start()
    assert run.outcome == "pass"


@pytest.mark.parametrize("about", ['src="kid.scxml"', 'src="file:kid.scxml"', """srcexpr="'kid' + '.scxml'" """])
def test_a_chart_in_a_file_beside_it(tmp_path, about):
    (tmp_path / "kid.scxml").write_text('<scxml><final id="over"/></scxml>')
    top = f'<scxml datamodel="ecmascript"><state id="a"><invoke {about}/>'
    (tmp_path / "c.scxml").write_text(f'{top}<transition event="done.invoke" target="pass"/></state>{ENDS}</scxml>')
    assert load(tmp_path / "c.scxml").start().outcome == "pass"


def test_a_chart_made_while_the_machine_runs():
    text = "'&lt;scxml&gt;&lt;final id=&quot;z&quot;/&gt;&lt;/scxml&gt;'"
    body = f'<state id="a"><invoke><content expr="{text}"/></invoke><transition event="done.invoke" target="pass"/>'
    assert chart(f"{body}</state>{ENDS}").start().outcome == "pass"


@pytest.mark.parametrize(
    ("invoke", "event"),
    [
        ("""<invoke srcexpr="'nowhere.scxml'"/>""", "error.communication"),
        ("""<invoke srcexpr="nothing"/>""", "error.execution"),
        ("""<invoke typeexpr="'http://x'" srcexpr="'a'"/>""", "error.execution"),
        ("""<invoke><content expr="'no chart'"/></invoke>""", "error.execution"),
        ("""<invoke><content expr="3"/></invoke>""", "error.execution"),
    ],
)
def test_what_cannot_be_invoked_is_an_error_of_the_chart(invoke, event):
    body = f'<state id="a">{invoke}<transition event="{event}" target="pass"/><transition event="*" target="fail"/>'
    assert chart(f"{body}</state>{ENDS}").start().outcome == "pass"


def test_a_chart_that_invokes_itself_is_refused_when_it_is_read(tmp_path):
    path = tmp_path / "c.scxml"
    path.write_text('<scxml datamodel="ecmascript"><state id="a"><invoke src="c.scxml"/></state></scxml>')
    with pytest.raises(MachineError, match="more than 16 levels deep"):
        load(path)


def test_charts_do_not_multiply_without_end(tmp_path):
    path = tmp_path / "c.scxml"
    path.write_text("""<scxml datamodel="ecmascript"><state id="a"><invoke srcexpr="'c.scxml'"/></state></scxml>""")
    run = load(path).start()  # the seventeenth cannot be read, and is an error of the sixteenth
    assert run.step(1.0).ignored == ()
    assert run.configuration == {"a"}


def test_a_conversation_without_end_is_a_spin():
    child = '<state id="x"><transition event="ping"><send event="pong" target="#_parent"/></transition></state>'
    body = f"""
        <state id="a">{inline(child, about='id="kid"')}
          <transition event="go pong"><send event="ping" target="#_kid"/></transition></state>
    """
    run = chart(body).start()
    with pytest.raises(MachineFault, match="without end"):
        run.step(1.0, ["go"])
    assert run.time == 0.0
    assert run.step(1.0).handled == ()


def test_a_run_with_sessions_is_not_saved_and_the_chart_not_translated():
    body = f'<state id="a">{inline("<state id=" + chr(34) + "x" + chr(34) + "/>")}</state>'
    machine = chart(body)
    with pytest.raises(SnapshotError):
        machine.start().snapshot()
    with pytest.raises(MachineError, match="a data model"):
        to_machine_text(machine.model)
