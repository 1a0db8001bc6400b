"""What the tests of the simulator share."""

import pytest
from hypothesis import settings

from sim.formats import read_maze
from sim.library import shipped_mazes

settings.register_profile("ci", max_examples=40, deadline=None, derandomize=True)
settings.load_profile("ci")


@pytest.fixture(scope="session")
def final():
    return read_maze(shipped_mazes()["final_2015"])
