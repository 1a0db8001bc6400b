"""The report that collects the findings of one file."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import NamedTuple

from hsm.codes import CODES, finding
from hsm.diagnostics import Diagnostic, Place, Related


class Guess(NamedTuple):
    """The known name that an unknown one was probably meant to be, with the question whether it was; or neither."""

    name: str | None = None
    text: str | None = None


_MOST_GUESSES = 50
_LONGEST_GUESS = 60


@dataclass(slots=True)
class Report:
    """The findings of one file, in the order in which they were made."""

    file: str
    found: list[Diagnostic] = field(default_factory=list)
    guesses: int = 0

    def guess(self, name: str, known: Iterable[str]) -> Guess:
        """What may have been meant by an unknown name; a file with very many of them gets no more guesses."""
        self.guesses += 1
        if self.guesses > _MOST_GUESSES or len(name) > _LONGEST_GUESS:
            return Guess()
        close = get_close_matches(name, [one for one in known if len(one) <= _LONGEST_GUESS], n=1)
        return Guess(close[0], f"did you mean `{close[0]}`?") if close else Guess()

    def add(
        self,
        code: str,
        place: Place | None,
        message: str | None = None,
        suggestion: str | None = None,
        related: tuple[Related, ...] = (),
    ) -> None:
        """Take a finding down; without a message the code's title is one."""
        self.found.append(finding(code, place, message or CODES[code].title, suggestion, related))
