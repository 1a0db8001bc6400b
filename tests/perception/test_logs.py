"""Real laser logs: how well the compass agrees with the mapper's poses, and that everything has a value."""

from __future__ import annotations

import numpy as np
import pytest

from perception import Perception
from tests.perception import carmen
from tests.perception.scenes import observation_of
from tests.perception.test_any_scan import everything

pytestmark = pytest.mark.skipif(not carmen.LOGS.is_dir(), reason="the laser logs are not here")


@pytest.mark.parametrize(("name", "median"), [("intel", 0.69), ("seattle", 0.31)])
def test_the_compass_agrees_with_the_mapper(name, median):
    directions, unknown = [], 0
    for robot, scan, pose in carmen.scans(name):
        compass = Perception(robot).facts(observation_of(scan, pose)).compass
        unknown += not compass.known
        if compass.known:
            directions.append(pose.heading + compass.misalignment)
    assert np.median(carmen.deviations(directions)) <= median
    assert unknown <= 0.02 * len(directions)


def test_every_signal_has_a_value_on_real_scans():
    for number, (robot, scan, pose) in enumerate(carmen.scans("intel")):
        if number % 30 == 0:
            everything(Perception(robot).facts(observation_of(scan, pose)))
