"""``maze-machine simulate``: a machine without a robot, tried line by line."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from maze_machine.arguments.completion import complete_machine
from maze_machine.arguments.options import JsonOption, LibraryOption
from maze_machine.errors import ExitStatus, FileError

if TYPE_CHECKING:
    from hsm.testing.scenarios.session import Moment, Session

HELP = """\
lines of a scenario, which are kept:
  when door.near, not space.front     signals change
  when rotate reports done            an activity ends
  when event go                       somebody sends an event
  after 2 s                           time passes
  expect driving within 5 s           wait for it, or say that it is not so
  given door.near                     begin anew, with this from the start
and words of this program:
  tick [N]            let N ticks pass
  why [STATE]         why transitions fired or did not in the last step
  break [CONDITION]   stop a wait where this comes to hold; alone: do not
  back [N]            take the last N lines back
  lines               what was done so far
  save FILE [NAME]    add the session to a file of scenarios
  help, quit"""


def simulate(
    machine: Annotated[
        str,
        typer.Argument(help="A .maze-machine file, or the name of a shipped machine.", autocompletion=complete_machine),
    ],
    parameters: Annotated[
        list[str] | None,
        typer.Option("--param", metavar="NAME=VALUE", help="Set a parameter, with its unit; may be repeated."),
    ] = None,
    library: LibraryOption = None,
    json: JsonOption = False,
) -> None:
    """Try a machine without a robot: set signals, send events, let time pass, ask why, go back, save it as a scenario.

    What you type are lines of a scenario, in the words of a .maze-test file; `help` lists them. Lines may be piped in:
    a line that cannot be done then ends the program with status 1. With `--json` a JSON object answers each line.

    Example: `maze-machine simulate pledge`

    Example: `maze-machine simulate pledge < lines.txt`
    """
    import hsm
    from hsm.testing.scenarios.session import Session, SessionError
    from maze_machine.arguments.parameters import parameter_values, split_setting
    from maze_machine.catalogue.library import chosen_library
    from maze_machine.catalogue.machines import find_machine

    path = find_machine(machine)
    names = chosen_library(library, path)
    chart = hsm.load(path, names)
    values = parameter_values(chart.model.parameters, dict(map(split_setting, parameters or ())), names.enumerations)
    try:
        session = Session(chart, names, values)
    except SessionError as error:
        raise FileError(str(error)) from None
    _show(session.moment, json=json)
    for line in _typed(names):
        word, _, rest = line.strip().partition(" ")
        if not word or word.startswith("#"):
            continue
        if word == "quit":
            break
        try:
            _answer(session, word, rest.strip(), line, json=json)
        except SessionError as error:
            print(f"maze-machine: {error}", file=sys.stderr)
            if not sys.stdin.isatty():
                raise typer.Exit(ExitStatus.FAILED) from None


def _answer(session: Session, word: str, rest: str, line: str, *, json: bool) -> None:
    """Do what a line says.

    Raises:
        SessionError: it cannot be done.
        FileError: a file cannot be written.
    """
    match word:
        case "help":
            print(HELP)
        case "lines":
            print("\n".join(session.lines) or "nothing yet")
        case "why":
            print("\n".join(session.why(rest or None)))
        case "break":
            session.stop_when(rest or None)
        case "save":
            _save(session, rest)
        case "back":
            _show(session.back(_count(rest)), json=json)
        case "tick":
            for _ in range(_count(rest)):
                moment = session.tick()
            _show(moment, json=json)
        case _:
            _show(session.do(line), json=json)


def _count(text: str) -> int:
    from hsm.testing.scenarios.session import SessionError

    if not text:
        return 1
    if not text.isdecimal() or not 1 <= int(text) <= 100_000:
        raise SessionError(f"`{text}` is no count")
    return int(text)


def _save(session: Session, rest: str) -> None:
    """Add the session to a file of scenarios, which is begun if it is not there.

    Raises:
        SessionError: no file is named.
        FileError: it cannot be written.
    """
    from hsm.testing.scenarios.session import SessionError
    from transport.files import write_text

    name, _, title = rest.partition(" ")
    if not name:
        raise SessionError("save FILE [NAME]")
    path = Path(name)
    try:
        before = path.read_text(encoding="utf-8") if path.exists() else f"test {session.machine}\n"
        write_text(path, f"{before.rstrip()}\n\n{session.scenario(title.strip() or 'what was tried')}")
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(f"{path} cannot be written: {getattr(error, 'strerror', None) or error}") from None
    print(f"saved to {path}")


def _typed(names: Any) -> Iterator[str]:
    """The lines that somebody types, or that are piped in."""
    if not sys.stdin.isatty():
        yield from sys.stdin
        return
    import readline

    words = sorted(
        {
            *("given", "when", "after", "expect", "tick", "why", "break", "back", "lines", "save", "help", "quit"),
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


def _show(moment: Moment, *, json: bool) -> None:
    """Where the run stands."""
    from dataclasses import asdict
    from json import dumps

    if json:
        print(dumps(asdict(moment)), flush=True)
        return
    print(f"{moment.time:8.3f} s  {', '.join(moment.states) or 'no state'}")
    for head, parts in (
        ("took", moment.taken),
        ("called", moment.called),
        ("raised", moment.raised),
        ("doing", moment.doing),
        ("with", [f"{name} = {value}" for name, value in moment.variables.items()]),
    ):
        if parts:
            print(f"            {head} {', '.join(parts)}")
    if moment.outcome is not None:
        print(f"            ended in {moment.outcome}")
