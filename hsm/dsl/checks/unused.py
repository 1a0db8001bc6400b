"""Declarations that are never used, and events that only come from outside."""

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
    "outside event": "N0601",
}
_WORDS = {
    "import": "machine `{}` is imported, but no state is an instance of it",
    "parameter": "nothing reads parameter `{}`",
    "variable": "nothing reads variable `{}`",
    "definition": "nothing uses definition `{}`",
    "event": "event `{}` is declared, but no transition uses it",
    "raised event": "event `{}` is raised, but it is not declared and no transition uses it",
    "outside event": "nothing in this file raises event `{}`",
}
_SENDERS = "an operator (`maze-machine send {0}`), a script (`run --event-at 1:{0}`) or a scenario can send it"


def check(subject: AnalysisInput) -> Iterator[Diagnostic]:
    """One diagnostic for each unused import, parameter, variable and event, and each event that comes from outside."""
    for one in subject.unused:
        senders = _SENDERS.format(one.name) if one.kind == "outside event" else None
        yield finding(_CODES[one.kind], one.place, _WORDS[one.kind].format(one.name), senders)
