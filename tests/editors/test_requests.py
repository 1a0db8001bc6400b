"""What editors ask beyond the protocol: the diagram of a file, its changes, the states of a live run."""

from __future__ import annotations

from contextlib import contextmanager
from xml.etree import ElementTree

import pytest
from lsprotocol import types

from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.refactoring import refactorings
from maze_machine.catalogue.library import robot_names
from maze_machine.catalogue.machines import SHIPPED
from maze_machine.editor.diagram import diagram
from maze_machine.editor.live import LiveRun
from tests.dsl.test_server import opened, served, serving
from tests.maze_machine.test_remote import MACHINE, mission, running, until  # noqa: F401 - a fixture
from transport.robot import LinkError

TEXT = """\
machine m

initial a

state a
    initial b

    state b
        do stop()
        when space.left -> c  # why

    state c
        do stop()
        on fault -> over

final over
"""


def document(text, file="m.maze-machine"):
    return Document(text, file, robot_names())


def applied(text, refactoring):
    lines = text.split("\n")
    (edit,) = refactoring.edits
    head = [*lines[: edit.line], lines[edit.line][: edit.column]]
    tail = [lines[edit.end_line][edit.end_column :], *lines[edit.end_line + 1 :]]
    return "\n".join(head) + edit.text + "\n".join(tail)


@pytest.mark.parametrize("path", sorted(SHIPPED.glob("*.maze-machine")), ids=lambda path: path.stem)
def test_what_is_in_a_picture_leads_back_to_the_text(path):
    pytest.importorskip("pygraphviz")
    text = path.read_text(encoding="utf-8")
    shown = diagram(document(text, str(path)))
    groups = [one for one in ElementTree.fromstring(shown["svg"]).iter() if one.tag.endswith("}g")]
    titles = {one.text for group in groups for one in group if one.tag.endswith("}title")}
    classes = {word for group in groups for word in group.get("class", "").split()}
    own = path.absolute().as_uri()
    for state in shown["states"]:
        assert state["id"] in titles
        if state["uri"] == own:
            where = state["range"]
            line = text.split("\n")[where["start"]["line"]]
            name = state["label"].split(" = ")[0]
            assert line[where["start"]["character"] : where["end"]["character"]] == name
    ids = {state["id"] for state in shown["states"]}
    for transition in shown["transitions"]:
        assert transition["source"] in ids | {None}
        assert (transition["id"] in classes) == bool(transition["targets"])


def test_a_text_that_is_wrong_has_no_picture_but_a_reason():
    assert diagram(document(TEXT.replace("-> c", "-> x"))) == {"problem": "m.maze-machine:10: there is no state `x`"}


def test_states_are_added_beside_and_inside():
    of_b = {one.title: applied(TEXT, one) for one in refactorings(document(TEXT), 7)}
    assert "-> c  # why\n\n    state new_state\n\n    state c" in of_b["Add a state after `b`"]
    inside = of_b["Add a state inside `b`"]
    assert "-> c  # why\n\n        initial new_state\n\n        state new_state\n" in inside
    assert "svg" in diagram(document(inside)) or "problem" in diagram(document(inside))
    of_a = {one.title: applied(TEXT, one) for one in refactorings(document(TEXT), 4)}
    assert "on fault -> over\n\nstate new_state\n\nfinal over" in of_a["Add a state after `a`"]
    assert "on fault -> over\n\n    state new_state\n\nfinal over" in of_a["Add a state inside `a`"]
    assert [one.title for one in refactorings(document(TEXT), 15)] == ["Add a state after `over`"]


def test_a_new_state_has_a_name_of_its_own():
    text = applied(TEXT, next(iter(refactorings(document(TEXT), 7))))
    assert "state new_state2" in applied(text, next(iter(refactorings(document(text), 7))))


def test_a_transition_gets_another_target():
    found = {one.title: applied(TEXT, one) for one in refactorings(document(TEXT), 9)}
    assert "when space.left -> over  # why" in found["Change the target to `over`"]
    assert "Change the target to `c`" not in found
    assert not list(refactorings(document(TEXT.replace("-> c ", "-> c, a ")), 9))


def test_the_server_answers(tmp_path):
    pytest.importorskip("pygraphviz")

    async def work():
        async with serving(tmp_path) as client:
            item = opened(client, tmp_path / "m.maze-machine", TEXT)
            shown = await client.protocol.send_request_async("maze-machine/diagram", {"uri": item.uri})
            assert shown.machine == "m"
            assert [state.name for state in shown.states] == ["a", "b", "c", "over"]
            line = types.Range(types.Position(9, 0), types.Position(9, 0))
            asked = types.CodeActionContext([], only=["refactor.rewrite.maze-machine.retarget"])
            found = await client.text_document_code_action_async(types.CodeActionParams(item, line, asked))
            assert {one.title for one in found} >= {"Change the target to `over`", "Change the target to `a`"}
            everything = types.CodeActionParams(item, line, types.CodeActionContext([]))
            assert not [
                one for one in await client.text_document_code_action_async(everything) if "target" in one.title
            ]

    served(work())


def test_a_run_that_is_not_there_is_reported():
    @contextmanager
    def connect(endpoint, robot):
        raise LinkError(f"nobody listens at {endpoint}")
        yield

    news = []
    LiveRun(connect, news.append).start("here", "pico")
    until(lambda: news)
    assert news == [{"ended": "nobody listens at here"}]


OWN = """
from pathlib import Path
from hsm.model.registry import Library
Path(__file__).with_name("ran").touch()
library = Library("own")

@library.signal("lamp")
def lamp(facts: object) -> bool:
    \"\"\"Whether it is lit.\"\"\"
    return False
"""


@pytest.mark.parametrize("trusted", [True, False, None])
def test_the_code_of_a_project_runs_only_where_the_editor_trusts_it(tmp_path, trusted):
    (tmp_path / "maze-machine.toml").write_text('library = "own_of_editor:library"\n', encoding="utf-8")
    (tmp_path / "own_of_editor.py").write_text(OWN, encoding="utf-8")

    async def work():
        async with serving(tmp_path, options={"trusted": trusted}) as client:
            item = opened(
                client, tmp_path / "m.maze-machine", "machine m\ninitial a\nstate a\n    when lamp -> b\nfinal b\n"
            )
            report = await client.text_document_diagnostic_async(types.DocumentDiagnosticParams(item))
            assert ("E0202" in [one.code for one in report.items]) == (trusted is not True)
            assert (tmp_path / "ran").exists() == (trusted is True)

    served(work())


def test_the_states_of_a_run_are_relayed_until_it_ends(mission):  # noqa: F811
    assert "state moving" in MACHINE
    with running(mission) as (_, client, _):

        @contextmanager
        def connect(endpoint, robot):
            assert (endpoint, robot) == ("here", "pico")
            yield client

        news = []
        live = LiveRun(connect, news.append)
        live.start("here", "pico")
        from maze_machine.remote.messages import AdvanceRun, SendEvent  # noqa: PLC0415

        assert client.operate(AdvanceRun(ticks=1)).done
        until(lambda: news)
        assert news[0]["machine"] == "waiting"
        assert news[0]["states"] == ["idle"]
        assert client.operate(SendEvent(name="go")).done
        assert client.operate(AdvanceRun(ticks=1)).done
        until(lambda: news[-1]["states"] == ["moving"])
        live.stop()
        assert news[-1] == {"ended": "no longer watched"}
