"""Names for characters that no line may contain: many are invisible, or look like others."""

from __future__ import annotations

import unicodedata

_CONTROLS = {
    "\0": "a NUL character",
    "\x0b": "a vertical tab",
    "\x0c": "a form feed",
    "\r": "a carriage return",
    "\x1b": "an escape character",
    "\x7f": "a delete character",
}
_MEANT = {
    "\u2192": "->",
    "\u21d2": "=>",
    "\u2212": "-",
    "\u2013": "-",
    "\u2014": "-",
    "\u00d7": "*",
    "\u00f7": "/",
    "\u2264": "<=",
    "\u2265": ">=",
    "\u2260": "!=",
    "\u00b0": "deg",
}


def is_strange(character: str) -> bool:
    """Whether a character is none of the printable ones of ASCII."""
    return not " " <= character <= "~"


def described(character: str) -> str:
    """The name of a strange character in a message: an invisible one by name and number."""
    number = f"U+{ord(character):04X}"
    if character in _CONTROLS:
        return f"{_CONTROLS[character]} ({number})"
    category = unicodedata.category(character)
    name = unicodedata.name(character, "").lower()
    if category.startswith(("C", "Z", "M")):
        words = name or "a character without a name"
        article = "" if not name else "an " if name[0] in "aeiou" else "a "
        return f"{article}{words} ({number})"
    return f"`{character}` ({number})"


def advice(character: str) -> str:
    """A suggestion for a strange character."""
    category = unicodedata.category(character)
    if character in _MEANT:
        return f"write `{_MEANT[character]}`"
    if category.startswith("Z"):
        return "replace it with a space"
    if category.startswith("C"):
        return "remove it"
    if category == "Nd":
        return f"digits are 0 to 9: write `{unicodedata.digit(character)}`"
    if category.startswith(("L", "M")):
        return "names have the letters A to Z, digits and underscores; other characters are allowed only in comments"
    return "remove it, or move it into a comment"
