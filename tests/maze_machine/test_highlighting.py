"""Colours: nothing of a text is lost or unknown, and words are what they are."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pygments.lexers import get_lexer_by_name, get_lexer_for_filename
from pygments.token import Comment, Error, Keyword, Name, Number

from hsm.dsl.lsp import navigation
from hsm.dsl.lsp.document import Document
from maze_machine.catalogue.machines import SHIPPED
from tests.dsl.library import make_library

FILES = sorted(path for path in SHIPPED.iterdir() if path.suffix in (".maze-machine", ".maze-test"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_shipped_file_is_coloured_without_rest(path: Path):
    text = path.read_text(encoding="utf-8")
    lexer = get_lexer_for_filename(path.name, stripnl=False, ensurenl=False)
    tokens = list(lexer.get_tokens(text))
    assert "".join(value for _, value in tokens) == text
    assert not [value for kind, value in tokens if kind is Error]


def test_words_are_what_they_are():
    text = "# Walks.\nstate on_way\n    do drive(speed = 0.3 m/s)\n    when space.left and not tried -> over\n"
    tokens = list(get_lexer_by_name("maze-machine").get_tokens(text))
    assert (Comment.Single, "# Walks.") in tokens
    assert (Name.Class, "on_way") in tokens
    assert (Keyword, "do") in tokens
    assert (Name.Function, "drive") in tokens
    assert (Number, "0.3 m/s") in tokens
    assert [value for kind, value in tokens if kind is Keyword] == ["do", "when", "and", "not"]
    assert (Name.Class, "over") in tokens


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.text(max_size=200), st.sampled_from(["maze-machine", "maze-test"]))
def test_any_text_keeps_its_letters(text, name):
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    lexer = get_lexer_by_name(name, stripnl=False, ensurenl=False)
    assert "".join(value for _, value in lexer.get_tokens(text)) == text


CONSTRUCTS = sorted((Path(__file__).parents[1] / "dsl" / "constructs").glob("*.maze-machine"))


@pytest.mark.parametrize("path", CONSTRUCTS, ids=lambda path: path.stem)
def test_a_keyword_of_the_editor_is_one_here(path: Path):
    text = path.read_text(encoding="utf-8")
    document = Document(text, str(path), make_library())
    colours = navigation.colours(document.lines, document.occurrences, navigation.keywords(text))
    due = {(one.line, one.column) for one in colours if one.kind is navigation.Colour.KEYWORD}
    found, line, column = set(), 0, 0
    for kind, value in get_lexer_by_name("maze-machine", stripnl=False, ensurenl=False).get_tokens(text):
        if kind in Keyword:
            found.add((line, column))
        line, column = line + value.count("\n"), len(value.rpartition("\n")[2]) + (0 if "\n" in value else column)
    assert due <= found
