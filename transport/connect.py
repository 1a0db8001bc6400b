"""Ready-made connections to a robot and for serving one."""

from __future__ import annotations

import os
import secrets
import socket
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager

from transport.bus import Bus
from transport.clock import Clock, MonotonicClock
from transport.description import RobotDescription
from transport.driver import RosDriver
from transport.hearing import heard_instead
from transport.keys import RobotKeys
from transport.leased import LeasedDriver
from transport.lockstep import RemoteLockstep
from transport.realtime import RealtimeRobot
from transport.robot import LinkError, NoAnswerError
from transport.session import Granted, Open, open_session
from transport.settings import LinkSettings
from transport.zenoh_bus import ZenohBus, session_settings

_SAME = 1e-6
DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"


def controller_name() -> str:
    """The name of this process for people: host and process number."""
    return f"{socket.gethostname()}, process {os.getpid()}"


@contextmanager
def listening(endpoint: str, *, security: Mapping[str, object] | None = None) -> Iterator[ZenohBus]:
    """A bus that other programs connect to, while the block runs.

    Args:
        endpoint: where to listen, such as ``tcp/127.0.0.1:7447``.
        security: settings for TLS and access control, as :mod:`transport.security` makes them.

    Raises:
        EndpointError: the endpoint is malformed.
        LinkError: it is taken.
    """
    with closing(ZenohBus(session_settings("peer", listen=endpoint, security=security))) as bus:
        yield bus


@contextmanager
def routing(endpoint: str, *, security: Mapping[str, object] | None = None) -> Iterator[None]:
    """A router, while the block runs: robots and controllers that connect to it reach each other.

    Args:
        endpoint: where to listen, such as ``tcp/127.0.0.1:7447``.
        security: settings for TLS and access control, as :mod:`transport.security` makes them.

    Raises:
        EndpointError: the endpoint is malformed.
        LinkError: it is taken.
    """
    with closing(ZenohBus(session_settings("router", listen=endpoint, security=security))):
        yield


@contextmanager
def dialling(
    endpoint: str, *, wait: float = LinkSettings().connect, security: Mapping[str, object] | None = None
) -> Iterator[ZenohBus]:
    """A bus that connects to a robot's side or a router, while the block runs.

    Args:
        endpoint: the endpoint to connect to, such as ``tcp/127.0.0.1:7447``.
        wait: timeout for connecting, s.
        security: settings for TLS, as :mod:`transport.security` makes them.

    Raises:
        EndpointError: the endpoint is malformed.
        LinkError: there is no answer within the time.
    """
    bus = ZenohBus(session_settings("client", connect=endpoint, security=security, wait=wait))
    try:
        yield bus
    finally:
        bus.close()


def connect_robot(
    endpoint: str,
    description: RobotDescription | None = None,
    settings: LinkSettings | None = None,
    *,
    seed: int | None = None,
    security: Mapping[str, object] | None = None,
) -> RemoteLockstep | RealtimeRobot:
    """Take the robot at an endpoint: simulated in lockstep or in real time, behind a gate, or a bare ROS 2 driver.

    The robot's side decides whether time waits for the controller. In real time the robot does not move before scan and
    odometry have arrived, fresh and matching the description.

    Args:
        endpoint: where the robot's side or a router listens, such as ``tcp/127.0.0.1:7447``.
        description: the robot; by default PICO.
        settings: the settings of the link.
        seed: the run to simulate; None leaves it to the simulator, and hardware ignores it.
        security: settings for TLS, as :mod:`transport.security` makes them.

    Raises:
        LinkError: nobody answers there within the time limit, another controller drives the robot, or its sensors are
            not to be trusted; the message says which.
    """
    description, settings = description or RobotDescription(), settings or LinkSettings()
    bus = ZenohBus(session_settings("client", connect=endpoint, security=security, wait=settings.connect))
    try:
        return open_robot(bus, description, settings, seed=seed)
    except LinkError as error:
        raise LinkError(f"{endpoint}: {error}") from None


def open_robot(
    bus: Bus,
    description: RobotDescription,
    settings: LinkSettings,
    *,
    seed: int | None = None,
    clock: Clock | None = None,
) -> RemoteLockstep | RealtimeRobot:
    """Take a robot over a bus, which is closed with the robot, or at once where that fails.

    Raises:
        LinkError: as :func:`connect_robot`.
    """
    clock = clock or MonotonicClock()
    keys = RobotKeys(description.name if settings.gate else description.topics_below, settings)
    driver: RosDriver | LeasedDriver
    try:
        if settings.gate:
            question = Open(request=secrets.token_hex(8), controller=controller_name(), seed=seed)
            granted = open_session(bus, keys.namespace, question, settings.connect, clock)
            _check_period(granted, description)
            if granted.mode == "lockstep":
                return RemoteLockstep(bus, granted, limit=settings.step)
            driver = LeasedDriver(bus, keys, question, granted, clock)
        else:
            driver = RosDriver(bus, keys)
        robot = RealtimeRobot(driver, description, settings, clock)
    except NoAnswerError as error:
        heard = heard_instead(bus, keys)
        bus.close()
        raise NoAnswerError(f"{error}: {heard}") from None
    except BaseException:
        bus.close()
        raise
    try:
        robot.ready()
    except BaseException:
        robot.close()
        raise
    return robot


def _check_period(granted: Granted, description: RobotDescription) -> None:
    """Refuse a robot with another command period than the controller's profile.

    Raises:
        LinkError: the periods differ.
    """
    if abs(granted.period - description.period) > _SAME * description.period:
        raise LinkError(
            f"the robot's side has a period of {granted.period:g} s, the profile says {description.period:g} s: "
            "give both the same profile"
        )
