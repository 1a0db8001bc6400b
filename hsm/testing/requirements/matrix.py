"""The matrix of a machine's requirements: the properties, scenarios and states of each, and what none covers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from typing import Any

from hsm.model.chart import Model
from hsm.model.expressions import Active
from hsm.model.properties import Property, conditions_of
from hsm.model.rewriting import parts_of
from hsm.model.topology import HISTORY
from hsm.model.values import dataclass
from hsm.testing.proofs.verdicts import NO_FAULT, PropertyVerdict
from hsm.testing.scenarios.running import ScenarioResult
from hsm.testing.scenarios.scenarios import Requirement, Suite


class Standing(Enum):
    """Whether a requirement is covered; the value is for a person."""

    MET = "covered"
    FAILED = "FAILED"
    UNDECIDED = "not decided"
    UNCOVERED = "NOT COVERED"


@dataclass(frozen=True, slots=True)
class RequirementRow:
    """One requirement.

    Attributes:
        requirement: as it is stated; without a text where it is only named.
        properties: the verdicts on the properties that cover it.
        scenarios: the results of the scenarios that cover it.
        states: those that its scenarios enter or its properties name, in the order of the document.
    """

    requirement: Requirement
    properties: tuple[PropertyVerdict, ...]
    scenarios: tuple[ScenarioResult, ...]
    states: tuple[str, ...]

    @property
    def standing(self) -> Standing:
        """Whether it is covered, and all that covers it is right."""
        if not (self.properties or self.scenarios):
            return Standing.UNCOVERED
        if any(one.violated for one in self.properties) or not all(one.passed for one in self.scenarios):
            return Standing.FAILED
        return Standing.MET if all(one.proved for one in self.properties) else Standing.UNDECIDED


@dataclass(frozen=True, slots=True)
class Matrix:
    """The requirements of a machine, and what belongs to none of them.

    Attributes:
        machine: its name.
        rows: the stated requirements in the order of the files, then those that are only named.
        properties: the properties that cover none.
        scenarios: the scenarios that cover none.
        states: the states that no requirement comes to.
    """

    machine: str
    rows: tuple[RequirementRow, ...]
    properties: tuple[str, ...]
    scenarios: tuple[str, ...]
    states: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether there are requirements, and all of them are covered by what passes."""
        return bool(self.rows) and all(one.standing is Standing.MET for one in self.rows)

    def lines(self) -> list[str]:
        """The matrix for a person."""
        met = sum(one.standing is Standing.MET for one in self.rows)
        found = [f"{self.machine}: {len(self.rows)} requirement{'s' * (len(self.rows) != 1)}, {met} covered"]
        for row in self.rows:
            text = f" {row.requirement.text}" if row.requirement.text else ""
            found.append(f"  {row.requirement.name}{text}: {row.standing.value}")
            found += [f"      property {_verdict(one)}" for one in row.properties]
            found += [f"      scenario {one.scenario.name}: {_result(one)}" for one in row.scenarios]
            found += [f"      states {', '.join(row.states)}"] if row.states else []
        rest = [
            _counted(self.properties, "property", "properties", named=True),
            _counted(self.scenarios, "scenario", "scenarios", named=False),
            _counted(self.states, "state", "states", named=True),
        ]
        return [*found, f"  without a requirement: {'; '.join(one for one in rest if one) or 'nothing'}"]

    def as_json(self) -> dict[str, Any]:
        """The matrix as JSON values."""
        return {
            "machine": self.machine,
            "covered": self.passed,
            "requirements": [
                {
                    "name": row.requirement.name,
                    "text": row.requirement.text or None,
                    "place": str(row.requirement.place) if row.requirement.place is not None else None,
                    "standing": row.standing.value.lower(),
                    "properties": [{"name": one.name, "verdict": one.status.value} for one in row.properties],
                    "scenarios": [{"name": one.scenario.name, "passed": one.passed} for one in row.scenarios],
                    "states": list(row.states),
                }
                for row in self.rows
            ],
            "uncovered": {
                "requirements": [one.requirement.name for one in self.rows if one.standing is Standing.UNCOVERED],
                "properties": list(self.properties),
                "scenarios": list(self.scenarios),
                "states": list(self.states),
            },
        }


def matrix(
    model: Model, suites: Sequence[Suite], results: Sequence[ScenarioResult], verdicts: Sequence[PropertyVerdict]
) -> Matrix:
    """The matrix of a machine.

    Args:
        model: the machine.
        suites: its scenarios with the requirements that they state and cover.
        results: of all these scenarios.
        verdicts: on its properties.
    """
    stated = {one.name: one for suite in suites for one in suite.requirements}
    covered: dict[str, set[str]] = {}
    for suite in suites:
        for name, requirements in suite.covered.items():
            covered.setdefault(name, set()).update(requirements)
    named = [*(name for names in covered.values() for name in sorted(names))]
    named += [name for one in results for name in one.scenario.covers]
    known = stated | {name: Requirement(name, "") for name in named if name not in stated}
    claims = {one.name: one for one in model.properties}
    rows = [
        _row(
            model,
            requirement,
            [one for one in verdicts if requirement.name in covered.get(one.name, ())],
            [one for one in results if requirement.name in one.scenario.covers],
            claims,
        )
        for requirement in known.values()
    ]
    touched = {name for row in rows for name in row.states}
    return Matrix(
        model.name,
        tuple(rows),
        tuple(one.name for one in verdicts if one.name != NO_FAULT and not covered.get(one.name)),
        tuple(one.scenario.name for one in results if not one.scenario.covers),
        tuple(name for name in _states(model) if name not in touched),
    )


def _row(
    model: Model,
    requirement: Requirement,
    properties: Sequence[PropertyVerdict],
    scenarios: Sequence[ScenarioResult],
    claims: Mapping[str, Property],
) -> RequirementRow:
    entered = {model.states[index].name for one in scenarios for index in one.coverage.states}
    entered |= {name for one in properties for name in _mentioned(claims[one.name])}
    states = tuple(name for name in _states(model) if name in entered)
    return RequirementRow(requirement, tuple(properties), tuple(scenarios), states)


def _mentioned(stated: Property) -> Iterator[str]:
    """The states that a property names."""
    for condition in conditions_of(stated.claim):
        yield from (part.state for part in parts_of(condition) if isinstance(part, Active))


def _states(model: Model) -> Iterator[str]:
    return (state.name for state in model.states[1:] if state.kind not in HISTORY)


def _counted(names: Sequence[str], one: str, many: str, *, named: bool) -> str:
    """How many there are, with their names; empty where there are none."""
    if not names:
        return ""
    listed = f" ({', '.join(names)})" if named else ""
    return f"{len(names)} {one if len(names) == 1 else many}{listed}"


def _verdict(verdict: PropertyVerdict) -> str:
    return f"{verdict.name}: {verdict.status.value}"


def _result(result: ScenarioResult) -> str:
    return "passed" if result.passed else "FAILED"
