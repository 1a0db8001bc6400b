"""Where somebody listens or is dialled, as it is written."""

from __future__ import annotations

import re

from transport.robot import LinkError

_NETWORK = re.compile(r"(tcp|tls|udp|ws|quic)/(?P<host>\[[0-9A-Fa-f:.%\w]+\]|[\w.-]+):(?P<port>\d+)")
_FILE = re.compile(r"unixsock-stream/.+")


class EndpointError(LinkError):
    """What was given as an endpoint is none."""


def check_endpoint(endpoint: str) -> str:
    """The endpoint itself, if it is one.

    Raises:
        EndpointError: it is not written as one.
    """
    if _FILE.fullmatch(endpoint):
        return endpoint
    found = _NETWORK.fullmatch(endpoint)
    if found is None:
        raise EndpointError(f"`{endpoint}` is not an endpoint: it reads tcp/HOST:PORT, such as tcp/127.0.0.1:7447")
    if not 0 < int(found["port"]) < 2**16:
        raise EndpointError(f"`{endpoint}` is not an endpoint: ports go from 1 to 65535")
    return endpoint
