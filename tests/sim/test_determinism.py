"""One seed, one run: over processes, after a reset, with everything on that moves or goes wrong."""

import hashlib
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

from sim.faults import CommandLate, OdometryJump
from sim.generate import Recipe, generate
from sim.settings import LaserNoise, OdometryNoise, SimulatorSettings
from sim.simulation import Simulation
from transport.description import RobotDescription
from transport.messages import Command, Twist

SETTINGS = SimulatorSettings(
    noise=LaserNoise(model="gaussian", dropout=0.01),
    odometry=OdometryNoise(slip=0.05),
    faults=(OdometryJump(at=2.0, by=(0.1, 0.0, 0.2)), CommandLate(at=3.0, lasts=1.0)),
)


def digest(simulation, ticks=120):
    """A fingerprint of all that two robots observed while they drove about and touched what they met."""
    seen = hashlib.sha256()
    for tick in range(ticks):
        for name in simulation.names:
            observation = simulation.observations[name]
            seen.update(observation.scan.ranges.tobytes())
            seen.update(repr((observation.odometry, observation.door, simulation.verdict(name))).encode())
        turn = 0.6 if tick % 40 < 20 else -0.4
        simulation.step({"one": Command(Twist(0.3, 0.0, turn), ring=tick == 7), "two": Command(Twist(0.1, 0.2, turn))})
    return seen.hexdigest()


def new(seed=11):
    maze = generate(Recipe(columns=6, rows=6, doors=1, skew=1.0), 4)
    first = maze.start
    maze = replace(maze, others=(replace(first, pose=replace(first.pose, x=first.pose.x + 0.3)),))
    robots = [RobotDescription(name="one"), RobotDescription(name="two")]
    return Simulation(maze, robots, seed, SETTINGS)


def test_two_runs_of_one_seed_are_equal_and_of_two_seeds_are_not():
    assert digest(new()) == digest(new())
    assert digest(new()) != digest(new(12))


def test_a_reset_leaves_nothing_of_the_run_before():
    simulation = new()
    first = digest(simulation)
    simulation.reset()
    assert digest(simulation) == first
    simulation.reset(12)
    assert digest(simulation) == digest(new(12))


def test_another_process_sees_the_same_bytes():
    here = str(Path(__file__).parent)
    program = f"import sys; sys.path.insert(0, {here!r}); import test_determinism as t; print(t.digest(t.new()))"
    other = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=120)
    assert other.stdout.strip() == digest(new())
