"""Real time without waiting for it: both ends of the link on one clock that is turned by hand."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from toy_world import PERIOD, ToyWorld

from transport.bus import Message
from transport.codec import decode_twist, encode_odometry, encode_scan
from transport.connect import open_robot
from transport.description import RobotDescription
from transport.driver import RosDriver
from transport.gate import DriverBase, Gate, PacedWorld
from transport.keys import RobotKeys
from transport.memory_bus import MemoryNetwork, faultless
from transport.messages import STOP, Command, Observation, Twist
from transport.realtime import HALT, RealtimeRobot
from transport.robot import LinkError
from transport.settings import LinkSettings

TOY = RobotDescription(name="toy")
FORWARD = Twist(0.2, 0.0, 0.0)


class Hand:
    """Time passes only while somebody waits; meanwhile the other end works."""

    def __init__(self) -> None:
        self.time = 50.0
        self.others: list[Callable[[], object]] = []

    def now(self) -> float:
        return self.time

    def wait(self, seconds: float) -> None:
        end = self.time + seconds
        while self.time < end - 1e-9:
            self.time = min(end, self.time + 0.005)
            for work in self.others:
                work()


class Rig:
    """A simulated robot, its gate and a network."""

    def __init__(self) -> None:
        self.clock = Hand()
        self.network = MemoryNetwork(clock=self.clock)
        self.settings = LinkSettings()
        self.worlds: list[ToyWorld] = []
        self.start()

    def start(self) -> None:
        self.side = self.network.bus()
        base = PacedWorld(self._make, PERIOD, self.clock)
        self.gate = Gate(self.side, base, TOY, self.settings, self.clock)
        self.clock.others = [self.gate.pump]

    def _make(self, seed: int | None) -> ToyWorld:
        self.worlds.append(ToyWorld(seed, 10_000))
        return self.worlds[-1]

    def controller(self, seed: int | None = None) -> RealtimeRobot:
        return open_robot(self.network.bus(), TOY, self.settings, seed=seed, clock=self.clock)

    @property
    def driven(self) -> list[Twist]:
        """What the world was told, period by period."""
        return [command.twist for command in self.worlds[-1].commands]


@pytest.fixture
def rig() -> Rig:
    return Rig()


def drive(robot: RealtimeRobot, beats: int, twist: Twist = FORWARD, *, ring: bool = False) -> list[Observation]:
    seen = []
    for _ in range(beats):
        seen.append(robot.observe())
        robot.command(Command(twist, ring, seen[-1].stamp))
    return seen


def test_ten_beats_take_a_second_and_bring_new_data_each(rig: Rig) -> None:
    robot = rig.controller()
    began = rig.clock.now()
    seen = drive(robot, 20)
    assert rig.clock.now() - began == pytest.approx(19 * PERIOD, abs=0.01)
    stamps = [observation.stamp for observation in seen]
    assert stamps == sorted(set(stamps))
    assert max(observation.link.scan_age for observation in seen) <= PERIOD
    assert rig.driven[-5:] == [FORWARD] * 5
    assert rig.gate.guard.rejected.total() == 0


def test_a_controller_that_falls_silent_is_stopped_within_250_ms_and_a_period(rig: Rig) -> None:
    robot = rig.controller()
    drive(robot, 5)
    silent = rig.clock.now()
    while rig.driven[-1] != STOP:
        rig.clock.wait(0.005)
    assert rig.clock.now() - silent <= 0.25 + PERIOD + 0.01
    rig.clock.wait(2.0)
    assert set(rig.driven[-20:]) == {STOP}
    assert rig.gate.guard.stopped


def test_a_stop_stays_until_the_controller_stands_still_on_purpose(rig: Rig) -> None:
    robot = rig.controller()
    drive(robot, 5)
    rig.clock.wait(0.6)
    seen = drive(robot, 5)
    assert [observation.link.stopped for observation in seen[1:]] == [True] * 4
    assert set(rig.driven[-5:]) == {STOP}
    drive(robot, 2, STOP)
    seen = drive(robot, 5)
    assert not seen[-1].link.stopped
    assert rig.driven[-1] == FORWARD


def test_a_robot_is_taken_again_also_where_an_answer_is_lost(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = rig.controller()
    drive(robot, 5)
    bus = robot._driver._bus
    ask, lost = bus.ask, []

    def losing(key: str, payload: bytes, timeout: float) -> bytes | None:
        lost.append(ask(key, payload, timeout))
        return lost[-1] if len(lost) > 1 else None

    for _ in range(2):
        lost.clear()
        rig.clock.wait(0.3)
        monkeypatch.setattr(bus, "ask", losing)
        drive(robot, 3, STOP)
        assert len(lost) == 2
        assert not drive(robot, 3)[-1].link.stopped
        assert rig.driven[-1] == FORWARD


def test_missed_beats_are_counted_and_not_caught_up(rig: Rig) -> None:
    robot = rig.controller()
    drive(robot, 3)
    rig.clock.wait(0.34)
    before = rig.clock.now()
    drive(robot, 3)
    assert robot.overruns == 2
    assert rig.clock.now() - before >= 1.5 * PERIOD


def test_old_data_is_told_and_the_return_is_counted(rig: Rig) -> None:
    robot = rig.controller()
    drive(robot, 5)
    rig.network.fault = lambda key, message: () if key != "toy/cmd_vel" else (message,)
    ages = [observation.link.scan_age for observation in drive(robot, 8)]
    assert ages == sorted(ages)
    assert ages[-1] == pytest.approx(0.8, abs=0.1)
    # What the controller says meanwhile answers old observations: the robot stands.
    assert rig.driven[-1] == STOP
    rig.network.fault = faultless
    seen = drive(robot, 2)
    assert seen[-1].link.reconnects == 1
    assert seen[-1].link.scan_age <= PERIOD


def test_a_robot_that_is_gone_ends_the_run_within_its_limit(rig: Rig) -> None:
    robot = rig.controller()
    drive(robot, 3)
    rig.clock.others.clear()
    began = rig.clock.now()
    with pytest.raises(LinkError, match="sent no data for 5 s"):
        drive(robot, 100)
    assert rig.clock.now() - began < 5.0 + 2 * PERIOD


def test_a_restarted_simulation_is_never_taken_for_the_old_one(rig: Rig) -> None:
    robot = rig.controller()
    drive(robot, 3)
    rig.side.close()
    rig.start()
    with pytest.raises(LinkError, match="sent no data"):
        drive(robot, 100, STOP)
    assert not rig.worlds[1:]


def test_a_second_controller_is_refused_and_changes_nothing(rig: Rig) -> None:
    robot = rig.controller()
    drive(robot, 6)
    rig.clock.others.append(lambda: robot._pace.due() <= 0 and drive(robot, 1))
    with pytest.raises(LinkError, match=r"driven by .*process \d+"):
        rig.controller()
    assert set(rig.driven[-5:]) == {FORWARD}
    assert rig.gate.guard.rejected.total() == 0


def test_a_closed_controller_leaves_the_simulator_to_the_next(rig: Rig) -> None:
    robot = rig.controller(seed=4)
    drive(robot, 3)
    robot.close()
    robot.close()
    drive(rig.controller(seed=5), 3)
    assert [world.seed for world in rig.worlds] == [4, 5]


def test_a_ring_is_answered_once(rig: Rig) -> None:
    robot = rig.controller()
    drive(robot, 2)
    drive(robot, 1, STOP, ring=True)
    answers = [observation.door for observation in drive(robot, 10) if observation.door]
    assert [answer.accepted for answer in answers] == [True]


def test_the_referee_is_asked_for_his_verdict(rig: Rig) -> None:
    robot = rig.controller(seed=6)
    drive(robot, 3)
    assert robot.report()["seed"] == 6
    assert not robot.finished


def test_damaged_repeated_and_foreign_messages_are_dropped_and_counted(rig: Rig) -> None:
    robot = rig.controller()
    last: dict[str, Message] = {}

    def fault(key: str, message: Message) -> tuple[Message, ...]:
        again = last.get(key, message)
        last[key] = message
        damaged = Message(message.payload[:-1] + b"\xff", message.attachment)
        return (again, message, damaged, Message(b"", b"junk")) if "cmd" in key else (damaged, message)

    rig.network.fault = fault
    drive(robot, 20)
    assert rig.driven[-1] == FORWARD
    assert not rig.gate.guard.stopped
    assert rig.gate.dropped["malformed"] >= 38
    assert rig.gate.guard.rejected["repeated"] >= 18


def test_an_insane_sensor_is_refused_before_anything_drives(rig: Rig) -> None:
    other = RobotDescription(name="toy", laser={"beams": 500})
    with pytest.raises(LinkError, match="cannot drive 'toy': the scan has 1000 beams, the profile says 500"):
        open_robot(rig.network.bus(), other, rig.settings, clock=rig.clock)
    rig.clock.wait(PERIOD)
    assert rig.driven[-1] == STOP


def test_a_robot_without_a_scan_is_refused(rig: Rig) -> None:
    rig.network.fault = lambda key, message: () if key == "toy/scan" else (message,)
    with pytest.raises(LinkError, match="no scan has come within 5 s"):
        rig.controller()


class BareRobot:
    """A ROS 2 driver: it publishes what it senses and obeys whoever speaks."""

    def __init__(self, network: MemoryNetwork, keys: RobotKeys, clock: Hand, brake: float = 10.0) -> None:
        self.told: list[Twist] = []
        self.speed, self._brake = 0.0, brake
        self.clock = clock
        bus = network.bus()
        self._world = ToyWorld(0, 10_000)
        self._scan, self._odometry = bus.publisher(keys.scan), bus.publisher(keys.odometry)
        self._next = clock.now()
        bus.subscribe(keys.command, lambda message: self.told.append(decode_twist(message.payload)))

    def pump(self) -> None:
        if self.clock.now() >= self._next:
            self._next += PERIOD
            told = self.told[-1].forward if self.told else 0.0
            self.speed = max(told, self.speed - self._brake * PERIOD)
            observation = self._world.step(Command(Twist(self.speed)))
            self._odometry.put(encode_odometry(observation.odometry))
            self._scan.put(encode_scan(observation.scan))


@pytest.mark.parametrize(
    ("keys", "door_call"), [("bridge", "service"), ("rmw_zenoh", "message"), ("rmw_zenoh", "service")]
)
def test_a_bare_driver_is_driven_without_a_gate(keys: str, door_call: str) -> None:
    clock = Hand()
    network = MemoryNetwork(clock=clock)
    settings = LinkSettings(gate=False, keys=keys, door_call=door_call)
    bare = BareRobot(network, RobotKeys("toy", settings), clock)
    clock.others.append(bare.pump)
    robot = open_robot(network.bus(), TOY, settings, clock=clock)
    seen = drive(robot, 5)
    assert bare.told == [FORWARD] * 5
    assert seen[-1].odometry.x > seen[0].odometry.x
    robot.close()
    assert bare.told[-1] == STOP


@pytest.mark.parametrize(("brake", "at_rest"), [(10.0, True), (0.2, True), (0.0, False)])
def test_a_robot_is_watched_until_it_stands(brake: float, at_rest: bool) -> None:
    clock = Hand()
    network = MemoryNetwork(clock=clock)
    settings = LinkSettings(gate=False)
    bare = BareRobot(network, RobotKeys("toy", settings), clock, brake)
    clock.others.append(bare.pump)
    robot = open_robot(network.bus(), TOY, settings, clock=clock)
    drive(robot, 5)
    assert bare.speed == FORWARD.forward
    began = clock.now()
    assert robot.halt() is at_rest
    assert (bare.speed == 0.0) is at_rest
    assert clock.now() - began <= HALT + PERIOD
    assert set(bare.told[5:]) == {STOP}


def test_without_odometry_nothing_confirms_that_a_robot_stands(rig: Rig) -> None:
    robot = rig.controller()
    drive(robot, 5)
    rig.network.fault = lambda key, message: () if key == "toy/odom" else (message,)
    assert not robot.halt()
    assert rig.driven[-1] == STOP


def test_a_gate_in_front_of_a_bare_driver_stops_it_within_a_quarter_of_a_second() -> None:
    clock = Hand()
    network = MemoryNetwork(clock=clock)
    inside = RobotKeys("base", LinkSettings(gate=False))
    bare = BareRobot(network, inside, clock)
    gate = Gate(
        network.bus(), DriverBase(RosDriver(network.bus(), inside), TOY.laser, clock), TOY, LinkSettings(), clock
    )
    clock.others = [bare.pump, gate.pump]
    clock.wait(0.3)
    robot = open_robot(network.bus(), TOY, LinkSettings(), clock=clock)
    drive(robot, 10)
    assert bare.told[-1] == FORWARD
    silent = clock.now()
    while bare.told[-1] != STOP:
        clock.wait(0.005)
    assert clock.now() - silent == pytest.approx(0.25, abs=0.011)
    clock.wait(1.0)
    assert set(bare.told[-5:]) == {STOP}
    drive(robot, 2, STOP)
    drive(robot, 3)
    assert bare.told[-1] == FORWARD
    robot.close()
    assert bare.told[-1] == STOP


def test_a_gate_that_was_restarted_is_taken_again_by_standing_still() -> None:
    clock = Hand()
    network = MemoryNetwork(clock=clock)
    inside = RobotKeys("base", LinkSettings(gate=False))
    bare = BareRobot(network, inside, clock)
    side = network.bus()
    gate = Gate(side, DriverBase(RosDriver(network.bus(), inside), TOY.laser, clock), TOY, LinkSettings(), clock)
    clock.others = [bare.pump, gate.pump]
    clock.wait(0.3)
    robot = open_robot(network.bus(), TOY, LinkSettings(), clock=clock)
    drive(robot, 5)
    side.close()
    gate = Gate(
        network.bus(), DriverBase(RosDriver(network.bus(), inside), TOY.laser, clock), TOY, LinkSettings(), clock
    )
    clock.others = [bare.pump, gate.pump]
    assert drive(robot, 5)[-1].link.stopped
    drive(robot, 2, STOP)
    drive(robot, 3)
    assert bare.told[-1] == FORWARD


def test_a_gate_refuses_while_its_driver_is_silent() -> None:
    clock = Hand()
    network = MemoryNetwork(clock=clock)
    inside = RobotKeys("base", LinkSettings(gate=False))
    gate = Gate(
        network.bus(), DriverBase(RosDriver(network.bus(), inside), TOY.laser, clock), TOY, LinkSettings(), clock
    )
    clock.others = [gate.pump]
    with pytest.raises(
        LinkError, match=r"driver sends no scan or no odometry: the gate listens on `\w+/scan` and `\w+/odom`"
    ):
        open_robot(network.bus(), TOY, LinkSettings(), clock=clock)
