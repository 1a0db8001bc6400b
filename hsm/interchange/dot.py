"""Graphs in Graphviz's language, DOT, made without Graphviz.

``DotGraph`` has the part of pygraphviz's graph that the diagrams of ``transitions`` use. It writes clusters, nodes and
edges in the order in which Graphviz itself writes a graph, since the layout depends on the order.
"""

from __future__ import annotations

from collections.abc import Iterator

Attributes = dict[str, str | None]
"""None means without colour."""


class DotNode:
    """A node.

    Attributes:
        name: its name.
        attr: its attributes.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.attr: Attributes = {}


class DotGraph:
    """A directed graph, or a cluster in one.

    Attributes:
        name: its name; empty for the whole graph.
        graph_attr: its attributes.
        node_attr: the attributes that all nodes have.
        edge_attr: the attributes that all edges have.
    """

    def __init__(self, name: str = "", within: DotGraph | None = None, /, **attributes: str) -> None:
        self.name = name
        self.graph_attr: Attributes = dict(attributes)
        self.node_attr: Attributes = {}
        self.edge_attr: Attributes = {}
        self._nodes: dict[str, DotNode] = {}  # those of this graph that are not in one of its clusters
        self._clusters: list[DotGraph] = []
        self._edges: list[tuple[str, str, Attributes]] = []
        self._known: dict[str, DotNode] = {} if within is None else within._known

    def add_node(self, name: str, **attributes: str) -> None:
        """Add a node."""
        node = self._nodes[name] = self._known[name] = DotNode(name)
        node.attr.update(attributes)

    def get_node(self, name: str) -> DotNode:
        """A node, of this graph or of any cluster."""
        return self._known[name]

    def add_edge(self, tail: str, head: str, **attributes: str) -> None:
        """Add an edge."""
        self._edges.append((tail, head, dict(attributes)))

    def add_subgraph(self, name: str, **attributes: str) -> DotGraph:
        """Add a cluster."""
        self._clusters.append(DotGraph(name, self, **attributes))
        return self._clusters[-1]

    def subgraphs_iter(self) -> Iterator[DotGraph]:
        """The clusters directly in this graph."""
        return iter(self._clusters)

    def to_string(self) -> str:
        """The text in DOT."""
        lines = ["digraph {", *self._heading()]
        for cluster in self._clusters:
            lines += cluster._text("  ")
        pending = dict(self._nodes)
        for name in self._known:
            lines += self._declared(name, pending)
            for tail, head, attributes in self._edges:
                if tail == name:
                    lines += self._declared(head, pending)
                    lines.append(f"  {_quoted(tail)} -> {_quoted(head)}{_listed(attributes)};")
        return "\n".join([*lines, "}\n"])

    @staticmethod
    def _declared(name: str, pending: dict[str, DotNode]) -> list[str]:
        node = pending.pop(name, None)
        return [] if node is None else [f"  {_quoted(name)}{_listed(node.attr)};"]

    def _heading(self) -> list[str]:
        kinds = (("graph", self.graph_attr), ("node", self.node_attr), ("edge", self.edge_attr))
        return [f"  {kind}{_listed(attributes)};" for kind, attributes in kinds if attributes]

    def _text(self, indent: str) -> list[str]:
        lines = [f"{indent}subgraph {_quoted(self.name)} {{", *(indent + line for line in self._heading())]
        for cluster in self._clusters:
            lines += cluster._text(indent + "  ")
        lines += [f"{indent}  {_quoted(name)}{_listed(node.attr)};" for name, node in self._nodes.items()]
        return [*lines, f"{indent}}}"]


def _listed(attributes: Attributes) -> str:
    given = ", ".join(f"{name}={_quoted('none' if value is None else value)}" for name, value in attributes.items())
    return f" [{given}]" if given else ""


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '\\"') + '"'
