"""A goal for the robot's own navigation: what is asked of it, and what is made of its answers, in memory."""

from __future__ import annotations

import struct
import time
from collections.abc import Callable

import pytest
from programs import LIMIT

from transport.bus import Request
from transport.keys import RobotKeys
from transport.memory_bus import MemoryNetwork
from transport.messages import Pose
from transport.navigation import Navigator
from transport.settings import LinkSettings

KEYS = RobotKeys("", LinkSettings(gate=False))
GOAL = Pose(1.0, -2.0, 0.5)
HEADER = b"\x00\x01\x00\x00"


class Navigation:
    """A navigation that answers as it is told to, by the services of an action."""

    def __init__(self, network: MemoryNetwork, status: int | None = 4, *, accepts: bool = True) -> None:
        self.goals: list[bytes] = []
        self.cancelled: list[bytes] = []
        self.waiting: list[Request] = []
        self._status, self._accepts = status, accepts
        self.bus = network.bus()
        for name, serve in (("send_goal", self._goal), ("get_result", self._result), ("cancel_goal", self._cancel)):
            self.bus.serve(f"navigate_to_pose/_action/{name}", serve)
        self._topics = {one: self.bus.publisher(f"navigate_to_pose/_action/{one}") for one in ("feedback", "status")}

    def publish(self, topic: str, payload: bytes) -> None:
        self._topics[topic].put(payload)

    def _goal(self, request: Request) -> None:
        self.goals.append(request.payload)
        request.reply(HEADER + bytes([self._accepts]) + bytes(11))

    def _result(self, request: Request) -> None:
        if self._status is None:
            self.waiting.append(request)
        else:
            request.reply(HEADER + bytes([self._status]))

    def _cancel(self, request: Request) -> None:
        self.cancelled.append(request.payload)
        request.reply(HEADER + bytes(8))


def until(there: Callable[[], object]) -> None:
    deadline = time.monotonic() + LIMIT
    while not there():
        assert time.monotonic() < deadline, "waited too long"
        time.sleep(0.005)


@pytest.fixture
def network() -> MemoryNetwork:
    return MemoryNetwork()


@pytest.fixture
def navigator(network: MemoryNetwork) -> Navigator:
    return Navigator(network.bus(), KEYS, None)


@pytest.mark.parametrize(
    ("status", "state", "reason"),
    [(4, "arrived", ""), (5, "failed", "it was given up"), (6, "failed", "it could not reach the goal")],
)
def test_the_end_of_a_goal_is_told(network, navigator, status, state, reason):
    there = Navigation(network, status)
    navigator.pursue(GOAL)
    until(lambda: navigator.news().state == state)
    assert navigator.news().goal == GOAL
    assert navigator.news().reason == reason
    frame, place = struct.unpack_from("<I4s", there.goals[0], 28), struct.unpack_from("<7d", there.goals[0], 36)
    assert frame == (4, b"map\0")
    assert place[:3] == (1.0, -2.0, 0.0)
    assert place[5:] == pytest.approx((0.2474, 0.9689), abs=1e-4)


def test_a_refused_goal_has_failed(network, navigator):
    Navigation(network, accepts=False)
    navigator.pursue(GOAL)
    until(lambda: navigator.news().state == "failed")
    assert navigator.news().reason == "the navigation refuses the goal"


def test_where_nobody_navigates_that_is_said(navigator):
    navigator.pursue(GOAL)
    until(lambda: navigator.news().state == "missing")


def test_a_goal_that_is_given_up_is_cancelled_by_its_number(network, navigator):
    there = Navigation(network, status=None)
    navigator.pursue(GOAL)
    until(lambda: navigator.news().state == "driving")
    navigator.pursue(GOAL)  # the same one: it continues
    navigator.pursue(None)
    assert navigator.news() is None
    until(lambda: there.cancelled)
    assert len(there.goals) == 1
    assert there.cancelled[0][4:20] == there.goals[0][4:20]


def test_another_goal_takes_the_place_of_the_last_one(network, navigator):
    there = Navigation(network, status=None)
    navigator.pursue(GOAL)
    until(lambda: navigator.news().state == "driving")
    navigator.pursue(Pose(3.0))
    until(lambda: len(there.goals) == 2 and there.cancelled)
    assert there.cancelled[0][4:20] == there.goals[0][4:20] != there.goals[1][4:20]


def test_letting_go_of_the_robot_cancels_before_the_bus_is_closed(network, navigator):
    there = Navigation(network, status=None)
    navigator.pursue(GOAL)
    until(lambda: navigator.news().state == "driving")
    navigator.close()
    assert there.cancelled


def test_a_navigation_that_goes_away_has_failed(network, navigator):
    there = Navigation(network, status=None)
    navigator.pursue(GOAL)
    until(lambda: there.waiting)
    there.bus.close()
    until(lambda: navigator.news().state == "failed")
    assert navigator.news().reason == "the navigation is gone"


def feedback(number: bytes, distance: float, recoveries: int) -> bytes:
    """A message of the topic ``feedback``, byte for byte, in the frame ``map``."""
    pose = struct.pack("<iII4s7d", 0, 0, 4, b"map\0", *(0.0,) * 6, 1.0)
    return HEADER + number + pose + struct.pack("<iIiIhxxf", 5, 0, 3, 0, recoveries, distance)


def statuses(*goals: tuple[bytes, int]) -> bytes:
    """A message of the topic ``status``, byte for byte."""
    body = struct.pack("<I", len(goals))
    for number, status in goals:
        body += number
        body += bytes(-len(body) % 4) + struct.pack("<iIb", 0, 0, status)
    return HEADER + body


def test_feedback_says_what_is_left_and_only_of_this_goal(network, navigator):
    there = Navigation(network, status=None)
    navigator.pursue(GOAL)
    until(lambda: navigator.news().state == "driving")
    assert (navigator.news().distance, navigator.news().recoveries) == (None, 0)
    number = there.goals[0][4:20]
    there.publish("feedback", feedback(number, 2.5, 1))
    assert (navigator.news().distance, navigator.news().recoveries) == (2.5, 1)
    for odd in (feedback(bytes(16), 9.0, 9), feedback(number, 9.0, 9)[:60], b""):
        there.publish("feedback", odd)
        assert (navigator.news().distance, navigator.news().recoveries) == (2.5, 1)
    there.publish("feedback", feedback(number, float("nan"), -3))
    assert (navigator.news().distance, navigator.news().recoveries) == (None, 0)
    assert navigator.news().state == "driving"


@pytest.mark.parametrize(("status", "state"), [(4, "arrived"), (5, "failed"), (6, "failed")])
def test_an_end_that_the_status_says_counts_without_a_result(network, navigator, status, state):
    there = Navigation(network, status=None)
    navigator.pursue(GOAL)
    until(lambda: there.waiting)
    number = there.goals[0][4:20]
    for odd in (statuses((bytes(16), status)), statuses((number, 2)), statuses((number, status))[:12], b""):
        there.publish("status", odd)
        assert navigator.news().state == "driving"
    there.publish("status", statuses((bytes(16), 6), (number, status)))
    assert navigator.news().state == state
    # A result that comes later says nothing else, and nothing that has ended is cancelled.
    there.waiting[0].reply(HEADER + bytes([6]))
    navigator.close()
    assert not there.cancelled
