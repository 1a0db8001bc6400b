"""Coverage in formats that existing services and editors read: LCOV and Cobertura."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree as Xml

from hsm.model.values import dataclass
from hsm.testing.coverage.data import Measured
from hsm.testing.coverage.items import ItemKind

_LINES = (ItemKind.STATE, ItemKind.TRANSITION)
_BRANCHES = (ItemKind.GUARD, ItemKind.CONDITION)


@dataclass(slots=True)
class SourceLines:
    """One source file, counted by lines.

    Attributes:
        hits: how often what is declared on a line was entered or taken; of several the least.
        branches: the outcomes of guards and conditions on a line: text and count.
        functions: states by name: line and count.
    """

    hits: dict[int, int] = field(default_factory=dict)
    branches: dict[int, list[tuple[str, int]]] = field(default_factory=dict)
    functions: dict[str, tuple[int, int]] = field(default_factory=dict)


class _Counted(NamedTuple):
    """What is counted over all instances of a machine."""

    file: str
    kind: ItemKind
    own: object
    line: int
    column: int

    def place(self) -> tuple[str, int, int, str, str]:
        """Its place among the others."""
        return self.file, self.line, self.column, self.kind.value, str(self.own)


def by_source(machines: Sequence[Measured]) -> dict[str, SourceLines]:
    """Coverage by source file and line, added up over the instances of a machine."""
    seen: dict[_Counted, int] = {}
    for machine in machines:
        for point in machine.points:
            if point.place is not None:
                own: object = point.key[2:]
                if point.kind is ItemKind.STATE:
                    own = str(point.key[1]).rpartition(".")[2]
                key = _Counted(str(Path(point.place.file)), point.kind, own, point.place.line, point.place.column)
                seen[key] = seen.get(key, 0) + point.count
    found: dict[str, SourceLines] = {}
    for (file, kind, own, line, _), count in sorted(seen.items(), key=lambda one: one[0].place()):
        source = found.setdefault(file, SourceLines())
        if kind in _LINES:
            source.hits[line] = min(source.hits.get(line, count), count)
            if kind is ItemKind.STATE:
                source.functions[str(own)] = (line, count)
        elif kind in _BRANCHES:
            source.branches.setdefault(line, []).append((f"{kind.value} {own}", count))
    return found


def lcov(machines: Sequence[Measured]) -> str:
    """An LCOV tracefile (man geninfo, section "FILES"): states and transitions are lines, guards' outcomes branches."""
    lines: list[str] = []
    for file, source in by_source(machines).items():
        lines += ["TN:", f"SF:{file}"]
        lines += [f"FN:{line},{name}" for name, (line, _) in source.functions.items()]
        lines += [f"FNDA:{count},{name}" for name, (_, count) in source.functions.items()]
        entered = sum(count > 0 for _, count in source.functions.values())
        lines += [f"FNF:{len(source.functions)}", f"FNH:{entered}"]
        branches = 0
        taken = 0
        for line, found in source.branches.items():
            for number, (_, count) in enumerate(found):
                lines.append(f"BRDA:{line},0,{number},{count if source.hits.get(line) or count else '-'}")
                branches += 1
                taken += count > 0
        lines += [f"BRF:{branches}", f"BRH:{taken}"]
        lines += [f"DA:{line},{count}" for line, count in sorted(source.hits.items())]
        lines += [f"LF:{len(source.hits)}", f"LH:{sum(map(bool, source.hits.values()))}", "end_of_record"]
    return "\n".join(lines) + "\n"


def cobertura(machines: Sequence[Measured]) -> str:
    """A Cobertura report (coverage-04.dtd): a machine's file is a class, guards' outcomes are its branches."""
    files = by_source(machines)
    root = Xml.Element("coverage", _rates(list(files.values())) | {"version": "1", "timestamp": "0", "complexity": "0"})
    Xml.SubElement(Xml.SubElement(root, "sources"), "source").text = "."
    package = Xml.SubElement(
        Xml.SubElement(root, "packages"),
        "package",
        {"name": "machines", **_rates(list(files.values())), "complexity": "0"},
    )
    classes = Xml.SubElement(package, "classes")
    for file, source in files.items():
        rates = _rates([source])
        entry = Xml.SubElement(
            classes, "class", {"name": Path(file).stem, "filename": file, **rates, "complexity": "0"}
        )
        Xml.SubElement(entry, "methods")
        lines = Xml.SubElement(entry, "lines")
        for line, count in sorted(source.hits.items()):
            attributes = {"number": str(line), "hits": str(count), "branch": "false"}
            found = source.branches.get(line, [])
            if found:
                taken = sum(count > 0 for _, count in found)
                part = f"{100 * taken // len(found)}% ({taken}/{len(found)})"
                attributes |= {"branch": "true", "condition-coverage": part}
            Xml.SubElement(lines, "line", attributes)
    Xml.indent(root)
    return '<?xml version="1.0" ?>\n' + Xml.tostring(root, encoding="unicode") + "\n"


def _rates(sources: Sequence[SourceLines]) -> dict[str, str]:
    hits = [count > 0 for source in sources for count in source.hits.values()]
    taken = [count > 0 for source in sources for found in source.branches.values() for _, count in found]
    return {
        "line-rate": f"{sum(hits) / max(1, len(hits)):.4f}",
        "branch-rate": f"{sum(taken) / max(1, len(taken)):.4f}",
    }
