"""The parts of ``maze-machine test``, each with a result: text, JSON, and whether it passed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from hsm.engine.machine import Machine
from hsm.model.chart import Model
from hsm.testing.coverage.data import Measured, Measurements
from hsm.testing.coverage.html import INDEX, html_pages
from hsm.testing.coverage.lcov import cobertura, lcov
from hsm.testing.coverage.table import coverage_table, missed_lines, total_share
from hsm.testing.generation.generating import MOST_STEPS as MOST_GENERATED
from hsm.testing.generation.generating import generate
from hsm.testing.mutation.mutating import survey
from hsm.testing.mutation.operators import Mutant
from hsm.testing.proofs.possible import UNREACHABLE, unreachable
from hsm.testing.proofs.proving import examine
from hsm.testing.proofs.verdicts import Assumptions, PropertyVerdict, Status
from hsm.testing.requirements.html import PAGE, html_page
from hsm.testing.requirements.matrix import Matrix, matrix
from hsm.testing.scenarios.running import Failure, ScenarioResult, run_suite
from hsm.testing.scenarios.scenarios import Suite
from hsm.testing.scenarios.tested_machine import TestedMachine
from hsm.testing.scenarios.watching import watches
from hsm.testing.scenarios.writing import Writer
from maze_machine.errors import UsageError
from transport.files import write_text


@dataclass(frozen=True, slots=True)
class TrialReport:
    """The result.

    Attributes:
        passed: whether it passed.
        lines: the text.
        as_json: the JSON values.
        losses: a sentence for each file that could not be written.
    """

    passed: bool
    lines: list[str]
    as_json: Mapping[str, Any]
    losses: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class Reports:
    """The requested coverage reports.

    Attributes:
        table: print it.
        fail_under: the least percentage of all items, or None.
        requirements: print the matrix of requirements, and fail unless all of them are covered.
        html: folder for an HTML report.
        lcov: file for an LCOV tracefile.
        cobertura: file for Cobertura XML.
    """

    table: bool = False
    fail_under: float | None = None
    requirements: bool = False
    html: Path | None = None
    lcov: Path | None = None
    cobertura: Path | None = None


@dataclass(frozen=True, slots=True)
class Demand:
    """The requirements on the properties.

    Attributes:
        assumptions: the assumptions of proofs.
        required: the required verdict; None for anything that is not violated.
        depth: check only runs of that many steps.
    """

    assumptions: Assumptions = field(default_factory=Assumptions)
    required: Status | None = None
    depth: int | None = None


def run_trial(trial: TestedMachine, demand: Demand, reports: Reports) -> TrialReport:
    """Run all scenarios and decide all properties of a machine.

    Raises:
        UsageError: coverage is demanded, and there is no scenario; or requirements are, and there is none.
    """
    model = trial.machine.model
    if reports.fail_under is not None and not any(suite.scenarios for suite in trial.suites):
        raise UsageError("--fail-under needs scenarios, and there are none beside the machine")
    if reports.requirements and not any(map(_names_requirements, trial.suites)):
        raise UsageError(
            "--requirements needs requirements, and no .maze-test file names one",
            "add a line `requirement R1 what is required`, and `covers R1` below the title of a scenario",
        )
    measurements = Measurements()
    lines: list[str] = []
    results: list[ScenarioResult] = []
    for suite in trial.suites:
        lines.append(suite.file)
        for result in run_suite(suite, trial.machine, lambda: watches(model.properties, model.assumptions)):
            results.append(result)
            measurements.add(model, result.coverage)
            lines.append(f"  {'passed' if result.passed else 'FAILED'}  {result.scenario.name}")
            if result.failure is not None:
                lines += [f"    {line}" for line in result.failure.lines()]
    examined = examine(trial.machine, demand.assumptions, depth=demand.depth)
    verdicts = examined.verdicts
    writer = Writer(model)
    assumed = demand.assumptions.lines(model)
    lines.append(f"{model.name}: properties, assuming")
    lines += [f"    {line}" for line in assumed]
    for verdict in verdicts:
        lines.append(f"  {verdict}")
        if verdict.counterexample is not None:
            lines += [f"      {line}" for line in writer.scenario(verdict.counterexample)]
    if examined.passing:
        lines.append(f"  no step ends in {', '.join(examined.passing)}")
    failed = sum(not one.passed for one in results)
    enough_known = all(one.meets(demand.required) for one in verdicts)
    unmet = [one.name for one in verdicts if not one.meets(demand.required) and not one.violated]
    beyond = frozenset[tuple[object, ...]]() if examined.possible is None else unreachable(model, examined.possible)
    measured = [replace(one, unreachable=beyond) for one in measurements.machines.values()]
    share = total_share(measured)
    enough = reports.fail_under is None or share >= reports.fail_under
    losses: list[str] = []
    lines += _written(measured, reports, losses)
    required = matrix(model, trial.suites, results, verdicts) if reports.requirements else None
    if required is not None:
        lines += [*required.lines(), *_requirements_page(required, reports.html, losses)]
    left_out = [f"{one.text}: {UNREACHABLE}" for each in measured for one in each.left_out]
    lines += left_out
    if unmet and demand.required is not None:
        lines.append(f"required: {_REQUIREMENTS[demand.required]}; not met by {', '.join(unmet)}")
    lines.append(
        f"{_count(len(results), 'scenario')}, {failed} failed; {_properties_text(verdicts)}; "
        f"{_covered_text(share, reports.fail_under) if results else 'nothing covered'}"
    )
    as_json: dict[str, Any] = {
        "machine": model.name,
        "scenarios": [_result_json(one) for one in results],
        "assumptions": assumed,
        "properties": [_verdict_json(one, writer) for one in verdicts],
        "coverage": round(share, 2) if results else 0.0,
        "unreachable": left_out,
        "passing": list(examined.passing),
        "missed": [line for one in measured for line in missed_lines(one)],
    }
    if required is not None:
        as_json["requirements"] = required.as_json()
    passed = not failed and enough_known and enough and (required is None or required.passed)
    return TrialReport(passed, lines, as_json, losses)


def _names_requirements(suite: Suite) -> bool:
    return bool(suite.requirements or suite.covered or any(one.covers for one in suite.scenarios))


def _requirements_page(required: Matrix, folder: Path | None, losses: list[str]) -> list[str]:
    """Write the matrix of requirements into the folder of the reports."""
    if folder is None:
        return []
    with _noting(losses):
        folder.mkdir(parents=True, exist_ok=True)
        write_text(folder / PAGE, html_page(required))
        return [f"requirements: {folder / PAGE}"]
    return []


def generated(machine: Machine, steps: int | None, output: Path | None) -> TrialReport:
    """Generate scenarios from a machine."""
    model = machine.model
    found = generate(machine, steps=steps or MOST_GENERATED)
    unreached = [f"{f'line {one.line}: ' if one.line else ''}{one.text}: {one.reason}" for one in found.unreached]
    all_proved = all(one.proved for one in found.unreached)
    comment = [f"Generated from machine {model.name}: {len(found.scenarios)} scenarios.", *unreached]
    text = Writer(model).suite(found.scenarios, comment)
    as_json = {
        "machine": model.name,
        "scenarios": len(found.scenarios),
        "unreached": unreached,
        "states": found.moments,
        "steps": found.steps,
        "text": text,
    }
    if output is None:
        return TrialReport(all_proved, [text.rstrip("\n")], as_json)
    losses: list[str] = []
    with _noting(losses):
        write_text(output, text)
    report = f"{output}: {len(found.scenarios)} scenarios from {found.moments} states; {len(unreached)} not reached"
    return TrialReport(all_proved, [*unreached, report], as_json, losses)


def mutated(trial: TestedMachine) -> TrialReport:
    """Run all scenarios on the mutants of a machine.

    Raises:
        UsageError: there is no scenario, or one fails on the machine itself.
    """
    own = [(suite, result) for suite in trial.suites for result in run_suite(suite, trial.machine)]
    if not own:
        raise UsageError("--mutate needs scenarios, and there are none beside the machine")
    red = [f"{suite.file}: {result.scenario.name}" for suite, result in own if not result.passed]
    if red:
        raise UsageError(f"--mutate needs scenarios that pass; these fail on the machine itself: {', '.join(red)}")
    model = trial.machine.model
    found = survey(model, trial.suites)
    survivors = [
        f"{_mutant_text(model, one)}: survived: {_unnoticed(found.reached[number])}"
        for number, one in enumerate(found.survivors)
    ]
    equivalent = [f"{_mutant_text(model, one)}: equivalent" for one in found.equivalent]
    total = found.killed + len(survivors)
    line = f"{_count(total, 'mutant')}, {found.killed} killed: mutation score {found.score:.1f}%"
    if equivalent:
        line += f"; {len(equivalent)} proved equivalent, which do not count: {EQUIVALENT}"
    as_json = {
        "machine": model.name,
        "mutants": total,
        "killed": found.killed,
        "score": round(found.score, 2),
        "survivors": survivors,
        "equivalent": equivalent,
    }
    return TrialReport(not survivors, [*equivalent, *survivors, line], as_json)


EQUIVALENT = (
    "in every run, for any parameters, the same states, transitions, activities, calls, events and variables, unless a "
    "signal or an action fails"
)
"""What is proved of an equivalent mutant."""


def _mutant_text(model: Model, mutant: Mutant) -> str:
    return f"{mutant.place or model.name}: {mutant.kind}: {mutant.text}"


def _unnoticed(reaching: int) -> str:
    """Why a mutant survives."""
    if not reaching:
        return "no scenario reaches it"
    return (
        "1 scenario reaches it and shows no difference"
        if reaching == 1
        else f"{reaching} scenarios reach it and show no difference"
    )


@contextmanager
def _noting(losses: list[str]) -> Iterator[None]:
    """Continue if a file cannot be written, and record which and why: the results are worth more."""
    try:
        yield
    except OSError as error:
        losses.append(f"{error.filename}: {error.strerror}")


def _written(measured: list[Measured], reports: Reports, losses: list[str]) -> list[str]:
    lines: list[str] = []
    if reports.table:
        lines += ["", *coverage_table(measured, Path.cwd()), ""]
    if reports.html is not None:
        with _noting(losses):
            lines.append(f"coverage report: {write_pages(reports.html, measured)}")
    for path, text in ((reports.lcov, lcov), (reports.cobertura, cobertura)):
        if path is not None:
            with _noting(losses):
                write_text(path, text(measured))
    return lines


def write_pages(folder: Path, measured: Sequence[Measured]) -> Path:
    """Write a coverage report into a folder, which is created if it does not exist.

    Returns:
        The index page.

    Raises:
        OSError: a page cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, page in html_pages(measured).items():
        write_text(folder / name, page)
    return folder / INDEX


def _result_json(result: ScenarioResult) -> dict[str, Any]:
    failure: Failure | None = result.failure
    found: dict[str, Any] = {"name": result.scenario.name, "passed": result.passed}
    if result.scenario.place is not None:
        found["place"] = str(result.scenario.place)
    if failure is not None:
        found["failure"] = {
            "message": failure.message,
            "place": str(failure.place) if failure.place else None,
            "time": failure.time,
            "states": list(failure.configuration),
            "variables": dict(failure.variables),
            "considered": list(failure.considered),
        }
    return found


def _verdict_json(verdict: PropertyVerdict, writer: Writer) -> dict[str, Any]:
    return {
        "name": verdict.name,
        "property": verdict.text,
        "verdict": _REQUIREMENTS.get(verdict.status, verdict.status.value),
        "method": None if verdict.method is None else verdict.method.value,
        "depth": None if verdict.proved else verdict.depth,
        "states": verdict.states,
        "reason": verdict.reason or None,
        "counterexample": None if verdict.counterexample is None else writer.scenario(verdict.counterexample),
    }


_REQUIREMENTS = {Status.PROVED: "proved", Status.BOUNDED: "bounded"}


def _properties_text(verdicts: Sequence[PropertyVerdict]) -> str:
    """The number of properties with each verdict, without zeros."""
    words = {
        Status.PROVED: "proved",
        Status.BOUNDED: "without a violation to a depth",
        Status.VIOLATED: "violated",
        Status.UNDECIDED: "not decided",
    }
    counts = [(sum(one.status is status for one in verdicts), word) for status, word in words.items()]
    return f"{_count(len(verdicts), 'property', 'properties')}: " + ", ".join(f"{n} {word}" for n, word in counts if n)


def _covered_text(share: float, fail_under: float | None) -> str:
    under = fail_under is not None and share < fail_under
    return f"{share:.1f}% covered{f', which is under {fail_under:g}%' if under else ''}"


def _count(number: int, one: str, many: str | None = None) -> str:
    return f"{number} {one if number == 1 else many or f'{one}s'}"
