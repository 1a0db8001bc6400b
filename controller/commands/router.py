"""``maze-machine router``: the meeting point of several robots and controllers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def router(
    listen: Annotated[
        str, typer.Option(metavar="ENDPOINT", help="Where robots and controllers dial it.")
    ] = "tcp/127.0.0.1:7447",
    identity: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER/NAME", help="Speak TLS with this certificate; the endpoint is then tls/HOST:PORT."
        ),
    ] = None,
) -> None:
    """Pass messages on between robots and controllers that all dial this place.

    It ends with Ctrl-C. With a certificate, `access.toml` in its folder says who may do what.

    Example: `maze-machine router --listen tcp/127.0.0.1:7447`
    """
    from threading import Event

    from controller.network import secured
    from transport.connect import routing
    from transport.settings import LinkSettings

    with routing(listen, security=secured(listen, identity, LinkSettings(), listens=True)):
        print(f"router listens at {listen}", flush=True)
        while True:
            Event().wait(3600)
