"""The pictures of a machine on the page: one compound state opened at a time, the others folded.

Where Graphviz is not installed, a picture is its graph in DOT, and the page draws it with viz-js, which is Graphviz for
browsers.
"""

from __future__ import annotations

import re
from contextlib import suppress
from functools import cache
from xml.etree import ElementTree

from hsm.engine.machine import Machine
from hsm.interchange.diagrams import DiagramError, Look, NoGraphvizError, render
from hsm.interchange.folding import open_around


class Drawings:
    """Draws a machine around one of its compound states.

    Args:
        machine: the machine.
    """

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self.drawn = cache(self._drawn)

    def names(self) -> list[str]:
        """The compound states by their full names; the whole machine is called by the empty one."""
        return ["", *(state.name for state in self._machine.model.states[1:] if state.children)]

    def all(self) -> dict[str, str]:
        """The picture around each compound state, but those that cannot be drawn: the page shows an outline there."""
        found = {}
        for name in self.names():
            with suppress(DiagramError):
                found[name] = self.drawn(name)
        return found

    def _drawn(self, name: str) -> str:
        """An SVG element, or a graph in DOT.

        Raises:
            DiagramError: it cannot be drawn.
        """
        look = Look(transparent=True, guards=False, brief=True, opened=open_around(self._machine.model, [name]))
        try:
            text = render(self._machine, "svg", look).decode()
        except NoGraphvizError:
            return render(self._machine, "dot", look).decode()
        return text[text.index("<svg") :]


def drawable(drawings: Drawings) -> str:
    """Why a machine cannot be drawn; empty where it can."""
    try:
        drawings.drawn("")
    except DiagramError as error:
        return str(error)
    return ""


LONGEST_GRAPH = 100_000
"""The longest graph in DOT that is drawn for somebody else, characters."""


def is_graph(drawing: str) -> bool:
    """Whether a picture is a graph in DOT, which is still to be drawn."""
    return drawing.startswith("digraph")


_SVG = "{http://www.w3.org/2000/svg}"
_ELEMENTS = frozenset(("svg", "g", "path", "polygon", "polyline", "ellipse", "text"))
_ATTRIBUTES = frozenset(
    ("id", "class", "d", "points", "transform", "x", "y", "cx", "cy", "rx", "ry", "viewBox", "text-anchor", "font-size")
)
_VALUE = re.compile(r"[\w\s.,()+-]*", re.ASCII)


def cleaned(drawing: str) -> str:
    """The shapes and texts of a foreign picture; empty if it is not a picture.

    Colours are left out, too: the page has its own. A graph is kept; the page does the same with what it draws of it.
    """
    if is_graph(drawing):
        return drawing if len(drawing) <= LONGEST_GRAPH else ""
    try:
        root = ElementTree.fromstring(drawing)
    except ElementTree.ParseError:
        return ""
    kept = _shapes(root)
    return "" if kept is None or kept.tag != "svg" else ElementTree.tostring(kept, encoding="unicode")


def _shapes(element: ElementTree.Element) -> ElementTree.Element | None:
    name = str(element.tag).removeprefix(_SVG)
    if name not in _ELEMENTS:
        return None
    said = {key: value for key, value in element.attrib.items() if key in _ATTRIBUTES and _VALUE.fullmatch(value)}
    kept = ElementTree.Element(name, said)
    kept.text = element.text if name == "text" else None
    kept.extend(one for child in element if (one := _shapes(child)) is not None)
    return kept
