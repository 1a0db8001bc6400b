"""A file of scenarios in the editor."""

import asyncio

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lsprotocol import types

from hsm.dsl.lsp import actions
from hsm.dsl.lsp.navigation import Colour
from hsm.dsl.lsp.occurrences import Role
from maze_machine.catalogue.library import robot_names
from maze_machine.catalogue.machines import SHIPPED
from maze_machine.editor.scenarios import ScenarioDocument
from tests.dsl.test_server import served, serving

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
        ("", ["scenario", "test", "requirement", "property"], ["expect", "covers"]),
        ("    ", ["given", "when", "after", "expect", "covers"], ["scenario"]),
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


REQUIRED = """test ring

requirement R1 it rings when it is asked to
requirement R-2: it waits

property patient covers R-2

scenario it rings
    covers R1
    when event go
    expect ringing
"""


@pytest.fixture
def required(folder, document):
    text = MACHINE.replace("var rings", "property patient : never in(waiting) and in(ringing)\n\nvar rings", 1)
    (folder / "ring.maze-machine").write_text(text, encoding="utf-8")
    return document


@pytest.mark.parametrize(
    ("line", "some", "none"),
    [
        ("    covers ", ["R1", "R-2"], ["waiting", "it"]),
        ("    covers R1, ", ["R-2"], ["waiting"]),
        ("property ", ["patient"], ["waiting", "R1"]),
        ("property patient ", ["covers"], ["patient"]),
        ("property patient covers ", ["R1"], ["patient"]),
    ],
)
def test_what_could_cover_a_requirement(required, line, some, none):
    found = [one.label for one in required(f"{REQUIRED}{line}").completions(len(REQUIRED.splitlines()), len(line))]
    assert set(some) <= set(found)
    assert not set(none) & set(found)


def test_a_requirement_is_shown_and_found_where_it_is_covered(required):
    made = required(REQUIRED)
    assert not made.diagnostics()
    shown = made.hover(5, len("property patient covers R"))
    assert (shown.label, shown.doc) == ("R-2", "it waits")
    assert made.definition(8, len("    covers R")).line == 2
    assert made.definition(8, 5) is None
    assert made.definition(5, len("property pat")).file.endswith("ring.maze-machine")
    assert [one.column for one in made.colours() if one.line == 2 and one.kind is Colour.KEYWORD] == [0]
    assert [one.column for one in made.colours() if one.line == 5 and one.kind is Colour.KEYWORD] == [0, 17]


def test_a_name_that_was_meant_and_a_call_that_is_open(document):
    edited = document(TEST.replace("expect ringing", "expect ringin"))
    (fix,) = actions.meant(edited.file, edited.diagnostics())
    assert (fix.title, fix.certain, fix.edits[0].line) == ("Change to `ringing`", True, 5)
    call = document(f"{TEST}    expect doing drive(").open_call(len(TEST.splitlines()), 23)
    assert call is not None
    assert call.name == "drive"


def test_the_machine_of_a_test_is_shown(document):
    found = document().hover(0, 6)
    assert found is not None
    assert found.kind.value == "machine"


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
    list(document.folds())
    for one in document.occurrences:
        assert one.end <= len(document.lines[one.line])
    assert [one.line for one in document.colours()] == sorted(one.line for one in document.colours())


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


def test_names_in_scenarios_have_colours(document):
    made = document(TEST.replace("it rings", "event 2 when"))
    found = {(one.line, one.column): (one.kind, one.length) for one in made.colours()}
    assert found[0, 0] == (Colour.KEYWORD, 4)
    assert found[0, 5] == (Role.MACHINE, 4)
    assert {place for place in found if place[0] == 2} == {(2, 0)}
    assert found[3, 10] == (Role.PARAMETER, 5)
    assert found[4, 15] == (Role.EVENT, 2)
    assert found[5, 11] == (Role.STATE, 7)
    assert found[5, 26] == (Role.ACTIVITY, 4)
    assert found[6, 9] == (Role.ACTIVITY, 4)
    assert found[6, 22] == (Role.EVENT, 8)
    assert found[7, 20] == (Role.VARIABLE, 5)


def test_a_state_is_renamed_from_its_scenario(folder):
    async def work():
        async with serving(folder) as client:
            machine, tests = folder / "ring.maze-machine", folder / "ring.maze-test"
            tests.write_text(TEST, encoding="utf-8")
            item = types.TextDocumentItem(tests.as_uri(), "maze-test", 1, TEST)
            client.text_document_did_open(types.DidOpenTextDocumentParams(item))
            identifier, position = types.TextDocumentIdentifier(tests.as_uri()), types.Position(5, 14)
            asked = types.RenameParams(new_name="busy", text_document=identifier, position=position)
            changes = (await client.text_document_rename_async(asked)).changes
            assert sorted(one.range.start.line for one in changes[machine.as_uri()]) == [15, 17]
            assert [one.range.start.line for one in changes[tests.as_uri()]] == [5]
            at = {"text_document": identifier, "position": position}
            context = types.ReferenceContext(include_declaration=False)
            found = await client.text_document_references_async(types.ReferenceParams(context=context, **at))
            assert len(found) == 2
            shown = await client.text_document_document_highlight_async(types.DocumentHighlightParams(**at))
            assert [one.range.start.line for one in shown] == [5]
            tokens = await client.text_document_semantic_tokens_full_async(types.SemanticTokensParams(identifier))
            assert tokens.data
            folds = await client.text_document_folding_range_async(types.FoldingRangeParams(identifier))
            assert [(one.start_line, one.end_line) for one in folds] == [(2, 7)]
        assert not client.errors

    served(work())
