import math

import numpy as np
import pytest

from skills.passage import passage_of
from skills.settings import PassageSettings
from transport.description import RobotDescription

ROBOT = RobotDescription()


def line(start, end):
    count = int(math.dist(start, end) / 0.01) + 1
    return np.column_stack([np.linspace(start[0], end[0], count), np.linspace(start[1], end[1], count)])


def test_a_corridor_bounds_the_passage_at_both_sides():
    points = np.concatenate([line((-1, 0.6), (2, 0.6)), line((-1, -0.3), (2, -0.3))])
    passage = passage_of(points, ROBOT, 0.5, PassageSettings())
    assert (passage.left, passage.right) == pytest.approx((0.6, -0.3))
    assert passage.ahead == math.inf


def test_a_wall_across_the_corridor_ends_it_and_the_bounds_are_those_before_it():
    points = np.concatenate([line((-1, 0.6), (0.4, 0.6)), line((-1, -0.5), (0.4, -0.5)), line((0.4, -0.5), (0.4, 0.6))])
    passage = passage_of(points, ROBOT, 0.5, PassageSettings())
    assert passage.ahead == pytest.approx(0.4)
    assert (passage.left, passage.right) == pytest.approx((0.6, -0.5))


def test_where_the_wall_steps_in_the_passage_is_the_gap_that_is_left():
    step = [line((-1, -0.45), (0.3, -0.45)), line((0.3, -0.45), (0.3, -0.1)), line((0.3, -0.1), (2, -0.1))]
    points = np.concatenate([*step, line((-1, 0.8), (2, 0.8))])
    passage = passage_of(points, ROBOT, 0.5, PassageSettings())
    assert (passage.left, passage.right) == pytest.approx((0.8, -0.1))


def test_open_space_has_no_bounds():
    passage = passage_of(np.empty((0, 2)), ROBOT, 0.5, PassageSettings())
    assert (passage.ahead, passage.left, passage.right) == (math.inf, math.inf, -math.inf)


def test_a_wall_ahead_does_not_send_the_robot_to_its_end():
    points = np.concatenate([line((0.45, -0.9), (0.45, 0.5)), line((-1, 0.5), (0.45, 0.5))])
    passage = passage_of(points, ROBOT, 0.5, PassageSettings())
    assert passage.right == -math.inf
    assert passage.left == pytest.approx(0.5)
