"""The one entry point, ``maze-machine``: reads the command line, finds the subcommand in its table and runs it.

A command's module keeps heavy imports (numpy, zenoh, matplotlib, ...) inside its function, so that ``--help`` and
completion in a shell answer at once. Errors of a command are reported by ``maze_machine.errors``.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from io import TextIOWrapper
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from maze_machine import __version__
from maze_machine.command_table import GROUPS, PLACES, Subcommand
from maze_machine.errors import reported
from maze_machine.unconverted import spare_conversions


class Subcommands(Mapping[str, Any]):
    """The subcommands by name, as click commands; each is imported on first use.

    (The type of a command is private to typer, therefore Any.)
    """

    def __getitem__(self, name: str) -> Any:
        """The subcommand of a name."""
        return _loaded(PLACES[name])

    def __iter__(self) -> Iterator[str]:
        """The names, in the order of the help text."""
        return iter(PLACES)

    def __len__(self) -> int:
        """How many there are."""
        return len(PLACES)


class OneCommand(TyperCommand):
    """A subcommand; pydantic is imported for values that need it."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Its arguments and options, `--help` among them."""
        return _spared(super().get_params(ctx))


def _spared(parameters: list[Any]) -> list[Any]:
    spare_conversions(parameters)
    return parameters


@cache
def _loaded(one: Subcommand) -> Any:
    found = getattr(import_module(one.module), one.attribute)
    if isinstance(found, typer.Typer):
        app = found
    else:
        app = typer.Typer(rich_markup_mode="markdown", add_completion=False)
        app.command(one.name, cls=OneCommand)(found)
    return typer.main.get_command(app)


class Commands(TyperGroup):
    """The subcommands; an error that a user can act on ends any of them with one message and an exit status."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        subcommands: Any = Subcommands()
        self.commands = subcommands

    def get_params(self, ctx: Any) -> list[Any]:
        """The options of all subcommands."""
        return _spared(super().get_params(ctx))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The subcommand that a command line names, and the rest of the line."""
        words = " ".join(args[:2])
        return super().resolve_command(ctx, [words, *args[2:]] if words in PLACES else args)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help text without rich, whose import takes longer than everything else."""
        self.format_usage(ctx, formatter)
        self.format_help_text(ctx, formatter)
        self.format_options(ctx, formatter)
        self.format_epilog(ctx, formatter)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """List the subcommands by group, each with its summary, from the table alone."""
        for group in GROUPS:
            with formatter.section(group):
                formatter.write_dl([(one.name, one.summary) for one in PLACES.values() if one.group == group])

    def invoke(self, ctx: Any) -> Any:
        """Run the subcommand that was asked for."""
        with reported():
            return super().invoke(ctx)


def _print_version(asked: bool) -> None:
    if asked:
        from transport.compiled import arithmetic_in_use

        print(f"maze-machine {__version__} ({arithmetic_in_use()})")
        raise typer.Exit


app = typer.Typer(
    name="maze-machine",
    cls=Commands,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog=(
        "Exit status: 0 success, 1 the run or check failed, 2 wrong usage, 3 a file cannot be used, "
        "4 no robot can be reached, 130 interrupted."
    ),
)


@app.callback()
def maze_machine(
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", is_eager=True, callback=_print_version)
    ] = False,
) -> None:
    """Write a robot's supervisor as a small text file and trust it."""


def main() -> None:
    """Run the command line.

    A name of a file may have bytes that no encoding knows, and a terminal may lack a character of a table: both are
    printed as escapes.
    """
    if isinstance(sys.stdout, TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")
    app()
