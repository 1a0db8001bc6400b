"""Lockstep: the same run in memory, over a perfect and over a bad network."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager

import pytest
from toy_world import PERIOD, ToyWorld, seen, wander

from tests.transport.serving import serving
from transport.bus import Bus, Message
from transport.connect import connect_robot, dialling, listening, open_robot
from transport.description import RobotDescription
from transport.endpoints import EndpointError, check_endpoint
from transport.lockstep import LockstepServer, RemoteLockstep
from transport.memory_bus import MemoryNetwork
from transport.messages import Command, Observation
from transport.robot import LinkError
from transport.settings import LinkSettings
from transport.world import LockstepRobot

LENGTH = 40


def take(bus: Bus, seed: int | None = None, **settings: float) -> RemoteLockstep:
    return open_robot(bus, RobotDescription(name="toy"), LinkSettings(**{"step": 30.0, **settings}), seed=seed)


def reach(endpoint: str, seed: int | None = None, **settings: float) -> RemoteLockstep:
    return connect_robot(endpoint, RobotDescription(name="toy"), LinkSettings(**{"step": 30.0, **settings}), seed=seed)


@contextmanager
def served(
    bus: Bus, *, patience: float = 0.3, length: int = LENGTH, world: type[ToyWorld] = ToyWorld
) -> Iterator[LockstepServer]:
    """A simulator in a thread of its own."""
    server = LockstepServer(bus, "toy", PERIOD, lambda seed: world(seed, length), patience=patience)
    with serving(server):
        yield server


def trace(robot: LockstepRobot | RemoteLockstep, steps: int = LENGTH) -> list[object]:
    """All that a controller sees and does in a run."""
    rows: list[object] = []
    for _ in range(steps):
        observation = robot.observe()
        command = wander(observation)
        rows.append((seen(observation), command, robot.finished))
        robot.command(command)
    rows.append((seen(robot.observe()), robot.finished))
    return rows


def test_over_a_network_the_run_is_the_one_in_process_bit_for_bit() -> None:
    network = MemoryNetwork()
    with served(network.bus()):
        for seed in (0, 1, 7):
            here = LockstepRobot(ToyWorld(seed, LENGTH))
            there = take(network.bus(), seed=seed)
            assert trace(there) == trace(here)
            assert there.report() == here.report()
            there.close()


def test_over_zenoh_the_run_is_the_one_in_process_bit_for_bit(endpoint: str) -> None:
    with listening(endpoint) as bus, served(bus) as server:
        for seed in (0, 1, 7):
            here = LockstepRobot(ToyWorld(seed, LENGTH))
            there = reach(endpoint, seed=seed)
            assert trace(there) == trace(here)
            assert there.report() == here.report()
            there.close()
        assert not server.dropped["malformed"]


def test_different_seeds_are_different_runs() -> None:
    assert trace(LockstepRobot(ToyWorld(1))) != trace(LockstepRobot(ToyWorld(2)))


Fault = Callable[[str, Message], Iterable[Message]]


def losing(chance: random.Random) -> Fault:
    return lambda _key, message: () if chance.random() < 0.2 else (message,)


def doubling(chance: random.Random) -> Fault:
    return lambda _key, message: (message,) * chance.randrange(1, 4)


def damaging(chance: random.Random) -> Fault:
    def fault(_key: str, message: Message) -> Iterable[Message]:
        if chance.random() < 0.8:
            return (message,)
        payload = bytearray(message.payload)
        payload[chance.randrange(len(payload))] ^= 1 << chance.randrange(8)
        return (Message(bytes(payload), message.attachment),)

    return fault


def replaying(chance: random.Random) -> Fault:
    """Old messages of the same key come again, before and after the new one."""
    history: dict[str, list[Message]] = {}

    def fault(key: str, message: Message) -> Iterable[Message]:
        past = history.setdefault(key, [])
        past.append(message)
        old = [chance.choice(past) for _ in range(chance.randrange(3))]
        return (*old, message, *old)

    return fault


@pytest.mark.parametrize("make", [losing, doubling, damaging, replaying])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_bad_network_changes_nothing_of_the_run(
    make: Callable[[random.Random], Fault], seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("transport.lockstep._SHORTEST_RESEND", 0.005)
    monkeypatch.setattr("transport.lockstep._LONGEST_RESEND", 0.01)
    network = MemoryNetwork()
    with served(network.bus()):
        robot = take(network.bus(), seed=seed)
        network.fault = make(random.Random(seed))
        assert trace(robot) == trace(LockstepRobot(ToyWorld(seed, LENGTH)))
        network.fault = lambda _key, message: (message,)
        assert robot.report()["steps"] == LENGTH
        robot.close()


class TwoAttempts(ToyWorld):
    """A toy that may be put back once."""

    attempt = 1

    def try_again(self) -> bool:
        if self.attempt == 2:
            return False
        self.attempt = 2
        self.step(Command())
        return True

    def attempts(self) -> list[dict[str, object]]:
        return [{"attempt": number + 1} for number in range(self.attempt)]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_another_attempt_begins_once_also_over_a_bad_network(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("transport.lockstep._SHORTEST_RESEND", 0.005)
    monkeypatch.setattr("transport.lockstep._LONGEST_RESEND", 0.01)
    network = MemoryNetwork()
    with served(network.bus(), world=TwoAttempts):
        here, there = LockstepRobot(TwoAttempts(seed, LENGTH)), take(network.bus(), seed=seed)
        network.fault = replaying(random.Random(seed))
        assert trace(there, 10) == trace(here, 10)
        assert there.try_again()
        assert here._world.try_again()
        assert trace(there, 10) == trace(here, 10)
        assert not there.try_again()
        assert there.attempts() == [{"attempt": 1}, {"attempt": 2}]
        assert trace(there, 10) == trace(here, 10)
        there.close()


def test_a_world_of_one_attempt_grants_no_other() -> None:
    network = MemoryNetwork()
    with served(network.bus()):
        robot = take(network.bus(), seed=1)
        assert not robot.try_again()
        assert trace(robot) == trace(LockstepRobot(ToyWorld(1, LENGTH)))
        robot.close()


def test_a_second_controller_is_refused_and_told_who_drives() -> None:
    network = MemoryNetwork()
    with served(network.bus(), patience=30.0):
        first = take(network.bus())
        stop = threading.Event()

        def drive() -> None:
            while not stop.is_set():
                first.command(wander(first.observe()))

        thread = threading.Thread(target=drive)
        thread.start()
        try:
            with pytest.raises(LinkError, match=r"driven by .*process \d+"):
                take(network.bus())
        finally:
            stop.set()
            thread.join(60)
        first.close()
        take(network.bus()).close()


def test_the_lease_of_a_dead_controller_frees_by_itself() -> None:
    network = MemoryNetwork()
    with served(network.bus(), patience=0.3):
        dead = take(network.bus(), seed=1)
        dead.command(wander(dead.observe()))
        heir = take(network.bus(), seed=2)
        assert trace(heir) == trace(LockstepRobot(ToyWorld(2, LENGTH)))
        dead.command(wander(dead.observe()))
        with pytest.raises(LinkError, match="another controller took the robot"):
            dead.observe()
        heir.close()


def test_a_simulator_that_was_restarted_is_found_out() -> None:
    network = MemoryNetwork()
    bus = network.bus()
    with served(bus):
        robot = take(network.bus(), seed=1)
        robot.command(wander(robot.observe()))
        robot.observe()
    bus.close()
    with served(network.bus()):
        robot.command(wander(robot.observe()))
        with pytest.raises(LinkError, match="restarted"):
            robot.observe()


def test_a_simulator_that_is_gone_is_told_within_the_limit() -> None:
    network = MemoryNetwork()
    bus = network.bus()
    with served(bus):
        robot = take(network.bus(), step=1.0)
        robot.command(wander(robot.observe()))
        robot.observe()
    bus.close()
    robot.command(wander(robot.observe()))
    with pytest.raises(LinkError, match=r"not answered for 1 s"):
        robot.observe()


def test_a_simulator_that_answers_questions_is_not_gone() -> None:
    network, lost = MemoryNetwork(), []

    def lossy(key: str, message: Message) -> Iterable[Message]:
        if key == "toy/scan" and len(lost) < 6:
            lost.append(message)
            return ()
        return (message,)

    with served(network.bus()):
        robot = take(network.bus(), seed=2, step=0.2)
        robot.observe()
        network.fault = lossy
        robot.command(wander(robot.observe()))
        assert robot.observe().stamp == 200_000_000
    assert len(lost) == 6


def test_a_simulator_that_answers_questions_and_makes_no_step_is_given_up() -> None:
    network = MemoryNetwork()
    with served(network.bus()):
        robot = take(network.bus(), step=0.1)
        robot.observe()
        network.fault = lambda key, message: () if key == "toy/scan" else (message,)
        robot.command(wander(robot.observe()))
        with pytest.raises(LinkError, match=r"'toy' answers, but made no step for"):
            robot.observe()


def test_time_in_which_the_controller_itself_does_not_run_is_no_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    asleep = [0.0]
    monkeypatch.setattr("transport.lockstep.time.monotonic", lambda now=time.monotonic: now() + asleep[0])

    class Suspended(ToyWorld):
        def step(self, command: Command) -> Observation:
            asleep[0] += 3600.0
            return super().step(command)

    network = MemoryNetwork()
    with served(network.bus(), world=Suspended):
        assert trace(take(network.bus(), seed=3)) == trace(LockstepRobot(ToyWorld(3, LENGTH)))


def test_foreign_messages_are_counted_and_change_nothing() -> None:
    network = MemoryNetwork()
    with served(network.bus()) as server:
        robot = take(network.bus(), seed=3)
        robot.observe()
        intruder = network.bus()
        for key in ("toy/cmd_vel", "toy/scan", "toy/odom"):
            publisher = intruder.publisher(key)
            for payload, attachment in ((b"", b""), (b"rubbish", b"rubbish" * 10), (bytes(2_000_000), b"")):
                publisher.put(payload, attachment)
        assert trace(robot) == trace(LockstepRobot(ToyWorld(3, LENGTH)))
        # On a busy computer a step is asked for twice, and one of the answers is dropped as well.
        assert server.dropped == {"malformed": 2, "oversized": 1}
        assert (robot.dropped["foreign"], robot.dropped["malformed"]) == (4, 2)
        robot.close()


def test_nobody_at_the_address_is_one_message_within_the_limit(endpoint: str) -> None:
    with pytest.raises(LinkError, match=f"nothing answers at {endpoint}"):
        reach(endpoint, connect=0.3)


def test_a_robot_of_another_name_is_one_message(endpoint: str) -> None:
    with listening(endpoint) as bus, served(bus), pytest.raises(LinkError, match="no robot named 'pico2' answered"):
        connect_robot(endpoint, RobotDescription(name="pico2"), LinkSettings(connect=1.5))


def test_a_busy_port_is_one_message(endpoint: str) -> None:
    with listening(endpoint), pytest.raises(LinkError, match=f"{endpoint} is taken"), listening(endpoint):
        pass


@pytest.mark.parametrize(
    "wrong",
    ["nonsense", "", "tcp/127.0.0.1", "tcp/:7447", "tcp/127.0.0.1:99999", "carrier-pigeon/127.0.0.1:7447", "tcp/a:1#b"],
)
def test_a_malformed_endpoint_is_one_message(wrong: str) -> None:
    with pytest.raises(EndpointError, match=f"`{wrong}` is not an endpoint") as caught, listening(wrong):
        pass
    assert "\n" not in str(caught.value)
    with pytest.raises(EndpointError, match=f"`{wrong}` is not an endpoint"), dialling(wrong):
        pass


@pytest.mark.parametrize("good", ["tls/[::1]:7447", "tcp/robot-7.local:1", "unixsock-stream/run/robot.sock"])
def test_endpoints_are_written_in_several_ways(good: str) -> None:
    assert check_endpoint(good) == good
