"""Readable messages for invalid values: pydantic's errors, reworded."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

from transport.base import KINDS

_BOUNDS = {
    "greater_than": ("gt", "more than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}
_SIZES = {
    "string_too_long": ("max_length", "at most {} characters"),
    "string_too_short": ("min_length", "at least {} characters"),
    "too_long": ("max_length", "at most {} values"),
    "too_short": ("min_length", "at least {} values"),
}
_LONGEST = 80
_SHAPES = {
    "float_parsing": "a number",
    "float_type": "a number",
    "finite_number": "a finite number",
    "int_parsing": "a whole number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "bool_parsing": "true or false",
    "bool_type": "true or false",
    "string_type": "a text",
    "tuple_type": "several values",
    "dict_type": "a section",
    "model_type": "a section",
}


def printable(text: str) -> str:
    """A text that is safe for a terminal: control characters and lone surrogates are replaced by ``?``.

    Escape codes in a foreign name could otherwise move the cursor, hide text or worse.
    """
    return "".join(one if one.isprintable() else "?" for one in text)


def shortened(text: str) -> str:
    """A text of any length as a message shows it."""
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def in_words(found: ErrorDetails) -> str:
    """One error as a sentence: ```limits.speed` must be more than 0, not -1``."""
    return printable(_sentence(found))


def _sentence(found: ErrorDetails) -> str:
    kind, limits = found["type"], found.get("ctx", {})
    subject = f"`{place}` " if (place := key_of(found["loc"])) else ""
    if kind == "extra_forbidden":
        return f"{subject}is not known"
    if kind == "missing":
        return f"{subject}is missing"
    if kind == "value_error":
        return f"{subject}{found['msg'].removeprefix('Value error, ')}"
    if kind == "union_tag_invalid":
        return f"{subject}must have `kind`, one of {limits['expected_tags']}, not {_shortened(limits['tag'])}"
    if kind == "union_tag_not_found":  # which tags there are, pydantic does not say
        return f"{subject}must have `kind`" + (f", one of {', '.join(map(repr, KINDS))}" if subject else "")
    if kind == "json_invalid":
        return f"{subject}must be JSON: {limits['error']}"
    if kind == "string_pattern_mismatch":
        return f"{subject}must match {limits['pattern']}, not {_shortened(found['input'])}"
    return f"{subject}must be {_wanted(kind, limits)}, not {_shortened(found['input'])}"


def _shortened(value: object) -> str:
    try:
        return shortened(repr(value))
    except (ValueError, RecursionError):  # a number of too many digits, a table in a table in a table ...
        return "this"


def key_of(location: tuple[int | str, ...]) -> str:
    """The key that an error's location means, as it is written: which kind of base is meant is not part of it."""
    return ".".join(str(part) for part in location if part not in KINDS)


def _wanted(kind: str, limits: dict[str, object]) -> str:
    if kind in _BOUNDS:
        limit, words = _BOUNDS[kind]
        bound = limits[limit]
        return f"{words} {bound if isinstance(bound, int) else f'{bound:g}'}"
    if kind in _SIZES:
        limit, words = _SIZES[kind]
        return f"{words.format(limits[limit])} long"
    if kind in ("literal_error", "enum"):
        return f"one of {limits['expected']}"
    return _SHAPES.get(kind, "a value of another kind")
