"""The smallest parts of a text: words, numbers and marks, with where they are."""

from __future__ import annotations


class Token(str):
    """A part of a text.

    Attributes:
        type: its kind, which is the name of a terminal of the grammar.
        value: the text alone.
        line: its first line, from 1.
        column: the column of its first character, from 1.
        end_line: its last line.
        end_column: the column after its last character.
    """

    __slots__ = ("column", "end_column", "end_line", "line", "type", "value")

    type: str
    value: str
    line: int
    column: int
    end_line: int
    end_column: int

    def __new__(cls, kind: str, text: str, place: tuple[int, int, int, int] = (1, 1, 1, 1)) -> Token:
        """A token of a kind; its place is the first line and column, the last line and the column after the last."""
        made = str.__new__(cls, text)
        made.type, made.value = kind, text
        made.line, made.column, made.end_line, made.end_column = place
        return made

    def instead(self, text: str) -> Token:
        """Another text of the same kind in the same place."""
        return Token(self.type, text, self._place)

    @property
    def _place(self) -> tuple[int, int, int, int]:
        return self.line, self.column, self.end_line, self.end_column

    def __getnewargs__(self) -> tuple[str, str, tuple[int, int, int, int]]:  # type: ignore[override]
        """What a copy is made of."""
        return self.type, self.value, self._place

    def __repr__(self) -> str:
        return f"Token({self.type!r}, {self.value!r})"
