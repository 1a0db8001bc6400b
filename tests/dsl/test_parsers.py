"""Lark's own loop reads what ours reads, and stands in for it where lark keeps its table in another way."""

from dataclasses import fields, is_dataclass
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lark import Lark, Token

from hsm.dsl.syntax.lark_loop import LarkParser
from hsm.dsl.syntax.lark_table import TableParser
from hsm.dsl.syntax.parser import Grammar, parse, read_grammar
from tests.dsl.faults import planted
from tests.dsl.test_noise import STEWARD
from tests.dsl.test_robustness import LINES


class LarkOfAnotherVersion:
    """Lark without the private parts that our loop reads."""

    def __init__(self, lark: Lark) -> None:
        self._lark = lark
        self.terminals = lark.terminals

    def parse_interactive(self):
        return _Interactive(self._lark.parse_interactive())


class _Interactive:
    def __init__(self, parser) -> None:
        state = parser.parser_state
        self.parser_state = SimpleNamespace(state_stack=state.state_stack, value_stack=state.value_stack)
        for name in ("choices", "accepts", "feed_token", "feed_eof"):
            setattr(self, name, getattr(parser, name))


MACHINES = sorted((Path(__file__).parents[2] / "machines").glob("*.maze-machine"))
LARK = read_grammar()
OURS, THEIRS = Grammar.of(LARK), Grammar.of(LarkOfAnotherVersion(LARK))


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
