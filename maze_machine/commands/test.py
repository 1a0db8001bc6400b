"""``maze-machine test``: scenarios, properties, coverage, generated tests and mutants, without a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from maze_machine.arguments.completion import complete_machine
from maze_machine.arguments.options import JsonOption, LibraryOption
from maze_machine.errors import ExitStatus, FileError, UsageError


def test(
    file: Annotated[
        str,
        typer.Argument(
            help="A .maze-test file, or a machine (a file or a shipped name) with all scenarios beside it.",
            autocompletion=complete_machine,
        ),
    ],
    generate: Annotated[
        bool, typer.Option("--generate", help="Find scenarios from the machine alone and print them.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Where --generate writes the scenarios instead.")
    ] = None,
    mutate: Annotated[
        bool, typer.Option("--mutate", help="Change the machine in small ways; tell which changes no scenario notices.")
    ] = False,
    steps: Annotated[
        int | None,
        typer.Option(min=1, help="How many steps to try at most for a property, or for --generate."),
    ] = None,
    coverage: Annotated[bool, typer.Option("--coverage", help="Print what the scenarios cover.")] = False,
    fail_under: Annotated[
        float | None, typer.Option(metavar="PERCENT", help="Fail where they cover less of all points.")
    ] = None,
    html: Annotated[Path | None, typer.Option(metavar="FOLDER", help="Write a coverage report to look at.")] = None,
    lcov: Annotated[Path | None, typer.Option(metavar="FILE", help="Write coverage as an LCOV tracefile.")] = None,
    cobertura: Annotated[Path | None, typer.Option(metavar="FILE", help="Write coverage as Cobertura XML.")] = None,
    library: LibraryOption = None,
    json: JsonOption = False,
) -> None:
    """Run a machine's scenarios and check its properties on every run up to a bound.

    The exit status is 0 only if all scenarios pass, no property is violated, and coverage is enough; with `--mutate`
    only if every change is noticed; with `--generate` if everything in the machine can be reached.

    Example: `maze-machine test pledge --coverage`

    Example: `maze-machine test pledge --generate --output pledge_generated.maze-test`

    Example: `maze-machine test my.maze-machine --mutate`

    Example: `maze-machine test vacuum.maze-machine --library my_robot:library`
    """
    from json import dumps

    from hsm.testing.scenarios.reading import SUFFIX
    from hsm.testing.scenarios.trial import load_machine, load_trial
    from maze_machine.arguments.files import check_outputs
    from maze_machine.catalogue.library import chosen_library
    from maze_machine.catalogue.machines import find_machine
    from maze_machine.report.trials import Reports, generated, mutated, run_trial
    from maze_machine.report.waiting import waiting

    if output is not None and not generate:
        raise UsageError("--output goes with --generate")
    path = Path(file)
    meant = path if path.suffix == SUFFIX else find_machine(file)
    outputs = {"--output": output, "--lcov": lcov, "--cobertura": cobertura}
    check_outputs(outputs, [meant])
    names = chosen_library(library, meant)
    if generate:
        with waiting("finding scenarios"):
            result = generated(load_machine(meant, names), steps, output)
    elif mutate:
        with waiting("trying changed machines"):
            result = mutated(load_trial(meant, names))
    else:
        with waiting("running scenarios, checking properties"):
            result = run_trial(load_trial(meant, names), steps, Reports(coverage, fail_under, html, lcov, cobertura))
    print(dumps(result.as_json, indent=2) if json else "\n".join(result.lines))
    if result.losses:
        raise FileError("; ".join(result.losses))
    raise typer.Exit(ExitStatus.OK if result.passed else ExitStatus.FAILED)
