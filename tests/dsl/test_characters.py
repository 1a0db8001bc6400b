"""Characters that cannot be seen are named; digits and letters of names are those of ASCII."""

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hsm.dsl import check_text

HEAD = "machine m\nevent go\n"


def errors(text, library):
    return [one for one in check_text(text, library, "m.maze-machine").diagnostics if one.code.startswith("E")]


@pytest.mark.parametrize(
    ("character", "words"),
    [
        ("\u00a0", "a no-break space (U+00A0)"),
        ("\u200b", "a zero width space (U+200B)"),
        ("\ufeff", "a zero width no-break space (U+FEFF)"),
        ("\u2028", "a line separator (U+2028)"),
        ("\u3000", "an ideographic space (U+3000)"),
        ("\x0c", "a form feed (U+000C)"),
        ("\x0b", "a vertical tab (U+000B)"),
        ("\r", "a carriage return (U+000D)"),
        ("\0", "a NUL character (U+0000)"),
        ("\x85", "a character without a name (U+0085)"),
        ("\u0301", "a combining acute accent (U+0301)"),
        ("\u00f6", "`\u00f6` (U+00F6)"),
        ("\u2192", "`\u2192` (U+2192)"),
        ("\u0663", "`\u0663` (U+0663)"),
    ],
)
@pytest.mark.parametrize(
    "line", ["state a{}", "sta{}te a", "state a\n    on go{} -> a", "state a\n    {}on go -> a", "state a{}b"]
)
def test_a_strange_character_is_named(character, words, line, library):
    found = errors(HEAD + line.format(character), library)
    assert [one.message for one in found if one.code == "E0101"] == [f"found {words}"]
    assert next(one for one in found if one.code == "E0101").suggestion


@given(st.characters(min_codepoint=0x80, exclude_categories=["Cs"]), st.sampled_from(["1{} s", "{}1 s", "1 s{}", "{}"]))
def test_a_duration_is_written_in_ascii(character, text):
    from tests.dsl.library import make_library  # noqa: PLC0415 - hypothesis takes no fixtures of a function

    found = errors(f"machine m\nstate a\n    after {text.format(character)} -> b\nfinal b", make_library())
    assert found
    assert f"U+{ord(character):04X}" in found[0].message


def test_comments_hold_anything(library):
    assert not errors(HEAD + "# gr\u00f6\u00dfe \u00a0 \u200b\nstate a\n    on go -> a  # \u2192", library)


def test_digits_are_ascii(library):
    assert unicodedata.digit("\u0663") == 3
    found = errors("machine m\nvar n : int = \u0663\nstate a\n    when n > 2 -> a", library)
    assert found[0].suggestion == "digits are 0 to 9: write `3`"
