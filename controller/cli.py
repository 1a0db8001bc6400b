"""The one entry point, ``maze-machine``: it collects the subcommands, each from a module of its own."""

from __future__ import annotations

import typer

app = typer.Typer(
    name="maze-machine", no_args_is_help=True, help="Write a robot's supervisor as a text file and trust it."
)


def main() -> None:
    """Run the command line."""
    app()
