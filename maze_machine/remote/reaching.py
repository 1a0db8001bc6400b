"""Connect to a machine in another process."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from maze_machine.arguments.network import secured
from maze_machine.catalogue.profile import chosen_profile
from maze_machine.remote.client import RemoteMachine
from transport.connect import dialling


@contextmanager
def reaching(endpoint: str, robot: str | None, identity: Path | None) -> Iterator[RemoteMachine]:
    """The machine that listens at an endpoint, for as long as the block runs.

    Args:
        endpoint: where it listens.
        robot: the profile of the robot that it drives; None for that of the project, or PICO's.
        identity: a certificate, or None.

    Raises:
        LinkError: no program can be reached there.
        FileError: the profile or the certificate cannot be used.
        EndpointError: the endpoint is malformed.
        UsageError: the endpoint and the certificate do not match.
    """
    profile = chosen_profile(robot)
    security = secured(endpoint, identity, profile.link)
    with dialling(endpoint, wait=profile.link.connect, security=security) as bus:
        yield RemoteMachine(bus, profile.robot.name)
