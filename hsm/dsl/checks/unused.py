"""What is declared and never used."""

from __future__ import annotations

from collections.abc import Iterator

from hsm.dsl.semantics.analysis import AnalysisInput
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic

_CODES = {
    "import": "W0601",
    "parameter": "W0602",
    "variable": "W0603",
    "definition": "W0606",
    "event": "W0604",
    "raised event": "W0604",
}
_WORDS = {
    "import": "machine `{}` is imported, and no state is an instance of it",
    "parameter": "nothing reads parameter `{}`",
    "variable": "nothing reads variable `{}`",
    "definition": "nothing uses definition `{}`",
    "event": "event `{}` is declared, and no transition is on it",
    "raised event": "event `{}` is raised, and neither declared nor is any transition on it",
}


def check(subject: AnalysisInput) -> Iterator[Diagnostic]:
    """One finding for each unused import, parameter, variable and event."""
    for kind, name, place in subject.unused:
        yield finding(_CODES[kind], place, _WORDS[kind].format(name))
