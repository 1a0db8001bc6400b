"""``maze-machine simulate``: a machine without a robot, tried line by line."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from maze_machine.arguments.completion import complete_machine
from maze_machine.arguments.options import HostOption, JsonOption, LibraryOption, PortOption
from maze_machine.errors import ExitStatus, FileError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hsm import Machine
    from hsm.model.registry import Library
    from hsm.testing.scenarios.session import Moment


def simulate(
    machine: Annotated[
        str,
        typer.Argument(
            help="A .maze-machine file, or the name of a machine: of the project, or a shipped one.",
            autocompletion=complete_machine,
        ),
    ],
    parameters: Annotated[
        list[str] | None,
        typer.Option("--param", metavar="NAME=VALUE", help="Set a parameter, with its unit; may be repeated."),
    ] = None,
    library: LibraryOption = None,
    view: Annotated[
        bool, typer.Option("--view", help="Try it on a page: the same lines, with a control for each thing to do.")
    ] = False,
    host: HostOption = "127.0.0.1",
    port: PortOption = 0,
    json: JsonOption = False,
) -> None:
    """Try a machine without a robot: set signals, send events, let time pass, ask why, go back, save it as a scenario.

    You type the lines of a scenario, as in a .maze-test file; `help` lists them. Lines can be piped in: then the first
    line that cannot be executed ends the program with status 1. With `--json` each answer is a JSON object.

    Example: `maze-machine simulate pledge`

    Example: `maze-machine simulate pledge < lines.txt`

    Example: `maze-machine simulate pledge --view`
    """
    import hsm
    from hsm.testing.scenarios.session import Session, SessionError
    from maze_machine.arguments.parameters import parameter_values, split_setting
    from maze_machine.catalogue.library import chosen_library
    from maze_machine.catalogue.machines import find_machine
    from maze_machine.simulated.console import Console

    path = find_machine(machine)
    names = chosen_library(library, path)
    chart = hsm.load(path, names)
    values = parameter_values(chart.model, dict(map(split_setting, parameters or ())), names.enumerations)
    try:
        if view:
            _on_page(chart, names, values, host, port)
            return
        session = Session(chart, names, values)
    except SessionError as error:
        raise FileError(str(error)) from None
    console = Console(session)
    _show(session.moment, json=json)
    for line in _typed(names):
        word = line.strip().partition(" ")[0]
        if not word or word.startswith("#"):
            continue
        if word == "quit":
            break
        try:
            _show(console.do(line), json=json)
        except SessionError as error:
            print(f"maze-machine: {error}", file=sys.stderr)
            if not sys.stdin.isatty():
                raise typer.Exit(ExitStatus.FAILED) from None


def _on_page(
    machine: Machine[Any, Any], library: Library[Any, Any], parameters: Mapping[str, Any], host: str, port: int
) -> None:
    """Try a machine on a page until nobody shows it any more."""
    from maze_machine.commands.opened_run import announce, linger, served
    from maze_machine.report.tried import TriedMachine, tried_head
    from maze_machine.view.drawings import Drawings
    from maze_machine.view.live import Feed

    drawings, feed = Drawings(machine), Feed()
    tried = TriedMachine(machine, library, parameters, feed.publish)
    head = tried_head(machine, parameters)
    with served(host, port, head, operate=tried.answer, drawn=drawings.drawn, feed=feed) as page:
        announce(page)
        page.seen.wait()
        linger(page)


def _typed(names: Any) -> Iterator[str]:
    """The lines that somebody types, or that are piped in."""
    if not sys.stdin.isatty():
        # What is not UTF-8 is a command that nobody knows.
        yield from (line.decode(errors="replace") for line in sys.stdin.buffer)
        return
    import readline

    words = sorted(
        {
            *(
                "given",
                "when",
                "after",
                "expect",
                "tick",
                "micro",
                "why",
                "enabled",
                "break",
                "back",
                "lines",
                "save",
                "set",
                "help",
                "quit",
            ),
            *("reports", "event", "not", "doing", "within"),
            *names.signals,
            *names.activities,
            *names.events,
        }
    )
    readline.set_completer_delims(" ,()=")
    readline.set_completer(lambda begun, number: [*(one for one in words if one.startswith(begun)), None][number])
    readline.parse_and_bind("tab: complete")
    while True:
        try:
            yield input("> ")
        except EOFError:
            print()
            return


def _show(answer: Moment | str, *, json: bool) -> None:
    """The state of the run, or what was asked."""
    from dataclasses import asdict
    from json import dumps

    from maze_machine.simulated.console import moment_text

    if isinstance(answer, str):
        if answer:
            print(answer)
    else:
        print(dumps(asdict(answer)) if json else moment_text(answer), flush=True)
