"""``maze-machine test``: scenarios, properties, coverage, generated tests and mutants, without a robot."""

from __future__ import annotations

from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from maze_machine.arguments.completion import complete_machine
from maze_machine.arguments.options import JsonOption, LibraryOption
from maze_machine.errors import ExitStatus, FileError, UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from hsm.model.registry import Parameter


class RequiredVerdict(StrEnum):
    """What ``--require`` may demand."""

    PROVED = "proved"
    BOUNDED = "bounded"


def test(
    file: Annotated[
        str,
        typer.Argument(
            help="A .maze-test file, or a machine (a file or a shipped name) with all scenarios beside it.",
            autocompletion=complete_machine,
        ),
    ],
    generate: Annotated[
        bool, typer.Option("--generate", help="Generate scenarios from the machine and print them.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option(metavar="FILE", help="The .maze-test file that --generate writes instead.")
    ] = None,
    mutate: Annotated[
        bool,
        typer.Option("--mutate", help="Make mutants, small changes of the machine; list those that no scenario kills."),
    ] = False,
    steps: Annotated[
        int | None,
        typer.Option(min=1, help="The largest number of steps that --generate tries."),
    ] = None,
    depth: Annotated[
        int | None,
        typer.Option(min=1, metavar="STEPS", help="Check only runs of this many steps. Default: all runs."),
    ] = None,
    require: Annotated[
        RequiredVerdict | None,
        typer.Option(
            help="The verdict that every property must reach: `proved`, or `bounded` (no violation to a depth)."
        ),
    ] = None,
    longest_tick: Annotated[
        float | None,
        typer.Option(
            min=1e-6,
            metavar="SECONDS",
            help="The longest time between two steps that proofs assume, if the machine states no shorter one."
            " Default: what it states, or 0.1.",
        ),
    ] = None,
    parameters: Annotated[
        list[str] | None,
        typer.Option(
            "--param", metavar="NAME=VALUE", help="A parameter for the proofs, with its unit; may be repeated."
        ),
    ] = None,
    free: Annotated[
        list[str] | None,
        typer.Option("--free", metavar="NAME", help="A parameter that may have any value in proofs; may be repeated."),
    ] = None,
    assume: Annotated[
        list[str] | None,
        typer.Option(
            "--assume", metavar="NAME:CLAIM", help="A further assumption, as the file would state it; may be repeated."
        ),
    ] = None,
    no_nan: Annotated[bool, typer.Option("--no-nan", help="Assume in proofs that no signal is NaN.")] = False,
    coverage: Annotated[bool, typer.Option("--coverage", help="Print the coverage of the scenarios.")] = False,
    fail_under: Annotated[
        float | None,
        typer.Option(
            min=0, max=100, metavar="PERCENT", help="Fail if the scenarios cover less than this share of all items."
        ),
    ] = None,
    requirements: Annotated[
        bool,
        typer.Option(
            "--requirements",
            help="Print which properties, scenarios and states cover each requirement; fail if one is not covered.",
        ),
    ] = False,
    html: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write reports as HTML pages: coverage, and requirements if asked for."),
    ] = None,
    lcov: Annotated[Path | None, typer.Option(metavar="FILE", help="Write coverage as an LCOV tracefile.")] = None,
    cobertura: Annotated[Path | None, typer.Option(metavar="FILE", help="Write coverage as Cobertura XML.")] = None,
    library: LibraryOption = None,
    json: JsonOption = False,
) -> None:
    """Run a machine's scenarios and decide its properties for all its runs.

    Each property has a verdict: proved; violated, with a run that shows it; no violation in runs of a number of steps;
    or undecided, with the reason.

    The exit status is 0 only if all scenarios pass, no property is violated, every property meets `--require`, and
    the coverage suffices. With `--requirements` every requirement must be covered, too; with `--mutate` every mutant
    must be killed or proved equivalent. With `--generate` the scenarios must reach everything in the machine that is
    not proved unreachable.

    Example: `maze-machine test pledge --require proved`

    Example: `maze-machine test door --assume "opens : after doing(ring), door.open within 5 s"`

    Example: `maze-machine test pledge --coverage`

    Example: `maze-machine test door --requirements --html report`

    Example: `maze-machine test pledge --generate --output pledge_generated.maze-test`

    Example: `maze-machine test my.maze-machine --mutate`

    Example: `maze-machine test vacuum.maze-machine --library my_robot:library`
    """
    from json import dumps

    from hsm.testing.proofs.verdicts import Assumptions, Status
    from hsm.testing.scenarios.reading import SUFFIX
    from hsm.testing.scenarios.tested_machine import load_machine, load_tested_machine
    from maze_machine.arguments.files import check_outputs, check_suffix
    from maze_machine.arguments.parameters import known_values, split_setting
    from maze_machine.catalogue.library import chosen_library
    from maze_machine.catalogue.machines import find_machine
    from maze_machine.report.testing import Demand, Reports, generated, mutated, run_trial
    from maze_machine.report.waiting import waiting

    if output is not None and not generate:
        raise UsageError("--output needs --generate")
    if generate or mutate:
        unused = {
            "--mutate": generate and mutate,
            "--require": require is not None,
            "--depth": depth is not None,
            "--longest-tick": longest_tick is not None,
            "--param": parameters,
            "--free": free,
            "--assume": assume,
            "--no-nan": no_nan,
            "--coverage": coverage,
            "--fail-under": fail_under is not None,
            "--requirements": requirements,
            "--html": html,
            "--lcov": lcov,
            "--cobertura": cobertura,
        }
        _refuse("--generate" if generate else "--mutate", [name for name, given in unused.items() if given])
    path = Path(file)
    meant = path if path.suffix == SUFFIX else find_machine(file)
    outputs = {"--output": output, "--lcov": lcov, "--cobertura": cobertura}
    check_outputs(outputs, [meant])
    check_suffix("--output", output, [SUFFIX])
    names = chosen_library(library, meant)
    if generate:
        with waiting("finding scenarios"):
            result = generated(load_machine(meant, names), steps, output)
    elif mutate:
        with waiting("trying changed machines"):
            result = mutated(load_tested_machine(meant, names))
    else:
        with waiting("running scenarios, checking properties"):
            with _assuming(assume or []) as further:
                trial = load_tested_machine(meant, names, further)
            declared = trial.machine.model.parameters
            given = known_values(trial.machine.model, map(split_setting, parameters or ()), names.enumerations)
            assumed = Assumptions(longest_tick, given, _known(free or [], declared), not_a_number=not no_nan)
            wanted = {None: None, RequiredVerdict.PROVED: Status.PROVED, RequiredVerdict.BOUNDED: Status.BOUNDED}[
                require
            ]
            reports = Reports(coverage, fail_under, requirements, html, lcov, cobertura)
            result = run_trial(trial, Demand(assumed, wanted, depth), reports)
    print(dumps(result.as_json, indent=2) if json else "\n".join(result.lines))
    if result.losses:
        raise FileError("; ".join(result.losses))
    raise typer.Exit(ExitStatus.OK if result.passed else ExitStatus.FAILED)


def _refuse(alone: str, others: Sequence[str]) -> None:
    """Refuse options that would have no effect beside another one.

    Raises:
        UsageError: there are some.
    """
    if others:
        raise UsageError(f"{alone} excludes {', '.join(others)}: give one of them, and the other in a second command")


@contextmanager
def _assuming(assumed: Sequence[str]) -> Iterator[Sequence[str]]:
    """Assumptions from the command line, for loading a machine.

    Raises:
        UsageError: one has several lines, or cannot be understood.
    """
    from hsm.dsl.loading import ASSUMED
    from hsm.model.diagnostics import MachineError

    for one in assumed:
        if len(one.splitlines()) != 1:
            raise UsageError(f"--assume {one!r}: an assumption has one line: NAME : CLAIM")
    try:
        yield assumed
    except MachineError as error:
        wrong = next((one for one in error.diagnostics if one.place and one.place.file == ASSUMED), None)
        if wrong is None or wrong.place is None:
            raise
        given = assumed[min(wrong.place.line, len(assumed)) - 1]
        raise UsageError(f"--assume {given!r}: {wrong.message}", wrong.suggestion or "") from None


def _known(names: Sequence[str], parameters: Sequence[Parameter]) -> frozenset[str]:
    """Names of parameters.

    Raises:
        UsageError: there is no such parameter.
    """
    declared = [one.name for one in parameters]
    for name in names:
        if name not in declared:
            raise UsageError(
                f"--free {name}: the machine has no such parameter; it has {', '.join(declared) or 'none'}"
            )
    return frozenset(names)
