"""The ways to reach a robot and to show one, ready made."""

from __future__ import annotations

import os
import secrets
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from transport.bus import Bus
from transport.clock import Clock
from transport.description import RobotDescription
from transport.driver import RosDriver
from transport.keys import RobotKeys
from transport.leased import LeasedDriver
from transport.lockstep import RemoteLockstep
from transport.realtime import RealtimeRobot
from transport.robot import LinkError
from transport.session import Open, open_session
from transport.settings import LinkSettings
from transport.zenoh_bus import ZenohBus, session_settings

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
    bus = ZenohBus(session_settings("peer", listen=endpoint, security=security))
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
    bus = ZenohBus(session_settings("client", connect=endpoint, security=security, wait=limit))
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


def connect_realtime(
    endpoint: str,
    description: RobotDescription,
    settings: LinkSettings,
    *,
    seed: int | None = None,
    security: Mapping[str, object] | None = None,
) -> RealtimeRobot:
    """Take a robot in real time: a simulator, one behind a gate, or a bare ROS 2 driver behind a Zenoh bridge.

    Args:
        endpoint: where the robot's side or a router listens, such as ``tcp/192.168.1.7:7447``.
        description: the robot.
        settings: how it is reached, and how patient to be.
        seed: the run, for a simulator.
        security: settings for TLS, as :mod:`transport.certificates` makes them.

    Raises:
        LinkError: nobody answers there within the limit, another controller drives the robot, or its scan and odometry
            are not there, not fresh or not sane.
    """
    bus = ZenohBus(session_settings("client", connect=endpoint, security=security, wait=settings.connect))
    try:
        return open_realtime(bus, description, settings, seed=seed)
    except LinkError as error:
        raise LinkError(f"{endpoint}: {error}") from None


def open_realtime(
    bus: Bus,
    description: RobotDescription,
    settings: LinkSettings,
    *,
    seed: int | None = None,
    clock: Clock | None = None,
) -> RealtimeRobot:
    """Take a robot in real time over a bus, which is closed with it.

    Raises:
        LinkError: as :func:`connect_realtime`.
    """
    keys = RobotKeys(description.name, settings)
    try:
        driver = _leased(bus, keys, settings, seed) if settings.gate else RosDriver(bus, keys)
    except BaseException:
        bus.close()
        raise
    robot = RealtimeRobot(driver, description, settings, clock)
    try:
        robot.ready()
    except BaseException:
        robot.close()
        raise
    return robot


def _leased(bus: Bus, keys: RobotKeys, settings: LinkSettings, seed: int | None) -> LeasedDriver:
    question = Open(request=secrets.token_hex(8), controller=controller_name(), mode="realtime", seed=seed)
    return LeasedDriver(bus, keys, question, open_session(bus, keys.namespace, question, settings.connect))
