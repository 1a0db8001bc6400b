"""What the tests of the simulator share."""

import os

import pytest
from hypothesis import settings

from sim.formats import read_maze
from sim.shipped import shipped_mazes
from transport.description import RobotDescription

settings.register_profile("ci", max_examples=40, deadline=None, derandomize=True)
settings.register_profile("long", max_examples=5000, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "ci"))


@pytest.fixture(scope="session")
def final():
    return read_maze(shipped_mazes()["final_2015"], radius=RobotDescription().radius)
