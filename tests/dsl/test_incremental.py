"""A text under edit: what is kept from one keystroke to the next gives the same as reading everything anew."""

from dataclasses import fields, is_dataclass

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hsm.dsl import check_text
from hsm.dsl.lsp import actions, navigation, refactoring
from hsm.dsl.lsp.completion import completions
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.edited import MachineFile
from hsm.dsl.lsp.hovering import hover, open_call
from hsm.dsl.lsp.workspace import Documents
from hsm.dsl.syntax.parser import BlockParser, parse
from hsm.dsl.syntax.tokens import Token
from maze_machine.catalogue.library import robot_names
from maze_machine.catalogue.machines import SHIPPED

LIBRARY = robot_names()
TEXTS = [path.read_text(encoding="utf-8") for path in sorted(SHIPPED.glob("*.maze-machine"))]
PIECES = [
    *(
        "\n",
        "\n\n",
        " ",
        "    ",
        "\t",
        "#",
        "# accept N0701\n",
        "\r\n",
        "(",
        ")",
        ",",
        "->",
        "=>",
        "/",
        "é",
        "\U0001f6aa",
    ),
    *(
        "state x\n",
        "    do stop()\n",
        "    on done -> x\n",
        "when space.left",
        "on ",
        "if ",
        "machine q\n",
        "initial x\n",
    ),
    *(
        "import pledge\n",
        "param p : length = 1 m\n",
        "var v : int = 0\n",
        "property p : never v > 1\n",
        "event e\n",
        "1 s",
    ),
]
EDIT = st.tuples(st.floats(0, 1), st.sampled_from([0, 0, 0, 1, 7, 60]), st.sampled_from(["", *PIECES]))


def edited(text, edit):
    where, length, piece = edit
    begin = int(where * len(text))
    return text[:begin] + piece + text[begin + length :]


def shape(node):
    """A syntax tree with the place of every token, which tokens leave out when they are compared."""
    if isinstance(node, Token):
        return (node.type, str(node), node.line, node.column, node.end_line, node.end_column)
    if isinstance(node, tuple):
        return [shape(one) for one in node]
    if is_dataclass(node):
        return (type(node).__name__, [shape(getattr(node, one.name)) for one in fields(node)])
    return node


@settings(max_examples=60, deadline=None)
@given(text=st.sampled_from(TEXTS), edits=st.lists(EDIT, min_size=1, max_size=6))
@example(TEXTS[0], [(0.5, 0, "\r\n"), (0.5, 0, "\r\n")])  # a line end within another: \r\r\n\n
def test_reading_what_has_changed_gives_the_same_as_reading_all(text, edits):
    parser = BlockParser()
    for edit in edits:
        text = edited(text, edit)
        known, fresh = parser.parse(text, "f"), parse(text, "f")
        assert shape(known[0]) == shape(fresh[0])
        assert known[1] == fresh[1]


@settings(max_examples=40, deadline=None)
@given(text=st.sampled_from(TEXTS), edits=st.lists(EDIT, min_size=1, max_size=4), line=st.integers(0, 80))
def test_an_edited_document_is_like_one_that_was_just_opened(text, edits, line):
    file = str(SHIPPED / "edited.maze-machine")
    documents = Documents(lambda _: LIBRARY)
    documents.update(file, text)
    documents.diagnostics(file)
    for edit in edits:
        text = edited(text, edit)
        documents.update(file, text)
        documents.diagnostics(file)
    known, fresh = documents[file], Document(text, file, LIBRARY)
    own = [one for one in check_text(text, LIBRARY, file).diagnostics if one.place and one.place.file == file]
    assert list(documents.diagnostics(file)) == own
    assert known.occurrences == fresh.occurrences
    assert navigation.outline(known) == navigation.outline(fresh)
    for column in (0, 4, 12, 30):  # nothing that an editor asks ends in an error
        assert completions(known, line, column) == completions(fresh, line, column)
        assert hover(known, line, column) == hover(fresh, line, column)
        assert navigation.definition(known, line, column) == navigation.definition(fresh, line, column)
        assert open_call(known, known.before(line, column)) == open_call(fresh, fresh.before(line, column))
    assert list(actions.fixes(known, own)) == list(actions.fixes(fresh, own))
    assert list(refactoring.refactorings(known, line)) == list(refactoring.refactorings(fresh, line))
    assert MachineFile(known).colours() == MachineFile(fresh).colours()


@pytest.fixture
def importing(tmp_path):
    inner = tmp_path / "inner.maze-machine"
    inner.write_text("machine inner\n\ninitial a\n\nstate a\n    do stop()\n    after 1 s -> over\n\nfinal over\n")
    text = "machine outer\n\nimport inner\n\ninitial x\n\nstate x = inner()\n    on over -> x\n"
    documents = Documents(lambda _: LIBRARY)
    file = str(tmp_path / "outer.maze-machine")
    documents.update(file, text)
    assert documents.diagnostics(file) == ()
    return inner, documents, file, text


def test_an_import_that_is_written_anew_is_compiled_anew(importing):
    inner, documents, file, text = importing
    inner.write_text(inner.read_text().replace("over", "arrived"))
    documents.update(file, f"{text}\n")
    codes = [one.code for one in documents.diagnostics(file)]
    assert codes == [one.code for one in check_text(f"{text}\n", LIBRARY, file).diagnostics if one.place.file == file]
    assert codes


def test_an_import_that_is_gone_is_missed(importing):
    inner, documents, file, text = importing
    inner.unlink()
    documents.update(file, f"{text}\n")
    assert "E0208" in [one.code for one in documents.diagnostics(file)]
    inner.write_text("machine inner\n\ninitial over\n\nfinal over\n")
    documents.update(file, f"{text}\n\n")
    assert "E0208" not in [one.code for one in documents.diagnostics(file)]


def test_a_cycle_of_imports_is_told_the_same_from_everywhere(tmp_path):
    documents = Documents(lambda _: LIBRARY)
    texts = {}
    for name, other in (("one", "two"), ("two", "one")):
        path = tmp_path / f"{name}.maze-machine"
        texts[str(path)] = f"machine {name}\n\nimport {other}\n\ninitial x\n\nstate x = {other}()\n"
        path.write_text(texts[str(path)])
    for _ in range(2):
        for file, text in texts.items():
            documents.update(file, text)
            fresh = [one for one in check_text(text, LIBRARY, file).diagnostics if one.place.file == file]
            assert list(documents.diagnostics(file)) == fresh
            texts[file] = f"{text}\n"
