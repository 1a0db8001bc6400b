"""A door that has slid open stays where the laser sees it."""

import numpy as np
import pytest

from sim.maze import Maze, MazeDoor, Start
from sim.simulation import Simulation
from transport.messages import STOP, Command, Pose, Twist


@pytest.mark.parametrize("length", [1.0, 1.1972, 1.1985])
def test_beside_the_end_of_an_open_door_nothing_is_touched(length):
    door = MazeDoor("front", ((1.0, 0.0), (1.0, -length)))
    walls = np.array([(-1.0, 0.0, 1.0, 0.0)])
    simulation = Simulation(Maze("open door", walls, Start(Pose(0.2, -0.5)), doors=(door,)))
    simulation.step(Command(STOP, ring=True))
    for _ in range(100):
        simulation.step(Command())
    for _ in range(round((2 * length - 0.15) / 0.04)):
        simulation.step(Command(Twist(0.0, -0.4)))
    for _ in range(40):
        simulation.step(Command(Twist(0.4)))
    assert simulation.truth().x > 1.5
    assert simulation.verdict().doors_opened == ("front",)
    assert simulation.verdict().contacts == ()
