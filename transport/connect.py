"""The ways to reach a robot and to show one, ready made."""

from __future__ import annotations

import os
import secrets
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from transport.bus import Bus
from transport.lockstep import RemoteLockstep
from transport.robot import LinkError
from transport.session import Open, open_session
from transport.zenoh_bus import ZenohBus, settings

CONNECT_LIMIT = 5.0
"""How long a robot is looked for, s."""
ANSWER_LIMIT = 10.0
"""How long one step of a simulator is waited for, s: its first may compile."""


def controller_name() -> str:
    """Who this process is, for people: host and process number."""
    return f"{socket.gethostname()}, process {os.getpid()}"


@contextmanager
def listening(endpoint: str, *, security: Mapping[str, object] | None = None) -> Iterator[ZenohBus]:
    """A bus that others dial, for as long as the block runs.

    Args:
        endpoint: where to listen, such as ``tcp/127.0.0.1:7447``.
        security: settings for TLS and access control, as :mod:`transport.certificates` makes them.

    Raises:
        LinkError: the endpoint is malformed or taken.
    """
    bus = ZenohBus(settings("peer", listen=endpoint, security=security))
    try:
        yield bus
    finally:
        bus.close()


def connect_lockstep(
    endpoint: str,
    robot: str = "pico",
    *,
    seed: int | None = None,
    limit: float = CONNECT_LIMIT,
    patience: float = ANSWER_LIMIT,
    security: Mapping[str, object] | None = None,
) -> RemoteLockstep:
    """Begin an episode of the simulator at an endpoint.

    Args:
        endpoint: where the simulator listens, such as ``tcp/127.0.0.1:7447``.
        robot: the robot's name.
        seed: the run to simulate; None leaves it to the simulator.
        limit: how long to look for it, s.
        patience: how long to wait for one step, s.
        security: settings for TLS, as :mod:`transport.certificates` makes them.

    Raises:
        LinkError: nobody answers there within the limit, or another controller drives the robot.
    """
    bus = ZenohBus(settings("client", connect=endpoint, security=security, wait=limit))
    try:
        return open_lockstep(bus, robot, seed=seed, limit=limit, patience=patience)
    except LinkError as error:
        bus.close()
        raise LinkError(f"{endpoint}: {error}") from None
    except BaseException:
        bus.close()
        raise


def open_lockstep(
    bus: Bus, robot: str, *, seed: int | None = None, limit: float = CONNECT_LIMIT, patience: float = ANSWER_LIMIT
) -> RemoteLockstep:
    """Begin an episode over a bus.

    Raises:
        LinkError: nobody answers within the limit, or another controller drives the robot.
    """
    question = Open(request=secrets.token_hex(8), controller=controller_name(), mode="lockstep", seed=seed)
    return RemoteLockstep(bus, open_session(bus, robot, question, limit), limit=patience)
