"""Coverage to look at: each machine's source with what was missed, and its diagram with what was entered most."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

from hsm.testing.coverage.data import Measured
from hsm.testing.coverage.heat import heat_map
from hsm.testing.coverage.items import Kind, Point, share
from hsm.testing.coverage.table import COLUMNS

_STYLE = """
:root { color-scheme: light dark; --good: #2a7d4f22; --bad: #c0392b33; --part: #c8a02b33; --line: #8884; }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 75rem; padding: 0 1rem; }
table { border-collapse: collapse; }
th, td { padding: .2rem .8rem; text-align: right; border-bottom: 1px solid var(--line); }
th:first-child, td:first-child { text-align: left; }
pre { margin: 0; font: 13px/1.45 ui-monospace, monospace; }
.source { border: 1px solid var(--line); overflow-x: auto; margin: 1rem 0; }
.source div { display: flex; }
.source .number, .source .count { flex: none; width: 4rem; text-align: right; opacity: .6; padding-right: .8rem; }
.good { background: var(--good); }
.bad { background: var(--bad); }
.part { background: var(--part); }
.source .why { color: #c0392b; padding-left: 9.6rem; white-space: pre-wrap; font-size: 12px; }
.map svg { max-width: 100%; height: auto; background: white; }
.map, .map .state { display: flex; flex-wrap: wrap; gap: .5rem; align-items: flex-start; }
.map .state { border: 1px solid var(--line); border-radius: .5rem; padding: .3rem .6rem; }
.map .never { border-style: dashed; }
"""


def write_html(folder: Path, machines: Sequence[Measured]) -> Path:
    """Write a report: a page for each machine and one that leads to them.

    Args:
        folder: where to; made if need be.
        machines: what was exercised of them.

    Returns:
        The page to begin with.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for machine in machines:
        page = folder / f"{machine.model.name}.html"
        page.write_text(_machine_page(machine), encoding="utf-8", newline="\n")
        rows.append(_row(f'<a href="{page.name}">{escape(machine.file)}</a>', machine.points))
    heads = "".join(f"<th>{escape(kind.value)}</th>" for kind in COLUMNS)
    body = f"<h1>Coverage of machines</h1><table><tr><th>Machine</th>{heads}<th>Cover</th></tr>{''.join(rows)}</table>"
    index = folder / "index.html"
    index.write_text(_page("Coverage of machines", body), encoding="utf-8", newline="\n")
    return index


def _machine_page(machine: Measured) -> str:
    points = machine.points
    heads = "".join(f"<th>{escape(kind.value)}</th>" for kind in COLUMNS)
    parts = [
        f'<p><a href="index.html">All machines</a></p><h1>{escape(machine.model.name)}</h1>',
        f"<table><tr><th>Machine</th>{heads}<th>Cover</th></tr>{_row(escape(machine.file), points)}</table>",
        heat_map(machine),
    ]
    for file in machine.model.files:
        path = Path(file)
        if path.is_file():
            parts.append(f"<h2>{escape(file)}</h2>")
            parts.append(_source(path.read_text(encoding="utf-8"), [one for one in points if _in(one, file)]))
    return _page(f"Coverage of {machine.model.name}", "".join(parts))


def _in(point: Point, file: str) -> bool:
    return point.place is not None and point.place.file == file


def _row(name: str, points: Iterable[Point]) -> str:
    listed = list(points)
    cells = []
    for kind in COLUMNS:
        own = [one.covered for one in listed if one.kind is kind]
        cells.append(f"<td>{sum(own)}/{len(own)}</td>" if own else "<td>-</td>")
    return f"<tr><td>{name}</td>{''.join(cells)}<td>{share(listed):.1f}%</td></tr>"


def _source(text: str, points: Sequence[Point]) -> str:
    """The lines of a file, coloured by what was covered, with what was missed below each."""
    by_line: dict[int, list[Point]] = {}
    for point in points:
        if point.place is not None:
            by_line.setdefault(point.place.line, []).append(point)
    rows = []
    for number, line in enumerate(text.split("\n"), 1):
        here = by_line.get(number, [])
        missed = [one for one in here if not one.covered]
        style = "" if not here else "good" if not missed else "bad" if len(missed) == len(here) else "part"
        counts = [one.count for one in here if one.kind in (Kind.STATE, Kind.TRANSITION)]
        count = f"{min(counts)}&times;" if counts else ""
        rows.append(
            f'<div class="{style}"><pre class="number">{number}</pre><pre class="count">{count}</pre>'
            f"<pre>{escape(line)}</pre></div>"
        )
        rows.extend(f'<pre class="why">{escape(one.text)}</pre>' for one in missed)
    return f'<div class="source">{"".join(rows)}</div>'


def _page(title: str, body: str) -> str:
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{_STYLE}</style><body>{body}</body></html>\n"
    )
