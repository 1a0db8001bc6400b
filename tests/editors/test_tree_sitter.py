"""The tree-sitter grammar reads what our own parser reads, and nothing else but what is listed here."""

from __future__ import annotations

import os
import re
from random import Random

import pytest
from hypothesis import given, settings

from hsm.dsl.syntax.parser import parse
from maze_machine.catalogue.machines import SHIPPED
from tests.dsl.charts_at_random import carelessly, chart_text
from tests.dsl.machines_at_random import machines
from tests.editors.grammar import FOLDER, captures, corpus, parser, query
from tests.editors.programs import random_edit, random_program

PROGRAMS = int(os.environ.get("MAZE_MACHINE_PROGRAMS", "300"))
"""How many random programs are tried; 10,000 take some minutes."""
CORPUS = [case for file in sorted((FOLDER / "test" / "corpus").glob("*.txt")) for case in corpus(file)]
MACHINES = sorted(SHIPPED.glob("*.maze-machine"))


def has_error(text: str) -> bool:
    return parser().parse(text.encode()).root_node.has_error


def without_tabs(text: str) -> str:
    return text.replace("\t", "    ")


@pytest.mark.parametrize(("title", "text", "tree"), CORPUS, ids=[title for title, _, _ in CORPUS])
def test_a_case_of_the_corpus_has_its_tree(title, text, tree):
    found = str(parser().parse(f"{text}\n".encode()).root_node)
    assert re.sub(r"\b\w+: ", "", found) == re.sub(r"\b\w+: ", "", tree)


@pytest.mark.parametrize("ends", ["\n", "\r\n"], ids=["LF", "CRLF"])
@pytest.mark.parametrize("path", MACHINES, ids=lambda path: path.stem)
def test_a_shipped_machine_has_the_same_tree_however_it_is_saved(path, ends):
    text = path.read_text(encoding="utf-8")
    tree = str(parser().parse(text.encode()).root_node)
    assert "ERROR" not in tree
    assert "MISSING" not in tree
    for other in (text.replace("\n", ends), text.rstrip("\n"), text.replace("    ", "\t"), f"\n\n{text}\n\n   "):
        assert str(parser().parse(other.replace("\r\n", "\n").replace("\n", ends).encode()).root_node) == tree
    states = [line.split()[1] for line in text.split("\n") if re.match(r" *(state|parallel|final) ", line)]
    assert sorted(captures("locals", text)["local.definition.type"]) == sorted(states)


@pytest.mark.parametrize("width", [1, 4])
def test_65_levels(width):
    lines = [f"{' ' * width * level}state s{level}" for level in range(65)]
    text = "\n".join([*lines, " " * width * 65 + "stay", "final end"])
    root = parser().parse(text.encode()).root_node
    assert not root.has_error
    assert [child.type for child in root.children] == ["state", "final"]
    assert str(root).count("(block") == 65
    assert has_error(text.replace("final", f"{' ' * width * 66}stay\nfinal"))


def test_random_programs_are_read_and_broken_ones_are_not():
    accepted = rejected = 0
    for seed in range(PROGRAMS):
        draw = Random(seed)
        text = random_program(draw)
        for _ in range(3):
            if parse(without_tabs(text), "random")[1]:
                rejected += 1
                assert has_error(text), (seed, text)
            else:
                accepted += 1
                assert not has_error(text), (seed, text)
            begin, end, written = random_edit(draw, text)
            text = text[:begin] + written + text[end:]
    assert accepted > PROGRAMS
    assert rejected > PROGRAMS


@settings(max_examples=40, deadline=None, derandomize=True)
@given(machines())
def test_a_random_machine_that_means_something_is_read(text):
    assert not has_error(text)


def test_a_random_chart_is_read_in_any_layout():
    for seed in range(200):
        text = chart_text(seed, instances=seed % 2 == 1)
        assert not has_error(text), seed
        assert not has_error(carelessly(text, Random(seed))), seed


def test_an_edited_tree_equals_a_fresh_one():
    edits = differing = 0
    for seed in range(PROGRAMS):
        draw = Random(seed)
        text = random_program(draw)
        tree = parser().parse(text.encode())
        for _ in range(3):
            begin, end, written = random_edit(draw, text)
            new = text[:begin] + written + text[end:]
            first, old_end, new_end = (_point(text, begin), _point(text, end), _point(new, begin + len(written)))
            tree.edit(first[0], old_end[0], new_end[0], first[1], old_end[1], new_end[1])
            text = new
            tree, fresh = parser().parse(text.encode(), tree), parser().parse(text.encode())
            edits += 1
            if list(_nodes(tree)) != list(_nodes(fresh)):
                # Round an error tree-sitter seldom finds another way than from the beginning.
                assert fresh.root_node.has_error, (seed, text)
                assert tree.root_node.has_error, (seed, text)
                differing += 1
                break
    assert differing <= edits // 1000


def _point(text: str, offset: int) -> tuple[int, tuple[int, int]]:
    """A position in bytes, and as row and column."""
    before = text[:offset].encode()
    row = before.count(b"\n")
    return len(before), (row, len(before) - before.rfind(b"\n") - 1)


def _nodes(tree):
    pending = [tree.root_node]
    while pending:
        node = pending.pop()
        yield node.type, node.start_byte, node.end_byte, node.start_point, node.end_point, node.is_missing
        pending += node.children


SAMPLE = """\
machine m
# Why.
param near : length = 0.5 m
state a
    do drive(speed = 0.3 m/s)
    when space.left and not true -> b / n += f(2)
final b
"""


def test_colours():
    found = captures("highlights", SAMPLE)
    assert found["comment"] == ["# Why."]
    assert found["number"] == ["0.5 m", "0.3 m/s", "2"]
    assert found["function.call"] == ["drive", "f"]
    assert found["type"] == ["a", "b", "b"]
    assert found["keyword.operator"] == ["and", "not"]
    assert found["boolean"] == ["true"]
    assert found["module"] == ["m"]
    assert found["variable.parameter"] == ["speed"]
    assert set(found["operator"]) == {"=", "->", "+="}


def test_folds_indentation_and_injections():
    assert [text.split("\n")[0] for text in captures("folds", SAMPLE)["fold"]] == ["# Why.", "state a"]
    assert [text.split("\n")[0] for text in captures("indents", SAMPLE)["indent.begin"]][:1] == ["state a"]
    assert captures("injections", SAMPLE)["injection.content"] == ["# Why."]


def test_every_query_is_of_this_grammar():
    for file in (FOLDER / "queries").glob("**/*.scm"):
        query(str(file.relative_to(FOLDER / "queries").with_suffix("")))
