"""Endpoints as text."""

from __future__ import annotations

import re

from transport.robot import LinkError
from transport.wording import shortened

_NETWORK = re.compile(r"(tcp|tls|udp|ws|quic)/(?P<host>\[[0-9A-Fa-f:.%\w]+\]|[\w.-]+):(?P<port>[0-9]+)")
_DIGITS = 5
"""The digits of the largest port; Python converts no number of thousands of digits."""
_FILE = re.compile(r"unixsock-stream/.+")


class EndpointError(LinkError):
    """A malformed endpoint."""


def check_endpoint(endpoint: str) -> str:
    """The endpoint itself, if it is well-formed.

    Raises:
        EndpointError: it is malformed.
    """
    if _FILE.fullmatch(endpoint):
        return endpoint
    found = _NETWORK.fullmatch(endpoint)
    if found is None:
        raise _malformed(endpoint, "write tcp/HOST:PORT, such as tcp/127.0.0.1:7447")
    if len(found["port"]) > _DIGITS or not 0 < int(found["port"]) < 2**16:
        raise _malformed(endpoint, "ports go from 1 to 65535")
    return endpoint


def _malformed(endpoint: str, reason: str) -> EndpointError:
    return EndpointError(f"`{shortened(endpoint)}` is not an endpoint: {reason}")
