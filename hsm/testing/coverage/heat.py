"""How often each state was entered, as colours: on the machine's diagram, or as boxes where none can be drawn."""

from __future__ import annotations

from html import escape
from math import log1p

from hsm.engine.machine import build
from hsm.interchange.diagrams import DiagramError, Look, render
from hsm.model.chart import Model
from hsm.model.topology import HISTORY
from hsm.testing.coverage.data import Measured

_COLD, _WARM = (214, 232, 247), (247, 150, 112)


def heat_map(machine: Measured) -> str:
    """A section of a page: the states, the warmer the more often they were entered, white where they never were."""
    fills = fills_of(machine)
    try:
        drawing = render(build(machine.model), "svg", Look(fills=fills)).decode()
        picture = drawing[drawing.index("<svg") :]
    except DiagramError:
        picture = _boxes(machine, fills)
    return f'<h2>Entered</h2><div class="map">{picture}</div>'


def fills_of(machine: Measured) -> dict[str, str]:
    """The colour of each innermost state that was entered, by its full name."""
    innermost = (state for state in machine.model.states if not state.children)
    counts = {state.name: machine.coverage.states.get(state.index, 0) for state in innermost}
    hottest = log1p(max(1, *counts.values()))
    return {name: _colour(log1p(count) / hottest) for name, count in counts.items() if count}


def _colour(heat: float) -> str:
    mixed = (round(cold + heat * (warm - cold)) for cold, warm in zip(_COLD, _WARM, strict=True))
    return "#" + "".join(f"{part:02x}" for part in mixed)


def _boxes(machine: Measured, fills: dict[str, str]) -> str:
    model: Model = machine.model
    parts: list[str] = []
    open_until: list[int] = []
    for state in model.states[1:]:
        while open_until and state.index > open_until[-1]:
            open_until.pop()
            parts.append("</div>")
        if state.kind in HISTORY:
            continue
        count = machine.coverage.states.get(state.index, 0)
        fill = f"background: {fills[state.name]}; color: black" if state.name in fills else ""
        kind = "state" if count else "state never"
        name = escape(state.name.rpartition(".")[2])
        parts.append(f'<div class="{kind}" style="{fill}"><b>{name}</b> {count}&times;')
        open_until.append(state.last)
    return "".join(parts) + "</div>" * len(open_until)
