"""The matrix of requirements as one HTML page without scripts."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

from hsm.testing.report_page import report_page
from hsm.testing.requirements.matrix import Matrix, RequirementRow, Standing

PAGE = "requirements.html"
"""The name of the page."""

_STYLE = """
th, td { padding: .3rem .8rem; text-align: left; vertical-align: top; }
ul { margin: 0; padding-left: 1.2rem; }
"""

_CLASSES = {
    Standing.MET: "good",
    Standing.UNDECIDED: "part",
    Standing.FAILED: "bad",
    Standing.UNCOVERED: "bad",
}


def html_page(matrix: Matrix) -> str:
    """The page."""
    heads = ("Requirement", "", "Standing", "Properties", "Scenarios", "States")
    rows = "".join(map(_row, matrix.rows))
    title = f"Requirements of {matrix.machine}"
    rest = (("Properties", matrix.properties), ("Scenarios", matrix.scenarios), ("States", matrix.states))
    left = "".join(f"<h3>{escape(head)}</h3>{_listed(names)}" for head, names in rest if names)
    body = (
        f"<h1>{escape(title)}</h1><table><tr>{''.join(f'<th>{one}</th>' for one in heads)}</tr>{rows}</table>"
        f"<h2>Without a requirement</h2>{left or '<p>Nothing.</p>'}"
    )
    return report_page(title, _STYLE, body)


def _row(row: RequirementRow) -> str:
    properties = (f"{one.name}: {one.status.value}" for one in row.properties)
    scenarios = (f"{one.scenario.name}: {'passed' if one.passed else 'FAILED'}" for one in row.scenarios)
    return (
        f'<tr class="{_CLASSES[row.standing]}"><td>{escape(row.requirement.name)}</td>'
        f"<td>{escape(row.requirement.text)}</td><td>{row.standing.value}</td>"
        f"<td>{_listed(properties)}</td><td>{_listed(scenarios)}</td><td>{_listed(row.states)}</td></tr>"
    )


def _listed(texts: Iterable[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(one)}</li>' for one in texts)}</ul>"
