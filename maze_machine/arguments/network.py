"""How a command joins a network: by listening or by dialling, with or without a certificate."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from maze_machine.errors import FileError, UsageError
from transport.bus import Bus
from transport.connect import dialling, listening
from transport.endpoints import check_endpoint
from transport.security import Identity, SecurityError
from transport.settings import LinkSettings


@contextmanager
def joined(listen: str, connect: str | None, identity: Path | None, settings: LinkSettings) -> Iterator[Bus]:
    """A bus for as long as the block runs: dialled where there is something to dial, else listened at.

    Raises:
        EndpointError: the endpoint is malformed.
        LinkError: it is taken, or nobody answers there.
        FileError: the certificate or the access file cannot be used.
        UsageError: the endpoint and the certificate do not match.
    """
    endpoint = listen if connect is None else connect
    security = secured(endpoint, identity, settings, listens=connect is None)
    if connect is not None:
        with dialling(endpoint, wait=settings.connect, security=security) as bus:
            yield bus
    else:
        with listening(endpoint, security=security) as bus:
            yield bus


def secured(
    endpoint: str, identity: Path | None, settings: LinkSettings, *, listens: bool = False
) -> dict[str, object] | None:
    """Session settings for a certificate, or None where there is none.

    Raises:
        FileError: the certificate or the access file cannot be used.
        EndpointError: the endpoint is malformed.
        UsageError: the endpoint and the certificate do not match.
    """
    check_endpoint(endpoint)
    if identity is None:
        if endpoint.startswith("tls/"):
            raise UsageError(f"{endpoint} needs a certificate", "give --identity FOLDER/NAME")
        return None
    if not endpoint.startswith("tls/"):
        raise UsageError(f"a certificate is useless at {endpoint}", "the endpoint must be tls/HOST:PORT")
    try:
        known = Identity.at(identity)
        return known.listening(settings) if listens else known.dialling()
    except SecurityError as error:
        raise FileError(str(error)) from None
