"""diagram, import and export as a user meets them."""

import html
import sys
from xml.etree import ElementTree

import pytest
from typer.testing import CliRunner

import hsm
from hsm.dsl import check_text
from hsm.model.chart import After, StateKind
from hsm.model.topology import HISTORY
from hsm.model.unparse import activity_text, expression_text
from maze_machine.catalogue.library import robot_library
from maze_machine.catalogue.machines import shipped_machines
from maze_machine.cli import app

LIFT = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="lift" initial="moving">
    <state id="moving" initial="up">
        <transition event="halt" target="halted"/>
        <history id="before"><transition target="up"/></history>
        <state id="up"><transition event="top" target="down"/></state>
        <state id="down"><transition event="ground" target="up"/></state>
    </state>
    <state id="halted"><transition event="resume" target="before"/></state>
</scxml>
"""
SCRIPTED = LIFT.replace('name="lift"', 'name="lift" datamodel="null"').replace(
    '<state id="halted">', '<state id="halted">\n        <onentry><script>x = 1</script></onentry>'
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lift.scxml").write_text(LIFT)
    (tmp_path / "scripted.scxml").write_text(SCRIPTED)
    return tmp_path


@pytest.fixture(scope="module")
def pledge():
    return hsm.load(str(shipped_machines()["pledge"]), robot_library()).model


def run(*arguments):
    return CliRunner().invoke(app, arguments)


@pytest.mark.parametrize("command", ["check", "fmt", "diagram", "import", "export", "list"])
def test_help_has_an_example(command):
    result = run(command, "--help")
    assert result.exit_code == 0
    assert f"Example: maze-machine {command} " in result.output


def drawn(path):
    """The words of a drawing, whichever way its lines are broken and its marks are written."""
    text = path.read_text()
    for mark, plain in (("\\l", " "), ("\\n", " "), ("#58;", ":"), ("#lt;", "<"), ("#gt;", ">"), ("\\\n", "")):
        text = text.replace(mark, plain)
    if path.suffix == ".svg":
        text = " ".join(
            word for element in ElementTree.fromstring(text).iter() for word in (element.text or "").split()
        )
    return " ".join(html.unescape(text).split())


@pytest.mark.parametrize("form", ["svg", "dot", "mmd"])
def test_a_diagram_names_all_that_a_machine_has(folder, pledge, form):
    if form != "mmd":
        pytest.importorskip("pygraphviz")
    result = run("diagram", "pledge", "-o", f"pledge.{form}", "--depth", "9")
    assert (result.exit_code, result.output) == (0, "")
    text = drawn(folder / f"pledge.{form}")
    for state in pledge.states[1:]:
        assert (state.own_name if state.kind not in HISTORY else "H") in text
        if state.activity is not None:
            assert f"do {activity_text(state.activity)}" in text
    for transition in pledge.transitions:
        if transition.guard is not None:
            assert f"if {expression_text(transition.guard)}" in text
        if isinstance(transition.trigger, After):
            assert f"after {expression_text(transition.trigger.duration)}" in text
    assert {StateKind.PARALLEL, StateKind.FINAL, StateKind.SHALLOW_HISTORY} <= {one.kind for one in pledge.states}


def test_a_diagram_as_a_picture(folder):
    pytest.importorskip("pygraphviz")
    assert run("diagram", "lift.scxml", "-o", "lift.png").exit_code == 0
    assert (folder / "lift.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("name", ["lift.gif", "lift"])
def test_a_diagram_of_an_unknown_kind_is_refused(folder, name):
    result = run("diagram", "lift.scxml", "-o", name)
    assert result.exit_code == 2
    assert name in result.output
    assert "use .svg or .png or .dot or .mmd" in result.output
    assert not (folder / name).exists()


def test_a_diagram_of_no_machine_or_to_nowhere_is_refused(folder):
    assert run("diagram", "nowhere", "-o", "x.mmd").exit_code == 3
    result = run("diagram", "lift.scxml", "-o", "nowhere/x.mmd")
    assert (result.exit_code, "nowhere/x.mmd: No such file or directory" in result.output) == (3, True)


def test_without_graphviz_the_way_out_is_told_and_its_language_and_mermaid_work(folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "pygraphviz", None)
    result = run("diagram", "lift.scxml", "-o", "lift.svg")
    assert result.exit_code == 2
    assert "maze-machine[diagrams]" in result.output
    assert not (folder / "lift.svg").exists()
    assert run("diagram", "lift.scxml", "-o", "lift.mmd").exit_code == 0
    assert "stateDiagram-v2" in (folder / "lift.mmd").read_text()
    assert run("diagram", "lift.scxml", "-o", "lift.dot").exit_code == 0
    assert (folder / "lift.dot").read_text().startswith("digraph")


def test_an_imported_chart_is_a_machine(folder):
    result = run("import", "lift.scxml", "-o", "lift.maze-machine")
    assert (result.exit_code, result.output) == (0, "")
    text = (folder / "lift.maze-machine").read_text()
    assert "on resume -> moving.history" in text
    assert {one.code for one in check_text(text, robot_library()).diagnostics} <= {"N0601"}
    assert run("fmt", "--check", "lift.maze-machine").exit_code == 0
    assert run("import", "lift.scxml").output == text


def test_what_cannot_be_imported_is_refused_by_name_with_its_place(folder):
    result = run("import", "scripted.scxml", "-o", "scripted.maze-machine")
    assert result.exit_code == 3
    assert "error[E0903]: <script> is not supported\n --> scripted.scxml:9:18\n" in result.output
    assert not (folder / "scripted.maze-machine").exists()
    assert run("import", "nowhere.scxml").exit_code == 3


def test_a_machine_of_states_and_events_comes_back_from_scxml(folder):
    assert run("import", "lift.scxml", "-o", "first.maze-machine").exit_code == 0
    assert run("export", "first.maze-machine", "--to", "scxml", "-o", "again.scxml").exit_code == 0
    assert run("import", "again.scxml", "-o", "second.maze-machine").exit_code == 0
    first, second = ((folder / f"{name}.maze-machine").read_text() for name in ("first", "second"))
    assert first == second


def test_pledge_is_exported_whole_and_what_scxml_cannot_say_is_refused_on_the_way_back(folder, pledge):
    assert run("export", "pledge", "-o", "pledge.scxml").exit_code == 0
    space = "{http://www.w3.org/2005/07/scxml}"
    top = ElementTree.parse(folder / "pledge.scxml").getroot()
    found = [
        element.get("id") for tag in ("state", "parallel", "final", "history") for element in top.iter(space + tag)
    ]
    assert sorted(found) == sorted(state.name for state in pledge.states[1:])
    assert len(list(top.iter(f"{space}invoke"))) == sum(state.activity is not None for state in pledge.states)
    targets = [one.get("target") for one in top.iter(f"{space}transition")]
    assert {name for target in targets if target for name in target.split()} <= set(found)
    result = run("import", "pledge.scxml")
    assert result.exit_code == 3
    assert "the data model `maze-machine` is not supported: a chart has no robot to ask" in result.output
    assert result.output.count("error[") == 1


def test_another_format_of_export_is_refused(folder):
    assert run("export", "pledge", "--to", "yaml").exit_code == 2
    result = run("export", "pledge", "-o", "nowhere/pledge.scxml")
    assert (result.exit_code, "nowhere/pledge.scxml: No such file or directory" in result.output) == (3, True)


def test_without_rerun_a_recording_is_not_written_for_it(folder, monkeypatch):
    monkeypatch.setattr("maze_machine.commands.to_rerun.find_spec", lambda _: None)
    result = run("export", "run.mcap", "-o", "run.rrd")
    assert result.exit_code == 2
    assert "maze-machine[rerun]" in result.stderr
    assert not (folder / "run.rrd").exists()


def test_what_rerun_cannot_read_is_told_in_a_line(folder, monkeypatch):
    monkeypatch.setattr("maze_machine.commands.to_rerun.find_spec", lambda _: object())
    monkeypatch.setattr("maze_machine.commands.to_rerun.sys.executable", "false")
    (folder / "run.mcap").write_bytes(b"none")
    result = run("export", "run.mcap", "-o", "run.rrd")
    assert result.exit_code == 3
    assert "Rerun cannot read run.mcap" in result.stderr
    assert run("export", "nothing.mcap", "-o", "run.rrd").exit_code == 3
