"""Machines drawn, with the diagram support of the library ``transitions``: Graphviz pictures and Mermaid text.

States lie within states; regions of a parallel state have a dashed border; history is a circle with an H (H* where it
is deep); final states have a double border. A state shows its activity, its entry and exit actions, and its internal
transitions; a transition shows trigger, guard and actions; time-outs are dashed. In pictures the transitions of a state
and their texts share a colour; those with the same ends share the line.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from difflib import get_close_matches
from itertools import cycle
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from transitions.extensions.diagrams_mermaid import NestedGraph as MermaidGraph
from transitions.extensions.diagrams_pygraphviz import NestedGraph

from hsm.interchange.dot import DotGraph
from hsm.interchange.drawing import DrawingError, drawn, installed
from hsm.interchange.folding import Excerpt, Opened, everything, excerpt
from hsm.model.chart import Model, State, StateKind, Timed, Transition
from hsm.model.topology import HISTORY, Topology
from hsm.model.unparse import action_text, activity_text, trigger_text
from hsm.model.values import dataclass

if TYPE_CHECKING:
    from hsm.engine.machine import Machine

FORMATS = ("svg", "png", "dot", "mmd")
"""The formats of a diagram: pictures, Graphviz's language, Mermaid's language."""

WIDTH = 32
"""Longer lines at transitions are broken, before `if`, `and`, `or` and `/` rather than elsewhere."""

BRIEF, BRIEF_LINES = 24, 3
"""In brief, a transition has that many characters, and several on one line that many lines."""

WIDTH_IN_STATES = 36
"""Longer lines in states are broken too."""

DEPTH = 60
"""States nested deeper than this are not drawn."""

_ENTITIES = {"#": "#35;", ";": "#59;", "<": "#lt;", ">": "#gt;", '"': "#quot;", ":": "#58;"}
_FONT = "Helvetica"
_BREAKS = re.compile(r" (?=(?:if|and|or|/) )")


@dataclass(frozen=True, slots=True)
class Theme:
    """The colours of a picture.

    Attributes:
        paper: the background.
        text: of states, and their borders.
        state: within states.
        compound: within states that have states in them.
        parallel: within parallel states.
        note: within the note with the machine's own transitions.
        initial: arrows to what is entered by default.
        inks: of transitions and their texts, source by source.
    """

    paper: str
    text: str
    state: str
    compound: str
    parallel: str
    note: str
    initial: str
    inks: tuple[str, ...]


THEMES = {
    "light": Theme(
        "white", "#222222", "white", "#f4f6f8", "#e9eef3", "#fffbe6", "#6b6b6b",
        ("#1f4e79", "#8a3b12", "#2e6b34", "#6a3d7c", "#6e5600", "#8c2346", "#00636b", "#444444"),
    ),
    "dark": Theme(
        "#16191d", "#e6e6e6", "#2a2f36", "#1e2228", "#242a31", "#3a3520", "#9a9a9a",
        ("#8ec2f2", "#f0a987", "#94d49c", "#d0ace2", "#dcc56a", "#f09ab4", "#7ed4db", "#cfcfcf"),
    ),
}  # fmt: skip
"""The themes by name; every text has a contrast of 4.5:1 or more to its ground (WCAG AA)."""


@dataclass(frozen=True, slots=True)
class Look:
    """How a machine is drawn.

    Attributes:
        theme: name of a theme.
        transparent: with a transparent background.
        guards: with the conditions after ``if``.
        brief: shortened texts of transitions and states, for an interactive picture.
        opened: which states show their inner states.
        within: full name of the only state that is shown; None for the whole machine.
        fills: colours of states by their full names.
    """

    theme: str = "light"
    transparent: bool = False
    guards: bool = True
    brief: bool = False
    opened: Opened = everything
    within: str | None = None
    fills: Mapping[str, str] = field(default_factory=dict)


def _styles(theme: Theme) -> dict[str, dict[str, dict[str, str]]]:
    node = {"style": "rounded,filled", "shape": "box", "fillcolor": theme.state, "color": theme.text}
    return {
        "node": {"default": node, "parallel": node},
        "edge": {"default": {"color": theme.text}},
        "graph": {
            "default": {"style": "rounded,filled", "fillcolor": theme.compound, "color": theme.text},
            "parallel": {"style": "rounded,filled,dashed", "fillcolor": theme.parallel, "color": theme.text},
        },
    }


_MERMAID_STYLES = {
    "node": {"default": {"fillcolor": "white", "color": "black"}, "parallel": {"fillcolor": "white", "color": "black"}}
}


class DiagramError(Exception):
    """A diagram that cannot be drawn; the message says why and what to do."""


class NoGraphvizError(DiagramError):
    """Graphviz is not installed."""


_AS_IT_IS = Look()


def render(machine: Machine, form: str, look: Look = _AS_IT_IS) -> bytes:
    """A diagram as the contents of a file.

    In SVG the states are groups with the ids ``state_INDEX``, the transitions groups with the classes ``tINDEX``, by
    their indices in the machine's model.

    Args:
        machine: the machine.
        form: one of ``FORMATS``.
        look: how it is drawn.

    Raises:
        DiagramError: there is no such form or state, Graphviz is not installed (``dot`` and ``mmd`` do without), or the
            states are nested too deep to be drawn.
    """
    if form not in FORMATS:
        raise DiagramError(f"a diagram is written as {', '.join(FORMATS)}, not as `{form}`")
    try:
        part = excerpt(machine.model, look.opened, look.within)
    except LookupError:
        close = get_close_matches(str(look.within), [one.name for one in machine.model.states[1:]], 1)
        hint = f"; did you mean `{close[0]}`?" if close else ""
        raise DiagramError(f"machine {machine.model.name} has no state `{look.within}`{hint}") from None
    depth = Topology(part.model).depth
    if depth > DEPTH:
        raise DiagramError(f"states nested {depth} deep cannot be drawn; {DEPTH} can")
    if form == "mmd":
        return _mermaid(part, look).encode()
    text: str = _Picture(part, look).fsm_graph.to_string()
    if form == "dot":
        return text.encode()
    if not installed():
        message = 'this picture needs pygraphviz, which is not installed; pip install "maze-machine[diagrams]"'
        raise NoGraphvizError(f"{message}, or write a .dot or .mmd file")
    try:
        return drawn(text, form)
    except DrawingError as error:
        raise DiagramError(f"{error}; show less of it (--state, --depth), or write a .mmd") from None


def node_id(model: Model, index: int) -> str:
    """The title of a state's group in an SVG picture; that of a state with states in it begins with ``cluster_``."""
    return f"{'cluster_' if model.states[index].children else ''}{_path(model, index)}"


def edge_id(index: int) -> str:
    """A word among the classes of a transition's group in an SVG picture; the index is that in the machine's model."""
    return f"t{index}"


def _mermaid(part: Excerpt, look: Look) -> str:
    model = part.model
    config = _config(part, look, "\\n".join, _mermaid_text)
    adapter = _adapter(model, config, _MERMAID_STYLES, {"rankdir": "TB"})
    return f"{MermaidGraph(adapter).get_graph().draw(None)}\n"


def _mermaid_text(line: str) -> str:
    """A line of text with Mermaid's own marks written as entities."""
    return "".join(_ENTITIES.get(mark, mark) for mark in line)


def _adapter(model: Model, config: dict[str, Any], styles: Any, attributes: dict[str, Any]) -> Any:
    """The interface that the diagrams of ``transitions`` require of a machine."""
    return SimpleNamespace(
        title=model.name,
        initial=config["initial"],
        machine_attributes=attributes,
        style_attributes=styles,
        state_cls=SimpleNamespace(separator="_"),
        show_state_attributes=False,
        show_conditions=False,
        get_markup_config=lambda: config,
    )


def _config(part: Excerpt, look: Look, join: Callable[[list[str]], str], clean: Callable[[str], str]) -> dict[str, Any]:
    """The machine as ``transitions`` describes machines to its diagrams; states go by their index."""
    model = part.model
    made: list[dict[str, Any]] = []
    for state in model.states:
        one: dict[str, Any] = {
            "name": _id(state.index),
            "label": join([clean(line) for line in _lines(part, look, state)]),
        }
        if state.children:
            one["children"] = []
            initial = [_id(child) for child in state.initial if child in state.children]
            one["initial"] = [] if state.kind is StateKind.PARALLEL else (initial or [""])[0]
        if state.kind is StateKind.FINAL:
            one["final"] = True
        made.append(one)
        if state.index:
            made[state.parent]["children"].append(one)
    transitions = [
        {
            "source": _path(model, transition.source),
            "dest": _path(model, target),
            "trigger": join([clean(line) for line in _wrapped(_transition_text(transition, look), WIDTH)]) or " ",
        }
        for transition in model.transitions
        for target in transition.targets
        if transition.source
    ]
    return {
        "states": made[0].get("children", []),
        "transitions": transitions,
        "initial": _id(model.states[0].initial[0]),
    }


def _id(index: int) -> str:
    return f"s{index}"


def _path(model: Model, index: int) -> str:
    names = []
    while index > 0:
        names.append(_id(index))
        index = model.states[index].parent
    return "_".join(reversed(names))


def _lines(part: Excerpt, look: Look, state: State) -> list[str]:
    """The text of a state."""
    model = part.model
    if state.kind in HISTORY:
        return ["H*" if state.kind is StateKind.DEEP_HISTORY else "H"]
    lines = [state.own_name + (f" = {state.instance}" if state.instance else "")]
    if state.activity is not None:
        text = f"do {state.activity.activity.name if look.brief else activity_text(state.activity)}"
        lines += _wrapped(text, WIDTH_IN_STATES)
    if look.brief:
        return [*lines, *([f"+ {part.folded[state.index]} states"] if state.index in part.folded else [])]
    for word, actions in (("entry", state.entry), ("exit", state.exit)):
        if actions:
            lines += _wrapped(f"{word} / {', '.join(map(action_text, actions))}", WIDTH_IN_STATES)
    for index in state.transitions:
        if not model.transitions[index].targets:
            lines += _wrapped(_transition_text(model.transitions[index], look), WIDTH_IN_STATES)
    if state.index in part.folded:
        lines.append(f"+ {part.folded[state.index]} states")
    return lines


def _transition_text(transition: Transition, look: Look) -> str:
    text = trigger_text(transition.trigger, transition.guard if look.guards else None)
    if transition.actions and not look.brief:
        text += f" / {', '.join(map(action_text, transition.actions))}"
    return _brief(text.strip()) if look.brief else text.strip()


def _brief(text: str) -> str:
    return text if len(text) <= BRIEF else f"{text[: BRIEF - 2].rstrip()} ..."


def _bundle_label(bundle: Sequence[Transition], look: Look) -> str:
    """The label of the line of several transitions."""
    texts = [_transition_text(one, look) for one in bundle]
    if look.brief:
        texts = list(dict.fromkeys(texts))
        if len(texts) > BRIEF_LINES:
            texts = [*texts[: BRIEF_LINES - 1], f"+ {len(texts) - BRIEF_LINES + 1} more"]
    return "".join(map(_paragraph, texts))


def _wrapped(text: str, width: int) -> list[str]:
    lines: list[str] = []
    for part in _BREAKS.split(text):
        if lines and len(lines[-1]) + 1 + len(part) <= width:
            lines[-1] += f" {part}"
        else:
            lines += textwrap.wrap(part, width, break_long_words=False, break_on_hyphens=False)
    return lines


def _paragraph(text: str) -> str:
    """A transition's text in a label; continuation lines are indented."""
    first, *rest = _wrapped(text, WIDTH) or [""]
    return "".join(rf"{line}\l" for line in (first, *(f"   {line}" for line in rest)))


def _bundles(transitions: Iterable[Transition]) -> Iterable[list[Transition]]:
    """Transitions with the same ends and the same style, together."""
    found: dict[tuple[int, tuple[int, ...], bool], list[Transition]] = {}
    for one in transitions:
        found.setdefault((one.source, one.targets, isinstance(one.trigger, Timed)), []).append(one)
    return found.values()


class _Picture(NestedGraph):
    """A Graphviz picture: the nested graph of ``transitions``, with what statecharts have beyond it."""

    def __init__(self, part: Excerpt, look: Look) -> None:
        self._part, self._look = part, look
        self._model = model = part.model
        self._fills = look.fills
        self._theme = theme = THEMES[look.theme]
        self._inks = dict(zip(sorted({one.source for one in model.transitions}), cycle(theme.inks), strict=False))
        self._attributes = {
            "compound": "true",
            "rankdir": "TB",
            "bgcolor": "transparent" if look.transparent else theme.paper,
            "fontname": _FONT,
            "fontcolor": theme.text,
            "nodesep": "0.25",
            "ranksep": "0.35",
        }
        self._config = _config(part, look, r"\l".join, str)
        super().__init__(_adapter(model, self._config, _styles(theme), self._attributes))

    def generate(self) -> None:
        """Draw states and transitions, then the parts that ``transitions`` does not support."""
        graph = self.fsm_graph = DotGraph(**self._attributes)
        styles = _styles(self._theme)
        graph.node_attr.update(styles["node"]["default"])
        graph.edge_attr.update(styles["edge"]["default"])
        self._add_nodes(self._config["states"], graph)
        self._add_edges(None, graph)
        graph.node_attr.update(fontname=_FONT, fontsize="11", margin="0.12,0.06", fontcolor=self._theme.text)
        graph.edge_attr.update(fontname=_FONT, fontsize="11", arrowsize="0.7")
        for state in self._model.states[1:]:
            if not state.children:
                self._shape(state)
            elif state.kind is StateKind.PARALLEL:
                graph.get_node(self._anchor(state.index)).attr.update(style="invis")
        for state in self._model.states:
            self._mark_initial(state)
        self._mark_machine()
        self._colour(graph)

    def _shape(self, state: State) -> None:
        node = self.fsm_graph.get_node(_path(self._model, state.index))
        node.attr.update(id=f"state_{self._part.states[state.index]}")
        if state.index in self._part.folded:
            node.attr.update(shape="box3d", fillcolor=self._theme.compound)
        if state.kind in HISTORY:
            label = _lines(self._part, self._look, state)[0]
            node.attr.update(shape="circle", label=label, width="0.3", margin="0", fixedsize="true")
        elif state.kind is StateKind.FINAL:
            node.attr.update(peripheries="2")
        if state.name in self._fills:
            node.attr.update(fillcolor=self._fills[state.name])

    def _mark_initial(self, state: State) -> None:
        """An arrow from a dot to the initial state."""
        graph = self.fsm_graph
        if state.kind is StateKind.PARALLEL or not state.initial:
            return
        source = _path(self._model, state.index)
        if not state.index:
            source = "start"
            graph.add_node(
                source, shape="point", width="0.12", label="", fillcolor=self._theme.text, color=self._theme.text
            )
        for target in state.initial:
            graph.add_edge(
                source, self._anchor(target), **self._head(target), style="bold", color=self._theme.initial, label=""
            )

    def _mark_machine(self) -> None:
        """The transitions of the whole machine start from a note with its name."""
        root = self._model.states[0]
        if not root.transitions:
            return
        graph = self.fsm_graph
        graph.add_node("machine", shape="note", style="filled", fillcolor=self._theme.note, label=self._label(root))
        for bundle in _bundles(self._model.transitions[index] for index in root.transitions):
            self._edge("machine", bundle)

    def _label(self, state: State) -> str:
        return "".join(rf"{line}\l" for line in _lines(self._part, self._look, state))

    def _add_edges(self, _transitions: Any, _container: Any) -> None:
        """Draw the transitions from one state to another as one line with a text for each; time-outs are apart."""
        for bundle in _bundles(one for one in self._model.transitions if one.source):
            self._edge(self._tail(bundle[0]), bundle)

    def _edge(self, source: str, bundle: Sequence[Transition]) -> None:
        transition = bundle[0]
        label = _bundle_label(bundle, self._look)
        ink = self._inks[transition.source]
        names = " ".join(edge_id(self._part.transitions[one.index]) for one in bundle)
        style = {"color": ink, "fontcolor": ink, "class": names}
        if isinstance(transition.trigger, Timed):
            style["style"] = "dashed"
        states = self._model.states
        for target in transition.targets:
            ends = self._head(target)
            if states[target].children and transition.source == target:
                ends = {}
            inside = target in states[transition.source].subtree[1:]
            if states[transition.source].children and transition.source and not inside and transition.source != target:
                ends["ltail"] = f"cluster_{_path(self._model, transition.source)}"
            if states[target].children and transition.source in states[target].subtree[1:]:
                ends.pop("lhead", None)
            self.fsm_graph.add_edge(source, self._anchor(target), label=label, **ends, **style)

    def _anchor(self, index: int) -> str:
        return _path(self._model, index)

    def _tail(self, transition: Transition) -> str:
        """Where a transition starts: at the last state inside, so that what comes after a state lies below it."""
        states = self._model.states
        source = states[transition.source]
        leaves = [one.index for one in states[source.index + 1 : source.last + 1] if not one.children]
        within = any(source.index <= target <= source.last for target in transition.targets)
        outward = [one for one in leaves if states[one].kind not in HISTORY]
        return self._anchor(outward[-1] if outward and not within else source.index)

    def _head(self, index: int) -> dict[str, str]:
        """An arrow to a state with states in it ends at its border."""
        return {"lhead": f"cluster_{_path(self._model, index)}"} if self._model.states[index].children else {}

    def _colour(self, graph: DotGraph) -> None:
        compounds = {
            f"cluster_{_path(self._model, state.index)}": state for state in self._model.states if state.children
        }
        pending = list(graph.subgraphs_iter())
        while pending:
            cluster = pending.pop()
            cluster.graph_attr.update(rank="", fontsize="12")  # forced ranks would squeeze the labels together
            cluster.graph_attr.update(id=f"in_{cluster.name}")  # without one it has that of what is around it
            if cluster.name in compounds:
                state = compounds[cluster.name]
                cluster.graph_attr.update(id=f"state_{self._part.states[state.index]}")
                if state.name in self._fills:
                    cluster.graph_attr.update(fillcolor=self._fills[state.name])
            pending.extend(cluster.subgraphs_iter())
