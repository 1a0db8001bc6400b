"""The diagram of a file as it is in the editor: a picture whose states and transitions lead back to the text."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hsm.dsl.loading import check_text
from hsm.dsl.lsp import protocol
from hsm.dsl.lsp.document import Document
from hsm.engine.machine import Machine
from hsm.interchange.diagrams import DiagramError, edge_id, node_id, render
from hsm.model.chart import Model, State, StateKind, Transition
from hsm.model.diagnostics import Place, Severity
from hsm.model.topology import HISTORY
from hsm.model.unparse import activity_text, trigger_text

PictureJson = Mapping[str, Any]


def diagram(document: Document) -> PictureJson:
    """A file as a picture, with its contents.

    Returns:
        ``{"machine", "svg", "states", "transitions"}``, or ``{"problem"}`` where the file cannot be drawn. A state has
        ``id`` (of its group in the picture), ``name``, ``label``, ``kind``, ``parent`` (an id, or None), ``doing``,
        ``uri`` and ``range``; a transition ``id``, ``source`` and ``targets`` (ids), ``text``, ``uri`` and ``range``.
    """
    checked = check_text(document.text, document.library, document.file, remarks=False)
    if checked.model is None:
        errors = [one for one in checked.diagnostics if one.severity is Severity.ERROR]
        first = errors[0]
        where = "" if first.place is None else f"{Path(first.place.file).name}:{first.place.line}: "
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        return {"problem": f"{where}{first.message}{more}"}
    machine: Machine[Any, Any] = Machine(checked.model)
    try:
        drawn = render(machine, "svg").decode()
    except DiagramError as error:
        return {"problem": str(error)}
    places = _Places(document, checked.sources)
    model = checked.model
    return {
        "machine": model.name,
        "svg": drawn[drawn.index("<svg") :],
        "states": [_state(model, one, places) for one in model.states[1:] if one.kind not in HISTORY],
        "transitions": [_transition(model, one, places) for one in model.transitions],
    }


class _Places:
    """Places in the terms of the protocol."""

    def __init__(self, document: Document, sources: Mapping[str, str]) -> None:
        self._lines = {file: protocol.lines_of(text) for file, text in sources.items()}
        self._lines[document.file] = list(document.tree.lines)

    def __call__(self, place: Place | None) -> dict[str, Any]:
        if place is None:
            return {"uri": None, "range": None}
        found = protocol.range_of_place(place, self._lines.get(place.file, ()))
        ends = [{"line": end.line, "character": end.character} for end in (found.start, found.end)]
        return {"uri": protocol.uri_of(place.file), "range": {"start": ends[0], "end": ends[1]}}


def _state(model: Model, state: State, places: _Places) -> dict[str, Any]:
    instance = f" = {state.instance}" if state.instance else ""
    return {
        "id": node_id(model, state.index),
        "name": state.name,
        "label": f"{state.own_name}{instance}",
        "kind": state.kind.value if state.kind is not StateKind.ATOMIC else "state",
        "parent": node_id(model, state.parent) if state.parent > 0 else None,
        "doing": "" if state.activity is None else activity_text(state.activity),
        **places(state.place),
    }


def _transition(model: Model, one: Transition, places: _Places) -> dict[str, Any]:
    return {
        "id": edge_id(one.index),
        "source": node_id(model, one.source) if one.source else None,
        "targets": [node_id(model, target) for target in one.targets],
        "text": trigger_text(one.trigger, one.guard).strip(),
        **places(one.place),
    }
