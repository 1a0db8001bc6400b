"""Lark's own loop reads what ours reads, and stands in for it where lark keeps its table in another way."""

from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lark import Lark

from hsm.dsl.syntax import parser
from hsm.dsl.syntax.lark_loop import LarkParser
from hsm.dsl.syntax.lark_table import grammar_of
from hsm.dsl.syntax.parse_table import TableParser
from hsm.dsl.syntax.parser import Grammar, parse, read_grammar
from hsm.dsl.syntax.tokens import Token
from tests.dsl.faults import planted
from tests.dsl.test_noise import STEWARD
from tests.dsl.test_robustness import LINES

MACHINES = sorted((Path(__file__).parents[2] / "machines").glob("*.maze-machine"))
LARK = read_grammar()
OURS, THEIRS = Grammar.of(grammar_of(LARK)), Grammar.of_lark(LARK)


def agree(text):
    ours, theirs = parse(text, "m.maze-machine", OURS), parse(text, "m.maze-machine", THEIRS)
    assert ours == theirs
    assert list(tokens(ours[0])) == list(tokens(theirs[0]))


def tokens(node):
    """All tokens of a tree with where they are, which does not count when they are compared."""
    if isinstance(node, Token):
        yield node.type, node.value, node.line, node.column, node.end_line, node.end_column
    elif isinstance(node, tuple):
        for part in node:
            yield from tokens(part)
    elif is_dataclass(node):
        for one in fields(node):
            yield from tokens(getattr(node, one.name))


def test_the_table_is_run_by_our_loop_and_without_it_by_the_loop_of_lark():
    assert isinstance(OURS.begin(), TableParser)
    assert isinstance(THEIRS.begin(), LarkParser)


@pytest.fixture
def other_lark(monkeypatch):
    """Lark without the private parts that our table is made of."""
    parse_interactive = Lark.parse_interactive

    def without_table(self):
        parser = parse_interactive(self)
        state = parser.parser_state
        seen = SimpleNamespace(
            parser_state=SimpleNamespace(state_stack=state.state_stack, value_stack=state.value_stack)
        )
        for name in ("choices", "accepts", "feed_token", "feed_eof"):
            setattr(seen, name, getattr(parser, name))
        return seen

    monkeypatch.setattr(Lark, "parse_interactive", without_table)


@pytest.mark.usefixtures("other_lark")
def test_where_lark_keeps_its_table_in_another_way_its_own_loop_reads(monkeypatch, tmp_path):
    monkeypatch.setattr("platformdirs.user_cache_path", lambda _: tmp_path)
    monkeypatch.setattr("hsm.dsl.syntax.parser._grammar", cache(parser._grammar.__wrapped__))
    assert isinstance(parser._grammar().begin(), LarkParser)
    assert parse(MACHINES[0].read_text(encoding="utf-8"), "m")[1] == []
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "path", sorted((Path(__file__).parents[2] / "machines").glob("*.maze-machine")), ids=lambda one: one.stem
)
def test_both_read_the_shipped_machines(path):
    agree(path.read_text(encoding="utf-8"))


def test_both_go_on_behind_a_mistake():
    for fault in list(planted(STEWARD))[::119]:
        agree(fault.text)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.lists(LINES, max_size=12))
def test_both_read_random_lines(lines):
    agree("\n".join(["machine m", *lines]))
