"""Questions and commands of strangers: bounded by their types, answered one by one, and never in the holder's name."""

from __future__ import annotations

import json
import time
import zlib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from toy_world import PERIOD, ToyWorld, wander

from tests.transport.serving import serving
from transport.bus import Bus
from transport.codec import CodecError, encode_twist
from transport.connect import open_robot
from transport.description import RobotDescription
from transport.envelope import CommandTag, ObservationTag, is_signed
from transport.gate import Gate, PacedWorld
from transport.lockstep import LockstepServer
from transport.memory_bus import MemoryNetwork
from transport.messages import Command, Observation, Twist
from transport.robot import LinkError
from transport.session import (
    Ask,
    Close,
    Granted,
    Lease,
    Open,
    Refused,
    Retry,
    SessionState,
    Unread,
    read_answer,
    respond,
    written,
)
from transport.settings import LinkSettings
from transport.zenoh_bus import ZenohBus, session_settings

TOY = RobotDescription(name="toy")
SECRET = "0123456789abcdef0123456789abcdef"


def sealed(question: object) -> bytes:
    text = json.dumps(question).encode()
    return b"%s\n%08x" % (text, zlib.crc32(text))


class StrictDesk:
    """A robot's side that only survives what the types promise."""

    def __init__(self) -> None:
        self.lease = Lease(1.0, lambda: 0.0)
        self.asked: list[object] = []

    def open(self, question: Open) -> Granted | Refused:
        assert question.seed is None or 0 <= question.seed < 2**63
        assert len(question.controller) <= 200
        assert question.controller.isprintable()
        self.asked.append(question)
        return Granted(epoch=1, secret=SECRET, robot="toy", mode="lockstep", period=0.1)

    def close(self, question: Close) -> SessionState:
        return self.state(Ask(secret=question.secret))

    def state(self, question: Ask) -> SessionState:
        assert len(question.secret) <= 64
        self.asked.append(question)
        return SessionState(held=False)

    def again(self, question: Retry) -> SessionState:
        assert 0 <= question.attempt < 2**31
        return self.state(Ask(secret=question.secret))


GOOD = {
    "open": {"request": "a", "controller": "me", "seed": 3, "previous": ""},
    "close": {"secret": SECRET},
    "ask": {"secret": SECRET},
    "again": {"secret": SECRET, "attempt": 2},
}
values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.integers(-(2**70), 2**70) | st.floats() | st.text(max_size=300),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)


@st.composite
def questions(draw: st.DrawFn) -> dict[str, object]:
    kind = draw(st.sampled_from(sorted(GOOD)))
    question: dict[str, object] = {"kind": kind, "protocol": 2, **GOOD[kind]}
    for name in draw(st.lists(st.sampled_from([*question, "more"]), max_size=2)):
        question[name] = draw(values)
    return question


@settings(max_examples=300, deadline=None, derandomize=True)
@given(questions())
def test_any_question_has_an_answer_and_only_a_bounded_one_reaches_the_desk(question: dict[str, object]) -> None:
    desk = StrictDesk()
    answer, fault = respond(desk, sealed(question))
    read = read_answer(answer)
    assert isinstance(read, Refused) == (fault == "malformed question")
    assert bool(desk.asked) == (not fault)


@pytest.mark.parametrize("kind", sorted(GOOD))
def test_a_good_question_reaches_the_desk(kind: str) -> None:
    desk = StrictDesk()
    _, fault = respond(desk, sealed({"kind": kind, "protocol": 2, **GOOD[kind]}))
    assert (fault, len(desk.asked)) == ("", 1)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"seed": -5}, "seed"),
        ({"seed": 2**63}, "seed"),
        ({"seed": "0"}, "seed"),
        ({"controller": "x" * 201}, "controller"),
        ({"previous": "not hexadecimal"}, "previous"),
        ({"protocol": 1}, "version 2, not 1"),
        ({"protocol": 3, "new": "field"}, "version 2, not 3"),
        ({"request": "x" * 5000}, "too long"),
        ({"kind": "nope"}, "must have `kind`, one of 'open', 'close', 'ask', 'again', not 'nope'"),
    ],
)
def test_a_whole_question_that_is_wrong_is_refused_with_the_reason(change: dict[str, object], words: str) -> None:
    answer, fault = respond(StrictDesk(), sealed({"kind": "open", "protocol": 2, **GOOD["open"], **change}))
    refused = read_answer(answer)
    assert isinstance(refused, Refused)
    assert words in refused.reason
    assert fault == "malformed question"


@pytest.mark.parametrize(
    ("text", "words"),
    [(b"{", "must be JSON: EOF"), (b"[]", "must be a section"), (b"{}", "must have `kind`"), (b"\xff", "must be JSON")],
)
def test_what_is_no_question_is_refused_with_the_reason(text: bytes, words: str) -> None:
    refused = read_answer(respond(StrictDesk(), b"%s\n%08x" % (text, zlib.crc32(text)))[0])
    assert isinstance(refused, Refused)
    assert words in refused.reason


def test_a_damaged_question_is_to_be_asked_again() -> None:
    answer, fault = respond(StrictDesk(), sealed({"kind": "ask", "secret": SECRET})[:-1] + b"g")
    assert isinstance(read_answer(answer), Unread)
    assert fault == "malformed question"


def test_escape_codes_in_a_name_reach_no_terminal() -> None:
    desk = StrictDesk()
    respond(desk, sealed({"kind": "open", "protocol": 2, **GOOD["open"], "controller": "\x1b[2Jme\x07\u202e"}))
    assert desk.asked[0].controller == "?[2Jme??"
    state = read_answer(written(SessionState(held=True, report={"line": "\x1b[31mout", "list": ["\x9b1m"]})))
    assert isinstance(state, SessionState)
    assert state.report == {"line": "?[31mout", "list": ["?1m"]}


class FailingWorld(ToyWorld):
    """A simulation with a fault in it: seed 13 cannot begin, and the third step of seed 3 fails."""

    def __init__(self, seed: int | None, length: int = 50) -> None:
        if seed == 13:
            raise RuntimeError("no world with this seed")
        super().__init__(seed, length)

    def step(self, command: Command) -> Observation:
        if self.seed == 3 and len(self.commands) == 2:
            raise ArithmeticError("the third step")
        return super().step(command)


@contextmanager
def lockstep(bus: Bus) -> Iterator[LockstepServer]:
    server = LockstepServer(bus, "toy", PERIOD, FailingWorld, patience=30.0)
    with serving(server):
        yield server


def test_a_world_that_cannot_begin_is_refused_and_the_next_controller_served() -> None:
    network = MemoryNetwork()
    with lockstep(network.bus()) as server:
        with pytest.raises(LinkError, match="RuntimeError: no world with this seed"):
            open_robot(network.bus(), TOY, LinkSettings(), seed=13)
        assert server.dropped == {"failed question": 1}
        robot = open_robot(network.bus(), TOY, LinkSettings(), seed=1)
        robot.observe()
        robot.close()


def test_a_step_that_fails_ends_the_episode_with_the_reason_and_nothing_else() -> None:
    network = MemoryNetwork()
    with lockstep(network.bus()) as server:
        robot = open_robot(network.bus(), TOY, LinkSettings(), seed=3)
        for _ in range(3):
            robot.command(wander(robot.observe()))
        with pytest.raises(LinkError, match="ArithmeticError: the third step"):
            robot.observe()
        assert server.dropped["failed step"] == 1
        robot = open_robot(network.bus(), TOY, LinkSettings(), seed=1)
        for _ in range(5):
            robot.command(wander(robot.observe()))
        robot.close()


def test_behind_a_gate_a_step_that_fails_stops_the_base_and_the_gate_lives_on() -> None:
    network = MemoryNetwork()
    settings = LinkSettings(dead_man=20.0, answer_age=20.0, silence=1.0, stale=20.0, patience=30.0)
    gate = Gate(network.bus(), PacedWorld(FailingWorld, PERIOD), TOY, settings)
    with serving(gate):
        robot = open_robot(network.bus(), TOY, settings, seed=3)

        def drive() -> None:
            while True:
                observation = robot.observe()
                robot.command(Command(Twist(0.1), answers=observation.stamp))

        with pytest.raises(LinkError, match="has sent no data for 1 s"):
            drive()
        assert gate.dropped["failed step"] == 1
        robot = open_robot(network.bus(), TOY, settings, seed=1)
        robot.observe()
        robot.close()


class Loopback:
    """Buses that meet at a router of their own on the loopback."""

    def __init__(self, endpoint: str, kept: ExitStack) -> None:
        self._endpoint, self._kept = endpoint, kept
        self._opened("router", listen=endpoint)

    def bus(self) -> ZenohBus:
        return self._opened("client", connect=self._endpoint, wait=10.0)

    def _opened(self, mode: str, **where: Any) -> ZenohBus:
        bus = ZenohBus(session_settings(mode, **where))
        self._kept.callback(bus.close)
        return bus


@pytest.fixture(params=["memory", "zenoh"])
def net(request: pytest.FixtureRequest, endpoint: str) -> Iterator[MemoryNetwork | Loopback]:
    with ExitStack() as kept:
        yield MemoryNetwork() if request.param == "memory" else Loopback(endpoint, kept)


@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
def test_whoever_has_read_observations_and_commands_can_neither_take_nor_give_back_nor_drive(
    mode: str, net: MemoryNetwork | Loopback
) -> None:
    network = net
    settings = LinkSettings(dead_man=20.0, answer_age=20.0, stale=20.0, patience=30.0)
    server: LockstepServer | Gate
    if mode == "lockstep":
        server = LockstepServer(network.bus(), "toy", PERIOD, ToyWorld, patience=30.0)
    else:
        server = Gate(network.bus(), PacedWorld(ToyWorld, PERIOD), TOY, settings)
    stranger = network.bus()
    odometry, commands = stranger.newest("toy/odom"), stranger.newest("toy/cmd_vel")
    with serving(server):
        robot = open_robot(network.bus(), TOY, settings, seed=1)
        for _ in range(3):
            robot.command(wander(robot.observe()))
        robot.observe()
        seen, heard = odometry.take(), commands.take()
        assert seen is not None
        assert heard is not None
        tag = ObservationTag.decode(seen.attachment, seen.payload)
        assert tag.epoch == server.lease.epoch
        secret = server.lease.secret
        for read in (*seen, *heard):
            assert secret.encode() not in read
            assert bytes.fromhex(secret) not in read
        for guess in (f"{tag.epoch:x}", "", "0" * 32):
            for question in (
                Open(request="b", controller="stranger", previous=guess),
                Close(secret=guess),
                Retry(secret=guess, attempt=2),
            ):
                answer = stranger.ask("toy/session", written(question), 5.0)
                assert answer is not None
                read = read_answer(answer)
                assert isinstance(read, Refused) or (isinstance(read, SessionState) and not read.held)
        payload = encode_twist(Twist(0.5))
        forged = CommandTag(tag.epoch, tag.sequence + 100, tag.stamp).encode(payload, "0" * 32)
        commander = stranger.publisher("toy/cmd_vel")
        commander.put(heard.payload, heard.attachment)
        commander.put(payload, forged)
        driven, deadline = 3, time.monotonic() + 10.0
        while driven < 6 or (not server.dropped["forged"] and time.monotonic() < deadline):
            robot.command(wander(robot.observe()))
            driven += 1
        assert server.dropped["forged"] == 1
        robot.observe()
        if mode == "lockstep":
            assert robot.report()["steps"] == driven, "what was heard once moves nothing when it is sent again"
        assert server.lease.proves(secret)
        robot.close()


def test_a_command_is_signed_field_by_field() -> None:
    payload, tag = encode_twist(Twist(0.5)), CommandTag(7, 3, 400)
    good = tag.encode(payload, SECRET)
    assert is_signed(good, payload, SECRET)
    for other in (tag._replace(sequence=4), tag._replace(answers=401), tag._replace(ring=True)):
        swapped = other.encode(payload, "")[:-8] + good[-8:]
        assert not is_signed(swapped, payload, SECRET)
    assert not is_signed(good, encode_twist(Twist(0.4)), SECRET)
    assert not is_signed(good, payload, SECRET[::-1])


@pytest.mark.parametrize(
    "granted",
    [
        Granted(epoch=1, secret=SECRET, robot="other", mode="lockstep", period=PERIOD),
        Granted(epoch=1, secret=SECRET, robot="toy", mode="lockstep", period=0.05),
    ],
    ids=["another robot", "another period"],
)
def test_a_robots_side_that_grants_what_was_not_asked_for_is_turned_away(granted: Granted) -> None:
    network = MemoryNetwork()
    network.bus().serve("toy/session", lambda request: request.reply(written(granted)))
    with pytest.raises(LinkError, match=r"was granted|has a period of 0\.05 s"):
        open_robot(network.bus(), TOY, LinkSettings())


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    st.sampled_from(["epoch", "secret", "robot", "mode", "period", "kind", "protocol"]),
    values,
)
def test_an_answer_is_within_its_bounds_or_none(name: str, value: object) -> None:
    granted = {"kind": "granted", "protocol": 2, "epoch": 1, "secret": SECRET, "robot": "toy", "mode": "lockstep"}
    try:
        read = read_answer(sealed({**granted, "period": PERIOD, name: value}))
    except CodecError:
        return
    assert isinstance(read, Granted)
    assert 0 <= read.epoch < 2**63
    assert 0 < read.period <= 3600
    assert read.mode in ("lockstep", "realtime")
    assert read.robot.isascii()
