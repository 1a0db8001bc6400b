"""The one entry point, ``maze-machine``: the table of subcommands, each a function in a module of its own.

A command's module keeps heavy imports (numpy, zenoh, matplotlib, ...) inside its function, so that ``--help`` and
completion in a shell answer at once. Errors of a command are reported by ``maze_machine.errors``.
"""

from __future__ import annotations

from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from maze_machine.commands import (
    certificates,
    check,
    dap,
    diagram,
    exchange,
    fmt,
    gate,
    lsp,
    maze,
    new,
    profile,
    replay,
    router,
    run,
    sim,
    simulate,
    sweep,
    test,
    trust,
    view,
    watch,
)
from maze_machine.commands import list as list_
from maze_machine.errors import reported


class Commands(TyperGroup):
    """The subcommands; an error that a user can act on ends any of them with one message and an exit status."""

    def invoke(self, ctx: Any) -> Any:
        """Run the subcommand that was asked for."""
        with reported():
            return super().invoke(ctx)


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print(f"maze-machine {version('maze-machine')}")
        raise typer.Exit


app = typer.Typer(
    name="maze-machine",
    cls=Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=(
        "Exit status: 0 all right, 1 the run or check failed, 2 wrong usage, 3 a file that cannot be used, "
        "4 no robot within reach, 130 interrupted."
    ),
)


@app.callback()
def maze_machine(
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """Write a robot's supervisor as a small text file and trust it."""


# One line a command, in the order of the help text.
DRIVE, WRITE, WORLD, LINK = "Drive", "Write machines", "Mazes and simulation", "Link"
app.command("run", rich_help_panel=DRIVE)(run.run)
app.command("replay", rich_help_panel=DRIVE)(replay.replay)
app.command("view", rich_help_panel=DRIVE)(view.view)
app.command("watch", rich_help_panel=DRIVE)(watch.watch)
app.command("send", rich_help_panel=DRIVE)(watch.send)
app.command("sweep", rich_help_panel=DRIVE)(sweep.sweep)
app.command("profile", rich_help_panel=DRIVE)(profile.profile)
app.command("new", rich_help_panel=WRITE)(new.new)
app.command("check", rich_help_panel=WRITE)(check.check)
app.command("fmt", rich_help_panel=WRITE)(fmt.fmt)
app.command("test", rich_help_panel=WRITE)(test.test)
app.command("simulate", rich_help_panel=WRITE)(simulate.simulate)
app.command("diagram", rich_help_panel=WRITE)(diagram.diagram)
app.command("import", rich_help_panel=WRITE)(exchange.import_chart)
app.command("export", rich_help_panel=WRITE)(exchange.export)
app.command("list", rich_help_panel=WRITE)(list_.listing)
app.command("lsp", rich_help_panel=WRITE)(lsp.lsp)
app.command("dap", rich_help_panel=WRITE)(dap.dap)
app.command("trust", rich_help_panel=WRITE)(trust.trust)
app.add_typer(maze.app, name="maze", rich_help_panel=WORLD)
app.command("sim", rich_help_panel=LINK)(sim.sim)
app.command("gate", rich_help_panel=LINK)(gate.gate)
app.command("router", rich_help_panel=LINK)(router.router)
app.command("certificates", rich_help_panel=LINK)(certificates.certificates)


def main() -> None:
    """Run the command line."""
    app()
