"""The examples of the language's reference are machines without a fault, in their canonical form."""

import re
from pathlib import Path

import pytest

from hsm.dsl import check_text
from hsm.dsl.format.formatter import format_text
from hsm.dsl.syntax.lexer import STATEMENTS
from hsm.model.codes import CODES
from hsm.model.types import QUANTITY_NAMES, UNITS

PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "language.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"```maze-machine.*?\n(.*?)```", PAGE, re.DOTALL)


@pytest.mark.parametrize("text", EXAMPLES, ids=lambda text: re.search(r"machine (\w+)", text)[1])
def test_an_example(text, library):
    checked = check_text(text, library, str(Path(__file__).parent / "machines" / "page.maze-machine"))
    assert [str(found) for found in checked.diagnostics if found.code[0] != "N"] == []
    assert checked.model is not None


def test_the_first_example_is_in_canonical_form():
    assert format_text(EXAMPLES[0]) == EXAMPLES[0]


def test_all_words_types_units_and_codes_of_the_page_exist():
    listed = re.search(r"begin with \(`([a-z ]+?)`\)", PAGE.replace("\n", " "))[1]
    assert set(listed.split()) == STATEMENTS
    for name in (*QUANTITY_NAMES.values(), *UNITS):
        assert re.search(rf"\b{re.escape(name)}", PAGE), name
    assert set(re.findall(r"\b[EWN]\d{4}\b", PAGE)) <= CODES.keys()
