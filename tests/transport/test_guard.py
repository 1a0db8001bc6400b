"""The guard on the robot's side, to the millisecond: lease, command time-out, age of answers, limits."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from transport.description import Limits, RobotDescription
from transport.envelope import CommandTag
from transport.guard import CommandGuard
from transport.messages import STOP, Twist
from transport.session import Open
from transport.settings import LinkSettings

FORWARD = Twist(0.3, 0.0, 0.1)


class Hand:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.time = 100.0

    def __call__(self) -> float:
        return self.time


class Driven:
    """A guard and the controller that holds its lease."""

    def __init__(self, base: str = "holonomic", **limits: object) -> None:
        self.clock = Hand()
        robot = RobotDescription.model_validate({"limits": limits, "base": base})
        self.guard = CommandGuard(robot, LinkSettings(), self.clock)
        self.stamp = 0
        self.sequence = 0
        self.take()

    def take(self, name: str = "first", previous: str = "") -> bool:
        question = Open(request=f"{name}{self.clock()}", controller=name, previous=previous)
        return self.guard.grant(question)

    def show(self) -> int:
        self.stamp += 100_000_000
        self.guard.shown(self.stamp)
        return self.stamp

    def send(self, twist: Twist = FORWARD, **changes: int) -> bool:
        self.sequence += 1
        fields = {"epoch": self.guard.lease.epoch, "sequence": self.sequence, "answers": self.stamp} | changes
        return self.guard.accepts(CommandTag(**fields), twist)

    def reasons(self) -> dict[str, int]:
        return dict(self.guard.rejected)


@pytest.fixture
def driven() -> Driven:
    return Driven()


def test_a_timely_command_reaches_the_base(driven: Driven) -> None:
    driven.show()
    assert driven.send()
    assert driven.guard.twist() == FORWARD


def test_nothing_moves_before_the_first_command_nor_does_the_dead_man_wake(driven: Driven) -> None:
    driven.clock.time += 3600
    assert driven.guard.twist() == STOP
    assert not driven.guard.stopped


def test_the_dead_man_stops_after_250_ms_and_not_before(driven: Driven) -> None:
    driven.show()
    driven.send()
    driven.clock.time += 0.2499
    assert driven.guard.twist() == FORWARD
    driven.clock.time += 0.0002
    assert driven.guard.twist() == STOP
    assert driven.guard.stopped
    assert driven.guard.stops == 1


def test_a_stop_is_latched_until_the_lease_is_taken_anew(driven: Driven) -> None:
    driven.show()
    driven.send()
    driven.clock.time += 0.3
    driven.show()
    assert not driven.send()
    assert driven.guard.twist() == STOP
    assert driven.take(previous=driven.guard.lease.secret)
    assert driven.guard.twist() == STOP
    driven.show()
    assert driven.send()
    assert driven.guard.twist() == FORWARD
    assert driven.reasons() == {"stopped by the command time-out": 1}


def test_a_late_command_does_not_slip_past_a_dead_man_that_nobody_looked_at(driven: Driven) -> None:
    driven.show()
    driven.send()
    driven.clock.time += 0.26
    driven.show()
    assert not driven.send()
    assert driven.guard.stopped


def test_an_answer_to_an_old_observation_is_rejected_on_the_robots_own_clock(driven: Driven) -> None:
    old = driven.show()
    driven.clock.time += 0.36
    driven.show()
    assert not driven.send(answers=old)
    assert driven.send()
    assert driven.reasons() == {"answers an observation that is too old": 1}


@pytest.mark.parametrize("answers", [-1, 0, 12345, 2**62])
def test_an_answer_to_nothing_is_rejected(driven: Driven, answers: int) -> None:
    driven.show()
    assert not driven.send(answers=answers)
    assert driven.reasons() == {"answers no observation that was sent": 1}


def test_a_repeated_or_reordered_command_is_rejected(driven: Driven) -> None:
    driven.show()
    assert driven.send(sequence=5)
    assert not driven.send(sequence=5)
    assert not driven.send(sequence=4)
    assert driven.reasons() == {"repeated": 2}


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_twist_that_is_not_finite_is_rejected(driven: Driven, value: float) -> None:
    driven.show()
    assert not driven.send(Twist(0, value, 0))
    assert driven.reasons() == {"not finite": 1}


def test_a_rejected_command_does_not_keep_the_dead_man_quiet(driven: Driven) -> None:
    driven.show()
    driven.send()
    for _ in range(6):
        driven.clock.time += 0.05
        driven.send(answers=-1)
    assert driven.guard.twist() == STOP


def test_a_second_controller_is_refused_while_the_first_is_heard(driven: Driven) -> None:
    driven.clock.time += 0.9
    driven.show()
    driven.send()
    driven.clock.time += 0.9
    assert not driven.take("second")
    assert "first" in driven.guard.lease.refusal().reason


def test_a_dead_controllers_lease_frees_in_bounded_time(driven: Driven) -> None:
    before = driven.guard.lease.epoch
    driven.clock.time += 1.001
    assert driven.take("second")
    driven.show()
    assert not driven.send(epoch=before)
    assert driven.send()
    assert driven.reasons() == {"no lease": 1}


def test_giving_the_robot_back_stops_it_at_once(driven: Driven) -> None:
    driven.show()
    driven.send()
    driven.guard.release()
    assert driven.guard.twist() == STOP
    assert not driven.send(epoch=0)


finite = st.floats(-1e300, 1e300)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.builds(Twist, finite, finite, finite), st.sampled_from(["norm", "axis"]))
def test_whatever_is_sent_the_base_keeps_its_limits(twist: Twist, translation: str) -> None:
    driven = Driven(translation=translation)
    driven.show()
    assert driven.send(twist)
    held, limits = driven.guard.twist(), Limits()
    assert abs(held.turn) <= limits.turn_rate
    if translation == "norm":
        assert held.speed <= limits.speed * (1 + 1e-12)
    assert max(abs(held.forward), abs(held.left)) <= limits.speed * (1 + 1e-12)
    if twist.speed <= limits.speed and abs(twist.turn) <= limits.turn_rate:
        assert held == twist


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.builds(Twist, finite, finite, finite), st.floats(0.05, 2.0), st.floats(0.05, 2.0))
def test_a_base_that_cannot_move_sideways_is_never_told_to(twist: Twist, track: float, speed: float) -> None:
    driven = Driven(base={"kind": "differential", "track": track, "wheel_speed": speed})
    driven.show()
    assert driven.send(twist)
    assert driven.guard.twist().left == 0.0


events = st.lists(
    st.tuples(
        st.floats(0, 0.3), st.sampled_from(["show", "good", "old", "repeat", "foreign", "retake"]), st.booleans()
    ),
    max_size=60,
)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(events)
def test_the_base_never_moves_longer_than_the_dead_man_allows(script: list[tuple[float, str, bool]]) -> None:
    driven = Driven()
    accepted = -math.inf
    for pause, event, look in script:
        driven.clock.time += pause
        if event == "show":
            driven.show()
        elif event == "retake":
            driven.take(previous=driven.guard.lease.secret)
        else:
            changes = {"old": {"answers": 1}, "repeat": {"sequence": -1}, "foreign": {"epoch": 1}}.get(event, {})
            if driven.send(**changes):
                assert event == "good"
                accepted = driven.clock.time
        if look and driven.guard.twist() != STOP:
            assert driven.clock.time - accepted < 0.25
