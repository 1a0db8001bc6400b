"""Every construct of the language, with all that must know it: layout, editor, drawing, tests, coverage, export."""

import re
from pathlib import Path

import pytest

from hsm import MachineError, build
from hsm.dsl import check_file, load_model
from hsm.dsl.format.formatter import format_text
from hsm.dsl.lsp import hovering, navigation, references
from hsm.dsl.lsp.completion import completions
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.navigation import Colour
from hsm.dsl.syntax.lexer import IN_PLACE, RESERVED, STATEMENTS
from hsm.interchange.diagrams import render
from hsm.interchange.scxml import differences, read_text, write_text
from hsm.model.topology import HISTORY
from hsm.testing.coverage.items import ItemKind, points
from hsm.testing.generation.generating import generate
from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.running import run_suite
from hsm.testing.scenarios.writing import Writer
from tests.dsl.library import make_library

LIBRARY = make_library()
FILES = sorted((Path(__file__).parent / "constructs").glob("*.maze-machine"))
machine_of_each = pytest.mark.parametrize("path", FILES, ids=[one.stem for one in FILES])


def document_of(path):
    return Document(path.read_text(encoding="utf-8"), str(path), LIBRARY)


def codes(path):
    return [one.code for one in check_file(path, LIBRARY).diagnostics]


def test_the_machines_have_every_word():
    text = "\n".join(path.read_text(encoding="utf-8") for path in FILES)
    assert [word for word in sorted(STATEMENTS | RESERVED | IN_PLACE) if not re.search(rf"\b{word}\b", text)] == []


@machine_of_each
def test_check_and_layout_know_it(path):
    assert check_file(path, LIBRARY).model is not None, check_file(path, LIBRARY).diagnostics
    text = path.read_text(encoding="utf-8")
    assert format_text(text) == text


@machine_of_each
def test_the_editor_knows_each_word_of_it(path):
    document = document_of(path)
    colours = navigation.colours(document.lines, document.occurrences, navigation.keywords(document.text))
    coloured = {(one.line, one.column): one.kind for one in colours}
    for number, line in enumerate(document.lines):
        for match in re.finditer(r"[A-Za-z_]\w*", line.partition("#")[0]):
            here = document.occurrence(number, match.start())
            if here is None:
                is_unit = re.search(r"\d *(\w+/)?$", line[: match.start()]) is not None
                is_history = match.group() in ("history", "deep_history")
                assert coloured.get((number, match.start())) is Colour.KEYWORD or is_unit or is_history, match
            elif here.column == match.start():
                assert hovering.hover(document, number, match.start()) is not None, match
        for column in range(0, len(line) + 1, 3):
            completions(document, number, column)
            hovering.open_call(document, line[:column])
    assert navigation.outline(document)


@machine_of_each
def test_what_it_declares_can_be_renamed_in_all_files(path, tmp_path):
    texts = {tmp_path / one.name: one.read_text(encoding="utf-8") for one in FILES}
    for file, text in texts.items():
        file.write_text(text, encoding="utf-8")
    document = document_of(tmp_path / path.name)
    others = [document_of(file) for file in texts if "import " in texts[file] or file.name == path.name]
    touched = [Path(one.file) for one in others]
    before = {file: codes(file) for file in touched}
    for one in document.occurrences:
        if not one.declares or one.role.name == "MACHINE":
            continue
        changed = references.rename(document, one.line, one.column, "renamed", others)
        for file in {Path(other.file) for other, _ in changed}:
            places = [place for other, place in changed if Path(other.file) == file]
            file.write_text(renamed(texts[file], places), encoding="utf-8")
        assert {file: codes(file) for file in touched} == before, one
        for file in touched:
            file.write_text(texts[file], encoding="utf-8")


def renamed(text, places):
    lines = text.split("\n")
    for one in sorted(places, key=lambda place: (place.line, -place.column)):
        line = lines[one.line]
        assert line[one.column : one.end] == one.name
        lines[one.line] = f"{line[: one.column]}renamed{line[one.end :]}"
    return "\n".join(lines)


@machine_of_each
def test_drawings_and_generated_tests_know_it(path):
    model = load_model(path, LIBRARY)
    machine = build(model)
    drawing = render(machine, "mmd").decode()
    assert all(state.own_name in drawing for state in model.states[1:] if state.kind not in HISTORY)
    found = generate(machine, steps=2000)
    results = run_suite(parse_suite(Writer(model).suite(found.scenarios), model, LIBRARY), machine)
    assert [one.failure for one in results if not one.passed] == []
    coverage = results[0].coverage
    for result in results[1:]:
        coverage = coverage.merge(result.coverage)
    unreached = " ".join(one.text for one in found.unreached)
    left = [one.text for one in points(model, coverage) if one.kind is ItemKind.TRANSITION and not one.covered]
    assert [one for one in left if one.removesuffix(" never taken") not in unreached] == []


@machine_of_each
def test_export_translates_it_or_names_what_it_cannot(path):
    model = load_model(path, LIBRARY)
    assert all(one.place is not None for one in differences(model))
    text = write_text(model)
    found = refusals(text)
    assert all("not supported" in one or "cannot be invoked" in one for one in found), found
    if not found:
        assert [one.name for one in read_text(text).states] == [one.name for one in model.states]


def refusals(text):
    """Why a chart is not read."""
    try:
        read_text(text)
    except MachineError as error:
        return [one.message for one in error.diagnostics]
    return []
