"""A file of scenarios in the editor."""

import asyncio

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsprotocol import types

from maze_machine.catalogue.library import robot_names
from maze_machine.catalogue.machines import SHIPPED
from maze_machine.editor.scenarios import ScenarioDocument
from tests.dsl.test_server import serving

LIBRARY = robot_names()
MACHINE = """machine ring

event go

enum Mood = calm, angry

param pause : time = 1 s

var rings : int = 0
var mood : Mood = calm

initial waiting

# Waits for somebody.
state waiting
    on go -> ringing

state ringing
    do ring()
    entry / raise rung
    on accepted -> waiting / rings += 1
    on refused  -> waiting / mood = angry
    after pause -> waiting
"""
TEST = """test ring

scenario it rings
    given pause = 2 s
    when event go
    expect ringing, doing ring
    when ring reports accepted
    expect waiting, rings == 1
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "ring.maze-machine").write_text(MACHINE, encoding="utf-8")
    return tmp_path


@pytest.fixture
def document(folder):
    def made(text=TEST, opened=None):
        return ScenarioDocument(text, str(folder / "ring.maze-test"), LIBRARY, opened or {})

    return made


@pytest.mark.parametrize(
    ("line", "some", "none"),
    [
        ("", ["scenario", "test"], ["expect"]),
        ("    ", ["given", "when", "after", "expect"], ["scenario"]),
        ("test ", ["ring"], []),
        ("    given ", ["pause", "space.left", "not"], ["waiting", "event", "rings"]),
        ("    when ", ["space.left", "ring", "event", "not"], ["waiting", "drive"]),
        ("    when event ", ["go"], ["space.left"]),
        ("    when ring reports ", ["accepted", "refused"], ["done"]),
        ("    when space.left, ringing reports ", ["accepted"], []),
        ("    when ring ", ["reports", "fails"], []),
        ("    expect ", ["waiting", "ringing", "rings", "doing", "not"], ["ring"]),
        ("    expect waiting, not doing ", ["ring", "drive"], ["waiting"]),
        ("    expect mood == ", ["calm", "angry"], ["waiting"]),
        ("    after 2 ", ["s", "ms"], ["waiting"]),
        ("    expect wai", ["waiting"], ["ringing"]),
        ("    expect waiting # ", [], ["waiting"]),
    ],
)
def test_what_could_be_written(document, line, some, none):
    text = f"{TEST}{line}"
    found = [one.label for one in document(text).completions(len(TEST.splitlines()), len(line))]
    assert set(some) <= set(found)
    assert not set(none) & set(found)


def at(text, word):
    number, line = next((number, line) for number, line in enumerate(text.splitlines()) if word in line)
    return number, line.index(word) + 1


def test_names_are_those_of_the_machine(document, folder):
    made = document()
    assert "Waits for somebody." in made.hover(*at(TEST, "waiting")).doc
    assert made.hover(*at(TEST, "pause")).detail == "time = 1 s"
    assert made.hover(*at(TEST, "ring reports")).label == "ring"
    span = made.definition(*at(TEST, "ringing"))
    assert (span.file, span.line) == (str(folder / "ring.maze-machine"), MACHINE.splitlines().index("state ringing"))
    assert made.definition(*at(TEST, "rings == 1")).file == str(folder / "ring.maze-machine")
    assert made.definition(0, 6).file == str(folder / "ring.maze-machine")


def test_what_is_wrong_is_said(document):
    assert document().diagnostics() == ()
    (wrong,) = document(TEST.replace("expect ringing", "expect rining")).diagnostics()
    assert (wrong.code, wrong.place.line) == ("E0201", 6)
    assert document(TEST.replace("test ring", "test rang")).diagnostics()[0].code == "E0208"
    assert document("").diagnostics()[0].code == "E0401"


def test_the_machine_as_it_is_in_the_editor_counts(document, folder):
    broken = {str(folder / "ring.maze-machine"): MACHINE.replace("-> ringing", "-> rining")}
    assert "has errors" in document(opened=broken).diagnostics()[0].message
    renamed = {str(folder / "ring.maze-machine"): MACHINE.replace("waiting", "idle")}
    assert "E0201" in [one.code for one in document(opened=renamed).diagnostics()]


def test_the_outline_and_the_layout(document):
    (scenario,) = document().outline()
    assert (scenario.name, scenario.whole.line, scenario.whole.end_line) == ("it rings", 2, 7)
    untidy = TEST.replace("    expect ringing,", "  expect ringing,\n    ").replace("test ring\n\n", "test ring\n")
    tidy = document(untidy).formatted()
    assert tidy == TEST.replace("ringing, doing", "ringing,\n        doing")
    assert document(tidy).formatted() == tidy
    assert document("test ring\nscenario x\n    when ((\n").formatted() is None


@pytest.mark.parametrize("path", sorted(SHIPPED.glob("*.maze-test")), ids=lambda path: path.stem)
def test_shipped_scenarios_keep_their_meaning_when_they_are_laid_out(path):
    text = path.read_text(encoding="utf-8")
    document = ScenarioDocument(text, str(path), LIBRARY, {})
    assert document.diagnostics() == ()
    assert ScenarioDocument(document.formatted(), str(path), LIBRARY, {}).diagnostics() == ()
    assert document.formatted().split() == text.split()


@settings(max_examples=40, deadline=None)
@given(
    cut=st.integers(0, len(TEST)),
    piece=st.sampled_from(["", "\n", " ", ",", "(", "not ", "expect ", "when ", "é", "\t", "= ", "reports "]),
    line=st.integers(0, 12),
    column=st.integers(0, 30),
)
def test_nothing_that_is_asked_of_half_a_text_ends_in_an_error(tmp_path_factory, cut, piece, line, column):
    folder = tmp_path_factory.mktemp("half")
    (folder / "ring.maze-machine").write_text(MACHINE, encoding="utf-8")
    document = ScenarioDocument(TEST[:cut] + piece + TEST[cut:], str(folder / "ring.maze-test"), LIBRARY, {})
    document.diagnostics()
    document.completions(line, column)
    document.hover(line, column)
    document.definition(line, column)
    document.outline()
    document.formatted()


def test_over_the_protocol(folder):
    async def work():
        async with serving(folder) as client:
            path = folder / "ring.maze-test"
            item = types.TextDocumentItem(path.as_uri(), "maze-test", 1, f"{TEST}    expect \n")
            client.text_document_did_open(types.DidOpenTextDocumentParams(item))
            document = types.TextDocumentIdentifier(path.as_uri())
            report = await client.text_document_diagnostic_async(types.DocumentDiagnosticParams(document))
            assert [one.code for one in report.items] == ["E0101"]
            where = types.Position(8, 11)
            found = await client.text_document_completion_async(types.CompletionParams(document, where))
            assert "waiting" in [one.label for one in getattr(found, "items", found)]
            symbols = await client.text_document_document_symbol_async(types.DocumentSymbolParams(document))
            assert [one.name for one in symbols] == ["it rings"]
            place = await client.text_document_definition_async(types.DefinitionParams(document, types.Position(5, 12)))
            assert place.uri.endswith("ring.maze-machine")
            for asked in (
                client.text_document_references_async(
                    types.ReferenceParams(types.ReferenceContext(True), document, types.Position(5, 12))
                ),
                client.text_document_code_lens_async(types.CodeLensParams(document)),
                client.text_document_semantic_tokens_full_async(types.SemanticTokensParams(document)),
                client.text_document_folding_range_async(types.FoldingRangeParams(document)),
            ):
                await asked
            assert client.errors == []

    asyncio.run(asyncio.wait_for(work(), 60))
