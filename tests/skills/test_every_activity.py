"""What every activity keeps to, whatever it sees and is asked for: the robot's limits and the outcomes it declares."""

import math
import pkgutil
from dataclasses import dataclass
from importlib import import_module

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import skills
from hsm.model.registry import Outcome
from hsm.model.types import BOOLEAN, INTEGER, Enumeration
from perception import Perception
from skills.activities import align, drive_to
from skills.catalogue import library
from skills.chain import MotionChain
from skills.library import LIBRARY as DECLARED
from skills.settings import SkillSettings
from tests.perception.scenes import observation_of, scan_of
from transport.description import Laser, Limits, RobotDescription
from transport.messages import NANOSECONDS, STOP, Command, DoorReply, Observation, Odometry, Pose, Scan

LIBRARY = library(SkillSettings())
TICKS = 12


def two_wheels(**more):
    """A robot that cannot move sideways."""
    return RobotDescription.model_validate({"base": "differential"} | more)


ROBOTS = (
    RobotDescription(),
    RobotDescription(laser=Laser(beams=180, angle_min=-1.5, angle_max=1.5, range_max=4.0)),
    RobotDescription(limits=Limits(speed=0.2, turn_rate=0.4, acceleration=0.3, turn_acceleration=0.8)),
    RobotDescription(limits=Limits(translation="axis")),
    two_wheels(),
    two_wheels(footprint=((0.1, 0.1), (-0.3, 0.1), (-0.3, -0.1), (0.1, -0.1))),
)
positive = st.floats(0.01, 20)


@dataclass(frozen=True)
class World:
    """What a robot senses in a run, drawn from a seed."""

    seed: int
    scans: str
    odometry: str

    def observations(self, robot):
        """One a tick."""
        rng = np.random.default_rng(self.seed)
        geometry = robot.laser.geometry()
        at, scale = np.zeros(3), {"still": 0.0, "walk": 0.05, "jumps": 2.0, "broken": 0.05}[self.odometry]
        middle = rng.uniform(0.05, 3.0)
        for tick in range(TICKS):
            stamp = round(tick * robot.period * NANOSECONDS)
            ranges = {
                "near": rng.uniform(0.0, 0.5, geometry.beams),
                "anything": rng.uniform(0.0, 12.0, geometry.beams),
                "wall": rng.normal(middle, 0.01, geometry.beams),
                "steps": np.repeat(rng.uniform(0.1, 3.0, 20), math.ceil(geometry.beams / 20))[: geometry.beams],
                "nothing": np.full(geometry.beams, np.inf),
                "unknown": np.full(geometry.beams, np.nan),
                "odd": rng.choice([0.0, -1.0, np.nan, np.inf, -np.inf, 0.2, 1.0, 1e30], geometry.beams),
            }[self.scans]
            at = at + rng.normal(0, 1, 3) * scale
            x, y, heading = at if self.odometry != "broken" or rng.random() < 0.5 else (math.nan, math.inf, math.nan)
            odometry = Odometry(stamp, x, y, math.sin(heading / 2) if math.isfinite(heading) else heading, 1.0)
            door = DoorReply(bool(rng.random() < 0.5)) if rng.random() < 0.3 else None
            yield Observation(stamp, Scan(stamp, geometry, ranges.astype(np.float32)), odometry, door)


worlds = st.builds(
    World,
    st.integers(0, 10_000),
    st.sampled_from(["near", "anything", "wall", "steps", "nothing", "unknown", "odd"]),
    st.sampled_from(["still", "walk", "jumps", "broken"]),
)


def argument(parameter):
    """Values that an activity takes for a parameter."""
    if isinstance(parameter.type, Enumeration):
        return st.sampled_from(list(LIBRARY.enumerations[parameter.type.name]))
    if parameter.type in (BOOLEAN, INTEGER):
        return st.booleans() if parameter.type == BOOLEAN else st.integers(-5, 5)
    return st.one_of(positive, st.sampled_from([1e-6, 1.0, 1e6]))


def within(limits, twist):
    """Whether a twist keeps the limits of speed."""
    speed = twist.speed if limits.translation == "norm" else max(abs(twist.forward), abs(twist.left))
    return speed <= limits.speed + 1e-9 and abs(twist.turn) <= limits.turn_rate + 1e-9


def reachable(limits, before, twist, period):
    """Whether a twist keeps the limits of acceleration."""
    change = math.hypot(twist.forward - before.forward, twist.left - before.left)
    turn = abs(twist.turn - before.turn)
    return change <= limits.acceleration * period + 1e-9 and turn <= limits.turn_acceleration * period + 1e-9


def sent(name, data, world, robot):
    """What a base is sent by an activity with arguments drawn, in a world."""
    declared = LIBRARY.activities[name]
    activity = declared.factory(*(data.draw(argument(parameter)) for parameter in declared.parameters))
    perception, chain = Perception(robot), MotionChain(robot, SkillSettings())
    for observation in world.observations(robot):
        facts = perception.facts(observation)
        effect = activity.tick(facts)
        if isinstance(effect, Outcome):
            assert effect.name in declared.outcomes
            effect = Command()
        yield chain.shape(effect, facts).twist


@pytest.mark.parametrize("name", LIBRARY.activities)
@given(st.data(), worlds, st.sampled_from(ROBOTS))
@settings(max_examples=12, deadline=None, derandomize=True)
def test_no_command_breaks_the_limits(name, data, world, robot):
    before = STOP
    for twist in sent(name, data, world, robot):
        assert within(robot.limits, twist), twist
        assert reachable(robot.limits, before, twist, robot.period), (before, twist)
        before = twist


sizes = st.floats(0.05, 0.6)
robots_on_two_wheels = st.builds(
    lambda front, rear, half, track, speed: two_wheels(
        footprint=((front, half), (-rear, half), (-rear, -half), (front, -half)),
        base={"kind": "differential", "track": track, "wheel_speed": speed},
    ),
    sizes, sizes, sizes, sizes, sizes,
)  # fmt: skip


@pytest.mark.parametrize("name", LIBRARY.activities)
@given(st.data(), worlds, robots_on_two_wheels)
@settings(max_examples=6, deadline=None, derandomize=True)
def test_a_robot_on_two_wheels_is_never_sent_sideways_nor_a_wheel_too_fast(name, data, world, robot):
    for twist in sent(name, data, world, robot):
        assert twist.left == 0.0
        rims = twist.forward - twist.turn * robot.base.track / 2, twist.forward + twist.turn * robot.base.track / 2
        assert max(map(abs, rims)) <= robot.base.wheel_speed * (1 + 1e-9)


@pytest.mark.parametrize("name", LIBRARY.activities)
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_what_makes_no_sense_is_refused_with_the_argument_s_name(name, value):
    for parameter in LIBRARY.activities[name].parameters:
        if isinstance(parameter.type, Enumeration) or (value < 0 and parameter.name in SIGNED):
            continue
        required = {one.name: 1.0 for one in LIBRARY.activities[name].parameters if one.required}
        with pytest.raises(ValueError, match=f"`{parameter.name}` must be"):
            LIBRARY.activities[name].factory(**(required | {parameter.name: value}))


SIGNED = ("angle", "bearing", "left", "x", "y", "heading")
"""Parameters that may be negative."""


def test_everything_that_a_skill_declares_is_in_the_catalogue():
    for module in pkgutil.walk_packages(skills.__path__, "skills."):
        import_module(module.name)
    assert set(DECLARED.activities) == set(LIBRARY.activities)
    assert set(DECLARED.signals) == set(LIBRARY.signals)
    assert set(DECLARED.actions) == set(LIBRARY.actions)


HELD = sorted(name for name, one in LIBRARY.activities.items() if one.outcomes and name != "ring")
"""All that can end by themselves; the bell's answer is another's."""
SCENES = {
    "corridor": [(-4, 0.5, 4, 0.5), (-4, -0.5, 4, -0.5)],
    "dead end": [(-4, 0.5, 0.6, 0.5), (-4, -0.5, 0.6, -0.5), (0.6, -0.5, 0.6, 0.5)],
    "opening": [
        (-4, 0.5, 4, 0.5),
        (-4, -0.5, 0.3, -0.5),
        (0.3, -0.5, 0.3, -3),
        (1.3, -3, 1.3, -0.5),
        (1.3, -0.5, 4, -0.5),
    ],
    "hall": [(-4, 3, 4, 3), (-4, -3, 4, -3), (4, -3, 4, 3)],
}


@pytest.mark.parametrize("heading", [0.0, 10.0, -44.0])
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("name", HELD)
def test_whatever_holds_the_base_every_activity_ends_within_twice_its_patience(name, scene, heading):
    declared, robot = LIBRARY.activities[name], RobotDescription()
    required = {one.name: math.pi / 2 if one.name == "angle" else 1.0 for one in declared.parameters if one.required}
    activity, perception = declared.factory(**required), Perception(robot)
    pose = Pose(heading=math.radians(heading))
    scan = scan_of(SCENES[scene], pose, robot.laser)
    patience = max(SkillSettings().rotate.patience, drive_to.PATIENCE, align.PATIENCE) if name != "rotate" else 4.0
    for tick in range(round(2 * patience / robot.period) + 1):
        effect = activity.tick(perception.facts(observation_of(scan, pose, round(tick * robot.period * NANOSECONDS))))
        if isinstance(effect, Outcome):
            assert effect.name in declared.outcomes
            return
    pytest.fail(f"{name} has no outcome after {2 * patience} s")


@pytest.mark.parametrize("angle", [math.pi / 2, -math.pi / 2, math.pi, 0.0])
def test_a_turn_that_goes_to_and_fro_ends_too(angle):
    """Something lets the robot turn a little each way, and no farther."""
    activity, perception = LIBRARY.activities["rotate"].factory(angle), Perception(RobotDescription())
    turned, limit, seen = 0.0, 0.3, 0
    for tick in range(600):
        pose = Pose(heading=math.radians(10) + turned)
        observation = observation_of(scan_of(SCENES["hall"], pose), pose, round(0.1 * tick * NANOSECONDS))
        effect = activity.tick(perception.facts(observation))
        if isinstance(effect, Outcome):
            break
        seen += 1
        turned = min(max(turned + 0.1 * effect.twist.turn, -0.05), limit)
    assert isinstance(effect, Outcome)
    assert seen < 350
