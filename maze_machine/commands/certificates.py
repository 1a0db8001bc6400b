"""``maze-machine certificates``: an authority and certificates for a test network."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from maze_machine.errors import FileError, UsageError, missing_package


def certificates(
    folder: Annotated[Path, typer.Argument(help="The folder to write to; created if it does not exist.")],
    robot: Annotated[list[str], typer.Option(help="Name of a robot; may be repeated.")],
    controller: Annotated[
        list[str] | None, typer.Option(help="Name of a controller that may drive all these robots; may be repeated.")
    ] = None,
    watcher: Annotated[
        list[str] | None, typer.Option(help="Name of a watcher, who may only watch; may be repeated.")
    ] = None,
    operator: Annotated[
        list[str] | None,
        typer.Option(help="Name of an operator, who may send events to the running machines; may be repeated."),
    ] = None,
    host: Annotated[
        list[str] | None, typer.Option(help="Host name or address of a robot or router; may be repeated.")
    ] = None,
) -> None:
    """Make a certificate authority and a certificate for every participant of a test network.

    `access.toml` beside them says who may drive which robot; edit it freely. The authority's key is discarded.

    Example: `maze-machine certificates ca --robot pico1 --controller alice --host 192.168.1.7`
    """
    from transport.security import Access, SecurityError, make_certificates

    try:
        access = Access(
            robots=robot,
            controllers=dict.fromkeys(controller or (), robot),
            watchers=dict.fromkeys(watcher or (), robot),
            operators=dict.fromkeys(operator or (), robot),
        )
        written = make_certificates(folder, access, host or ())
    except SecurityError as error:
        raise FileError(str(error)) from None
    except ValueError as error:
        raise UsageError(str(error)) from None
    except ImportError:
        raise missing_package("a certificate", "trustme", "certificates") from None
    print("\n".join(map(str, written)))
