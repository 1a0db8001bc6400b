"""Coverage as HTML: each machine's source with missed items, and its diagram as a heat map."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from itertools import chain, count
from pathlib import Path
from urllib.parse import quote

from hsm.testing.coverage.data import Measured
from hsm.testing.coverage.heat import heat_map
from hsm.testing.coverage.items import CoverageItem, ItemKind, share
from hsm.testing.coverage.table import COLUMNS
from hsm.testing.report_page import report_page

_STYLE = """
th, td { padding: .2rem .8rem; text-align: right; }
th:first-child, td:first-child { text-align: left; }
pre { margin: 0; font: 13px/1.45 ui-monospace, monospace; }
.source { border: 1px solid var(--line); overflow-x: auto; margin: 1rem 0; }
.source div { display: flex; }
.source .number, .source .count { flex: none; width: 4rem; text-align: right; opacity: .6; padding-right: .8rem; }
.source .why { color: #c0392b; padding-left: 9.6rem; white-space: pre-wrap; font-size: 12px; }
.map svg { max-width: 100%; height: auto; background: white; }
.map, .map .state { display: flex; flex-wrap: wrap; gap: .5rem; align-items: flex-start; }
.map .state { border: 1px solid var(--line); border-radius: .5rem; padding: .3rem .6rem; }
.map .never { border-style: dashed; }
"""


INDEX = "index.html"
"""The index page of a report."""


def html_pages(machines: Sequence[Measured]) -> dict[str, str]:
    """A report as files, by name: a page for each machine, and the index.

    Machines of the same name, or named like the index, get separate pages.
    """
    names = _page_names(machines)
    pages = {name: _machine_page(machine) for name, machine in zip(names, machines, strict=True)}
    rows = [
        _row(f'<a href="{escape(quote(name))}">{escape(machine.file)}</a>', machine.points)
        for name, machine in zip(names, machines, strict=True)
    ]
    heads = "".join(f"<th>{escape(kind.value)}</th>" for kind in COLUMNS)
    body = f"<h1>Coverage of machines</h1><table><tr><th>Machine</th>{heads}<th>Cover</th></tr>{''.join(rows)}</table>"
    return pages | {INDEX: report_page("Coverage of machines", _STYLE, body)}


def _page_names(machines: Sequence[Measured]) -> list[str]:
    """A file name for each machine's page: no two alike, also where a file system ignores case."""
    taken = {INDEX}
    names = []
    for machine in machines:
        stem = machine.model.name
        candidates = (f"{stem}{number}.html" for number in chain([""], (f"-{more}" for more in count(2))))
        name = next(one for one in candidates if one.lower() not in taken)
        taken.add(name.lower())
        names.append(name)
    return names


def _machine_page(machine: Measured) -> str:
    points = machine.points
    heads = "".join(f"<th>{escape(kind.value)}</th>" for kind in COLUMNS)
    parts = [
        f'<p><a href="{INDEX}">All machines</a></p><h1>{escape(machine.model.name)}</h1>',
        f"<table><tr><th>Machine</th>{heads}<th>Cover</th></tr>{_row(escape(machine.file), points)}</table>",
        heat_map(machine),
    ]
    for file in machine.model.files:
        path = Path(file)
        if path.is_file():
            parts.append(f"<h2>{escape(file)}</h2>")
            parts.append(_source(path.read_text(encoding="utf-8"), [one for one in points if _in(one, file)]))
    return report_page(f"Coverage of {machine.model.name}", _STYLE, "".join(parts))


def _in(point: CoverageItem, file: str) -> bool:
    return point.place is not None and point.place.file == file


def _row(name: str, points: Iterable[CoverageItem]) -> str:
    listed = list(points)
    cells = []
    for kind in COLUMNS:
        own = [one.covered for one in listed if one.kind is kind]
        cells.append(f"<td>{sum(own)}/{len(own)}</td>" if own else "<td>-</td>")
    return f"<tr><td>{name}</td>{''.join(cells)}<td>{share(listed):.1f}%</td></tr>"


def _source(text: str, points: Sequence[CoverageItem]) -> str:
    """The lines of a file, coloured by coverage, with the missed items below each."""
    by_line: dict[int, list[CoverageItem]] = {}
    for point in points:
        if point.place is not None:
            by_line.setdefault(point.place.line, []).append(point)
    rows = []
    for number, line in enumerate(text.split("\n"), 1):
        here = by_line.get(number, [])
        missed = [one for one in here if not one.covered]
        style = "" if not here else "good" if not missed else "bad" if len(missed) == len(here) else "part"
        counts = [one.count for one in here if one.kind in (ItemKind.STATE, ItemKind.TRANSITION)]
        count = f"{min(counts)}&times;" if counts else ""
        rows.append(
            f'<div class="{style}"><pre class="number">{number}</pre><pre class="count">{count}</pre>'
            f"<pre>{escape(line)}</pre></div>"
        )
        rows.extend(f'<pre class="why">{escape(one.text)}</pre>' for one in missed)
    return f'<div class="source">{"".join(rows)}</div>'
