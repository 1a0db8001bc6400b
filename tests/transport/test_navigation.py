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
