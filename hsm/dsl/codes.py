"""The codes of all findings, and the report that collects them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches

from hsm.diagnostics import Diagnostic, Place, Related, Severity


@dataclass(frozen=True, slots=True)
class Code:
    """One kind of finding: its stable code and what it is about in a few words; the letter tells its severity."""

    name: str
    title: str

    @property
    def severity(self) -> Severity:
        """An E keeps a machine from being built, a W is likely a mistake, an N may be just what is meant."""
        return {"E": Severity.ERROR, "W": Severity.WARNING, "N": Severity.NOTE}[self.name[0]]


CODES: dict[str, Code] = {
    name: Code(name, title)
    for name, title in {
        # the text
        "E0101": "a line that cannot be read",
        "E0102": "a tab",
        "E0103": "a line that is indented under one that has no block",
        "E0104": "a bracket that is never closed",
        "E0105": "an indentation that fits no block",
        "E0106": "an expression nested too deep",
        "E0107": "a file that cannot be read",
        # names
        "E0201": "an unknown state",
        "E0202": "an unknown name in an expression",
        "E0203": "an unknown event",
        "E0204": "an unknown activity",
        "E0205": "an unknown action",
        "E0206": "an unknown type",
        "E0207": "an unknown unit",
        "E0208": "an unknown machine",
        "E0209": "a name declared twice",
        "E0210": "an unknown argument",
        "E0211": "a name that cannot be declared",
        "E0212": "a missing argument",
        "E0213": "an argument given twice or too many",
        # types and units
        "E0301": "a value of the wrong type or unit",
        "E0302": "operands that do not go together",
        "E0303": "a value that is not constant",
        "E0304": "an assignment to what cannot change",
        "E0305": "a division by zero",
        # structure
        "E0401": "a file that does not begin with its machine",
        "E0402": "a line that stands in the wrong place",
        "E0403": "a second line where only one can be",
        "E0404": "a transition that does nothing",
        "E0405": "an initial state that lies elsewhere",
        "E0406": "targets that cannot be active together",
        "E0407": "history of what has no states inside",
        "E0408": "a parallel state with fewer than two regions",
        "E0409": "a machine without a state",
        "E0410": "a ring of imports",
    }.items()
}
"""All codes, in order."""


def did_you_mean(name: str, known: Iterable[str]) -> str | None:
    """A suggestion of the known name that looks most like ``name``, if one does."""
    close = get_close_matches(name, list(known), n=1)
    return f"did you mean `{close[0]}`?" if close else None


@dataclass(slots=True)
class Report:
    """The findings of one file, in the order in which they were made."""

    file: str
    found: list[Diagnostic] = field(default_factory=list)

    def add(
        self,
        code: str,
        place: Place | None,
        message: str | None = None,
        suggestion: str | None = None,
        related: tuple[Related, ...] = (),
    ) -> None:
        """Take a finding down; without a message the code's title is one."""
        declared = CODES[code]
        message = declared.title if message is None else message
        self.found.append(Diagnostic(code, declared.severity, message, place, suggestion, related))
