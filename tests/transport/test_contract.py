"""What every robot promises its controller, wherever it is: one set of tests for all implementations."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from toy_world import GEOMETRY, PERIOD, ToyWorld, wander

from tests.transport.serving import serving, working
from transport.bus import Bus
from transport.codec import decode_twist, encode_odometry, encode_scan
from transport.connect import dialling, listening, open_robot
from transport.description import RobotDescription
from transport.driver import RosDriver
from transport.gate import DriverBase, Gate, PacedWorld
from transport.keys import RobotKeys
from transport.lockstep import LockstepServer
from transport.memory_bus import MemoryNetwork
from transport.messages import STOP, Command, Observation, Twist
from transport.recording import Recorder, ReplayRobot, read_recording
from transport.robot import Robot
from transport.settings import LinkSettings
from transport.world import LockstepRobot

SLOWLY = Twist(0.1)
TOY = RobotDescription(name="toy")
PATIENT = {"dead_man": 20.0, "answer_age": 20.0, "stale": 20.0, "connect": 30.0, "silence": 30.0}
"""Nothing here must hang on how busy the computer is; limits in time are tested on a clock turned by hand."""
SETTINGS = LinkSettings(**PATIENT)
BARE = LinkSettings(gate=False, **PATIENT)
Make = Callable[[ExitStack, tuple[Bus, Bus]], Robot]


def in_process(_stack: ExitStack, _buses: tuple[Bus, Bus]) -> Robot:
    return LockstepRobot(ToyWorld(1, 10_000))


def lockstep(stack: ExitStack, buses: tuple[Bus, Bus]) -> Robot:
    server = LockstepServer(buses[0], "toy", PERIOD, ToyWorld)
    stack.enter_context(serving(server))
    return open_robot(buses[1], TOY, SETTINGS, seed=1)


def realtime(stack: ExitStack, buses: tuple[Bus, Bus]) -> Robot:
    gate = Gate(buses[0], PacedWorld(lambda seed: ToyWorld(seed, 10_000), PERIOD), TOY, SETTINGS)
    stack.enter_context(serving(gate))
    return open_robot(buses[1], TOY, SETTINGS, seed=1)


def bare(stack: ExitStack, buses: tuple[Bus, Bus]) -> Robot:
    keys = RobotKeys("toy", BARE)
    world = ToyWorld(1, 10_000)
    told: deque[Twist] = deque([STOP], maxlen=1)
    buses[0].subscribe(keys.command, lambda message: told.append(decode_twist(message.payload)))
    publishers = buses[0].publisher(keys.odometry), buses[0].publisher(keys.scan)
    tick = threading.Event()

    def work(stop: Callable[[], bool]) -> None:
        while not stop():
            observation = world.step(Command(told[0]))
            publishers[0].put(encode_odometry(observation.odometry))
            publishers[1].put(encode_scan(observation.scan))
            tick.wait(PERIOD)

    stack.enter_context(working(work))
    return open_robot(buses[1], TOY, BARE)


def replayed(stack: ExitStack, _buses: tuple[Bus, Bus]) -> Robot:
    path = Path(stack.enter_context(TemporaryDirectory())) / "run.mcap"
    robot = LockstepRobot(ToyWorld(1))
    with Recorder(path, "toy", patience=10.0) as recorder:
        for _ in range(40):
            recorder.record(robot.observe(), wander(robot.observe()))
            robot.command(wander(robot.observe()))
    return ReplayRobot(read_recording(path))


@pytest.fixture(params=["memory", "zenoh"])
def buses(request: pytest.FixtureRequest, endpoint: str) -> Iterator[tuple[Bus, Bus]]:
    if request.param == "memory":
        network = MemoryNetwork()
        yield network.bus(), network.bus()
    else:
        with listening(endpoint) as listener, dialling(endpoint) as dialler:
            yield listener, dialler


@pytest.fixture(params=[in_process, lockstep, realtime, bare, replayed], ids=lambda make: make.__name__)
def robot(request: pytest.FixtureRequest, buses: tuple[Bus, Bus]) -> Iterator[Robot]:
    with ExitStack() as stack:
        robot = request.param(stack, buses)
        yield robot
        robot.close()


def driven(robot: Robot, ticks: int, twist: Twist = SLOWLY) -> list[Observation]:
    seen = []
    for _ in range(ticks):
        seen.append(robot.observe())
        robot.command(Command(twist, answers=seen[-1].stamp))
    return seen


def test_it_shows_what_the_laser_and_the_wheels_say_in_order_of_time(robot: Robot) -> None:
    seen = driven(robot, 6)
    for observation in seen:
        assert observation.scan.geometry == GEOMETRY
        assert observation.scan.ranges.dtype == np.float32
        assert observation.scan.ranges.shape == (GEOMETRY.beams,)
        assert observation.stamp == max(observation.scan.stamp, observation.odometry.stamp)
        assert not observation.link.stopped
    stamps = [observation.stamp for observation in seen]
    assert stamps == sorted(stamps)
    assert stamps[-1] > stamps[0]


def test_what_it_showed_does_not_change_afterwards(robot: Robot) -> None:
    first = robot.observe()
    before = first.scan.ranges.copy()
    robot.command(Command(answers=first.stamp))
    driven(robot, 3)
    assert np.array_equal(first.scan.ranges, before)


def test_a_command_to_drive_moves_it_and_closing_twice_is_no_fault(robot: Robot) -> None:
    began = robot.observe().odometry.x
    while driven(robot, 1, Twist(0.4))[0].odometry.x == began:
        pass
    robot.close()
    robot.close()


def test_a_driver_behind_a_gate_keeps_the_contract(endpoint: str) -> None:
    network = MemoryNetwork()
    with ExitStack() as stack:
        inside = bare(stack, (network.bus(), network.bus()))
        inside.close()
        keys = RobotKeys("toy", BARE)
        with listening(endpoint) as outside, dialling(endpoint) as dialler:
            gate = Gate(outside, DriverBase(RosDriver(network.bus(), keys), TOY.laser), TOY, SETTINGS)
            gate_stack = stack.enter_context(ExitStack())
            gate_stack.enter_context(serving(gate))
            ready = threading.Event()
            while gate._base._senses.scan is None:
                ready.wait(0.01)
            robot = open_robot(dialler, TOY, SETTINGS)
            began = robot.observe().odometry.x
            while driven(robot, 1, Twist(0.4))[0].odometry.x <= began:
                pass
            robot.close()
            gate_stack.close()
