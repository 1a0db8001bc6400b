"""``maze-machine router``: the meeting point of several robots and controllers."""

from __future__ import annotations

from maze_machine.arguments.options import LISTEN, IdentityOption, ListenOption


def router(
    listen: ListenOption = LISTEN,
    identity: IdentityOption = None,
) -> None:
    """Relay messages between robots and controllers that all connect to this endpoint.

    It ends with Ctrl-C. With a certificate, `access.toml` in its folder says who may do what.

    Example: `maze-machine router --listen tcp/127.0.0.1:7447`
    """
    from threading import Event

    from maze_machine.arguments.network import secured
    from transport.connect import routing
    from transport.settings import LinkSettings

    with routing(listen, security=secured(listen, identity, LinkSettings(), listens=True)):
        print(f"router listens at {listen}", flush=True)
        while True:
            Event().wait(3600)
