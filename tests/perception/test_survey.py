"""The world model with a map: its pose, its frame, and what becomes of it where odometry or the laser fail."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from perception import Perception
from perception.mapping.frames import between, compose
from tests.perception.scenes import NOISE, PICO, cells, scan_of
from transport.messages import Observation, Odometry, Pose, Scan

WALLS = cells(["#######", "#.....#", "###.#.#", "#...#.#", "#######"])
WAY = [Pose(1.5, -1.5, 0.0), Pose(1.5, -3.5, 0.0), Pose(3.5, -3.5, 0.0), Pose(3.5, -5.5, 0.0)]


def way():
    """Poses along a way through the maze, 4 cm or some degrees apart."""
    out = []
    for start, end in pairwise(WAY):
        heading = math.atan2(end.y - start.y, end.x - start.x)
        if out:
            turn = math.remainder(heading - out[-1].heading, math.tau)
            out += [Pose(start.x, start.y, out[-1].heading + turn * share) for share in np.linspace(0, 1, 13)[1:]]
        steps = round(math.dist((start.x, start.y), (end.x, end.y)) / 0.04)
        out += [
            Pose(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y), heading)
            for share in np.linspace(0, 1, steps + 1)[bool(out) :]
        ]
    return out


def drive(poses, *, odometry=lambda number, pose: pose, blind=(), walls=lambda number: WALLS):
    """What the world model makes of a way: its errors in the first pose's frame."""
    perception, off, rng = Perception(PICO), [], np.random.default_rng(3)
    base = None
    for number, pose in enumerate(poses):
        stamp = number * 100_000_000
        scan = scan_of(walls(number), pose, PICO.laser, rng, noise=NOISE, stamp=stamp)
        if number in blind:
            scan = Scan(stamp, scan.geometry, np.full_like(scan.ranges, np.nan))
        facts = perception.facts(Observation(stamp, scan, Odometry.at(stamp, odometry(number, pose))))
        perception.world.begin_map(facts.sweep)
        base = base or (pose, facts.pose)
        off.append(between(between(base[0], pose), between(base[1], facts.pose)))
    return perception.world, off


def largest(off):
    return max(math.hypot(one.x, one.y) for one in off), max(abs(one.heading) for one in off)


def test_the_pose_is_the_maps():
    world, off = drive(way())
    assert largest(off)[0] < 0.015
    assert largest(off)[1] < math.radians(0.3)
    assert world.pose == world.surveyor.pose


def test_a_wheel_that_miscounts_does_not_matter():
    def miscounted(number, pose):
        return Pose(1.1 * pose.x, 1.1 * pose.y, pose.heading + 0.002 * number)

    _, off = drive(way(), odometry=miscounted)
    assert largest(off)[0] < 0.03


def test_an_odometry_that_begins_anew_is_no_movement():
    def restarted(number, pose):
        return pose if number < 40 else compose(Pose(7.0, -3.0, 2.0), pose)

    world, off = drive(way(), odometry=restarted)
    assert world.restarts == 1
    assert largest(off[41:])[0] < 0.03


def test_a_jump_of_odometry_is_noticed_in_the_next_scan():
    def jumped(number, pose):
        return pose if number < 60 else compose(Pose(0.3, 0.1, math.radians(10)), pose)

    _, off = drive(way(), odometry=jumped)
    assert largest(off[63:])[0] < 0.03


def test_without_a_map_there_is_none():
    perception = Perception(PICO)
    perception.facts(Observation(0, scan_of(WALLS, WAY[0]), Odometry.at(0, WAY[0])))
    assert perception.world.surveyor is None


def test_a_blind_robot_follows_odometry():
    _, off = drive(way(), blind=range(30, 50))
    assert largest(off)[0] < 0.03


def test_a_door_that_opens_at_the_end_of_a_bare_corridor_does_not_hold_the_robot_back():
    # While it is shut only the corridor's sides are known, which leave free how far along it the robot is.
    room, door = cells(["#########", "#...#...#", "#.......#", "#...#...#", "#########"]), (4.0, -2.0, 4.0, -3.0)
    corridor = [(1.0, -2.0, 4.0, -2.0), (1.0, -3.0, 4.0, -3.0)]
    inside = [*room, *corridor]
    stand, through = [Pose(3.2, -2.5, 0.0)] * 10, [Pose(3.2 + 0.05 * step, -2.5, 0.0) for step in range(40)]
    _, off = drive(
        [*stand, *stand, *through],
        odometry=lambda _, pose: Pose(1.03 * pose.x, pose.y, pose.heading),
        walls=lambda number: inside if number >= 10 else [*inside, door],
    )
    assert largest(off)[0] < 0.02
