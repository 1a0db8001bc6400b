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
_SENDERS = "an operator (`maze-machine send {0}`), a script (`run --event-at {1}`) or a scenario can send it"


def check(subject: AnalysisInput) -> Iterator[Diagnostic]:
    """One diagnostic for each unused import, parameter, variable and event, and each event that comes from outside."""
    for one in subject.unused:
        senders = _senders(subject, one.name) if one.kind == "outside event" else None
        yield finding(_CODES[one.kind], one.place, _WORDS[one.kind].format(one.name), senders)


def _senders(subject: AnalysisInput, event: str) -> str:
    """Who can send an event, as it is typed: what it carries is in parentheses, which a shell needs quotes for."""
    data = subject.model.data_of(event)
    if data is None:
        return _SENDERS.format(event, f"1:{event}")
    written = f"{event}({', '.join(f'{one.name} = ...' for one in data.fields)})"
    return _SENDERS.format(f"'{written}'", f"'1:{written}'")
