"""The report that collects the diagnostics of one file."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import field, replace
from difflib import SequenceMatcher, get_close_matches
from typing import NamedTuple

from hsm.model.codes import CODES, finding
from hsm.model.diagnostics import Diagnostic, Place, Related
from hsm.model.values import dataclass


class Guess(NamedTuple):
    """The name that was probably meant by an unknown one.

    Attributes:
        name: the known name that it almost certainly is, a letter or two apart.
        text: a question for the author, also if the name is only similar.
    """

    name: str | None = None
    text: str | None = None


_MOST_GUESSES = 50
_LONGEST_GUESS = 60
_CERTAIN = 0.75
_FEW_LETTERS = 2
_MOST_REPEATS = 8


@dataclass(slots=True)
class Report:
    """The diagnostics of one file, in the order in which they were made."""

    file: str
    found: list[Diagnostic] = field(default_factory=list)
    guesses: int = 0
    _told: dict[Hashable, Diagnostic] = field(default_factory=dict)

    def guess(self, name: str, known: Iterable[str]) -> Guess:
        """The name that was probably meant by an unknown one; after too many in one file there are no more guesses."""
        self.guesses += 1
        if self.guesses > _MOST_GUESSES or len(name) > _LONGEST_GUESS:
            return Guess()
        names = [one for one in known if len(one) <= _LONGEST_GUESS]
        close = [one for one in names if one.lower() == name.lower()] or get_close_matches(name, names, n=1)
        if not close:
            return Guess()
        alike = SequenceMatcher(None, close[0].lower(), name.lower()).ratio() >= _CERTAIN
        return Guess(
            close[0] if alike and abs(len(close[0]) - len(name)) <= _FEW_LETTERS else None,
            f"did you mean `{close[0]}`?",
        )

    def add(
        self,
        code: str,
        place: Place | None,
        message: str | None = None,
        suggestion: str | None = None,
        related: tuple[Related, ...] = (),
    ) -> None:
        """Record a diagnostic; the default message is the code's title."""
        self.found.append(finding(code, place, message or CODES[code].title, suggestion, related))

    def add_once(
        self,
        code: str,
        place: Place,
        message: str,
        suggestion: str | None = None,
        *,
        subject: Hashable = None,
        again: str = "and here",
    ) -> None:
        """Record a diagnostic that may recur, such as a name that is unknown at several places.

        There is one diagnostic, at the first place; the others are reported with it.

        Args:
            code: the code.
            place: where.
            message: the reason.
            suggestion: how to fix it.
            subject: what the diagnostic is about, where several messages are about the same.
            again: the message for this place if it is not the first.
        """
        key = (code, message if subject is None else subject)
        first = self._told.get(key)
        if first is None or (len(first.related) < _MOST_REPEATS and first not in self.found):
            self.add(code, place, message, suggestion)
            self._told[key] = self.found[-1]
        elif len(first.related) < _MOST_REPEATS:
            at = self.found.index(first)
            if first.place is not None and place < first.place and first.message == message:
                place, first = first.place, replace(first, place=place)
            self._told[key] = self.found[at] = replace(first, related=(*first.related, Related(place, again)))
