"""Where a scan begins, which way it turns and how the laser is mounted says nothing about the world."""

from __future__ import annotations

import math
import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hsm.model.registry import Outcome
from perception import Perception
from perception.signals import LIBRARY
from skills.catalogue import library
from skills.chain import MotionChain
from skills.settings import SkillSettings
from skills.surroundings import Surroundings
from tests.perception.scenes import cells, observation_of, scan_of
from transport.description import Laser, RobotDescription
from transport.messages import Command, Pose, Scan, ScanGeometry

EXAMPLES = int(os.environ.get("PERCEPTION_EXAMPLES", "40"))
WALLS = cells(["#######", "#..#..#", "#.##..#", "#.....#", "###.#.#", "#...#.#", "#######"], 1.05)
FREE = [Pose(3.7, -1.55), Pose(3.65, -3.5, 1.6), Pose(4.7, -4.8, -1.5), Pose(1.6, -3.7, 3.0), Pose(2.6, -3.75, 0.1)]
ACTIVITIES = {
    "drive": {},
    "follow_wall": {},
    "rotate": {"angle": math.pi / 2},
    "pass_corner": {},
    "cross_space": {},
    "make_room": {},
}
SKILLS = library(SkillSettings())

seams = st.fixed_dictionaries(
    {
        "beams": st.sampled_from([180, 360, 500, 720, 1000]),
        "all_round": st.booleans(),
        "first": st.floats(0, 1),  # where the circle begins, as a share of it
        "turns": st.integers(-1, 1),
        "mount": st.floats(-math.pi, math.pi),
        "clockwise": st.booleans(),
    }
)


def as_given(scan: Scan, seam: dict, laser: Laser) -> tuple[Scan, Laser]:
    """The same beams from another first one on, seen by a laser that is mounted otherwise."""
    shape, ranges, mount = scan.geometry, scan.ranges, seam["mount"]
    step = shape.angle_increment
    first = round(seam["first"] * (shape.beams - 1)) if seam["all_round"] else 0
    start = shape.angle_min + first * step - mount + seam["turns"] * math.tau
    ranges = np.roll(ranges, -first)
    if seam["clockwise"]:
        start, step, ranges = start + (shape.beams - 1) * step, -step, ranges[::-1]
    turned = ScanGeometry(shape.beams, start, step, shape.range_min, shape.range_max)
    return Scan(scan.stamp, turned, ranges.copy()), laser.model_copy(update={"mount_heading": mount})


def seen(robot: RobotDescription, observations, name: str):
    """What a robot makes of some ticks: its signals, the points near it, and the commands of an activity."""
    perceived, chain = Perception(robot), MotionChain(robot, SkillSettings())
    surroundings = Surroundings(SkillSettings().safety.reach)
    activity = SKILLS.activities[name].factory(**ACTIVITIES[name])
    signals, points, commands = [], [], []
    for observation in observations:
        facts = perceived.facts(observation)
        signals.append(
            {name: signal.function(facts) for name, signal in LIBRARY.signals.items() if not signal.parameters}
        )
        points.append(surroundings.update(facts))
        effect = activity.tick(facts)
        commands.append(chain.shape(Command() if isinstance(effect, Outcome) else effect, facts).twist)
    return signals, points, commands


def assert_same(one, other) -> None:
    for here, there in zip(*(signals for signals, _, _ in (one, other)), strict=True):
        for name, value in here.items():
            assert there[name] == (pytest.approx(value, abs=2e-4) if isinstance(value, float) else value), name
    for here, there in zip(one[1], other[1], strict=True):
        assert here.shape == there.shape
        assert np.abs(here - there).max(initial=0.0) < 1e-4
    for here, there in zip(one[2], other[2], strict=True):
        assert (here.forward, here.left, here.turn) == pytest.approx((there.forward, there.left, there.turn), abs=1e-3)


@given(seams, st.sampled_from(FREE), st.sampled_from(sorted(ACTIVITIES)), st.integers(0, 10**6))
@settings(deadline=None, derandomize=True, max_examples=EXAMPLES)
def test_facts_remembered_points_and_commands_are_the_same(seam, pose, name, seed) -> None:
    step = math.tau / seam["beams"]
    span = math.tau - step if seam["all_round"] else 4.0
    laser = Laser(beams=seam["beams"], angle_min=-span / 2, angle_max=span / 2)
    rng = np.random.default_rng(seed)
    poses = [Pose(pose.x, pose.y, pose.heading + 0.1 * k) for k in range(4)]
    scans = [scan_of(WALLS, where, laser, rng) for where in poses]
    plain = [observation_of(scan, where, k) for k, (scan, where) in enumerate(zip(scans, poses, strict=True))]
    given_ = [as_given(scan, seam, laser) for scan in scans]
    turned = [observation_of(scan, where, k) for k, ((scan, _), where) in enumerate(zip(given_, poses, strict=True))]
    robot, other = RobotDescription(laser=laser), RobotDescription(laser=given_[0][1])
    assert_same(seen(robot, plain, name), seen(other, turned, name))


def test_a_wall_behind_is_not_the_wall_beside() -> None:
    """With a laser that sees all round, the corner is not passed before the robot has driven there."""
    laser = Laser(beams=360, angle_min=0.0, angle_max=math.tau - math.tau / 360)
    robot = RobotDescription(laser=laser)
    # A corridor along x whose right wall ends at x = 0.4; far behind the robot that wall has another gap.
    walls = [(-4, 0.5, 6, 0.5), (-4, -0.5, -2.6, -0.5), (-1.2, -0.5, 0.4, -0.5), (1.4, -0.5, 6, -0.5)]
    walls += [(-4, -0.5, -4, 0.5), (0.4, -0.5, 0.4, -3), (1.4, -0.5, 1.4, -3)]
    _, _, commands = seen(
        robot, [observation_of(scan_of(walls, Pose(), laser), Pose(), k) for k in range(4)], "pass_corner"
    )
    assert commands[-1].forward > 0.3


def test_a_laser_that_sees_all_round_leaves_no_ghosts() -> None:
    laser = Laser(beams=360, angle_min=0.0, angle_max=6.26573)
    facts = Perception(RobotDescription(laser=laser))
    surroundings = Surroundings(1.0)
    near = facts.facts(observation_of(scan_of([(-1, -0.4, 1, -0.4)], Pose(), laser), Pose()))
    assert len(surroundings.update(near)) > 10
    gone = facts.facts(observation_of(scan_of([(-1, 3.0, 1, 3.0)], Pose(), laser), Pose(), 1))
    assert len(surroundings.update(gone)) == 0
