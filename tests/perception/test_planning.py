"""The grid of free space and the ways over it."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from perception.mapping import MappingSettings
from perception.mapping.free_space import FreeSpace
from perception.mapping.planning import plan_from
from perception.sweep import ScanPoints
from tests.perception.scenes import PICO, cells, scan_of
from transport.description import Laser
from transport.messages import Pose

SETTINGS = MappingSettings()
# A ring of corridors with a dead end; the start is at its lower left.
RING = cells(["######", "#...##", "#.#..#", "#...##", "######"])
WAY = [Pose(1.5, -1.5, 0.0), Pose(2.5, -1.5, 0.0), Pose(3.5, -1.5, -math.pi / 2), Pose(3.5, -3.5, math.pi)]


def seen_from(poses, walls=RING, laser: Laser = PICO.laser, times=3):
    space = FreeSpace(SETTINGS.free_space)
    for number, pose in enumerate(poses):
        for again in range(times):
            rng = np.random.default_rng(10 * number + again)
            space.see(ScanPoints.of(scan_of(walls, pose, laser, rng)), pose)
    return space


def state(space, x, y):
    return int(np.sign(space.belief[space.cell_of((x, y))]))


def test_cells_are_free_taken_or_unknown():
    space = seen_from(WAY[:1])
    assert state(space, 2.0, -1.5) == 1
    assert state(space, 1.5, -1.01) == -1 or state(space, 1.5, -0.99) == -1
    assert state(space, 3.5, -3.5) == 0


def test_a_cell_and_its_middle_belong_together():
    space = seen_from(WAY[:1])
    for cell in [(0, 0), (7, 30)]:
        assert space.cell_of(space.middle(cell)) == cell


def test_what_opens_becomes_free_and_what_shuts_is_taken():
    shut = [*RING, (2.5, -1.0, 2.5, -2.0)]
    space = seen_from(WAY[:1], shut, times=5)
    assert state(space, 2.55, -1.5) <= 0
    for again in range(5):
        space.see(ScanPoints.of(scan_of(RING, WAY[0], PICO.laser, np.random.default_rng(again))), WAY[0])
    assert state(space, 2.55, -1.5) == 1
    for again in range(5):
        space.see(ScanPoints.of(scan_of(shut, WAY[0], PICO.laser, np.random.default_rng(again))), WAY[0])
    assert min(state(space, 2.45, -1.5), state(space, 2.55, -1.5)) == -1


def test_the_grid_grows_and_keeps_what_it_holds():
    space = seen_from(WAY[:1])
    before = state(space, 2.0, -1.5)
    far = Pose(-30.0, 20.0, 0.0)
    space.see(ScanPoints.of(scan_of([(-31, 25, -28, 25)], far)), far)
    assert state(space, 2.0, -1.5) == before
    assert state(space, -30.0, 20.0) == 1


def test_a_way_goes_round_the_corners_and_keeps_off_the_walls():
    space = seen_from(WAY)
    plan = plan_from(space, (1.5, -1.5), PICO.radius, SETTINGS.plan)
    way = plan.way_to(space.cell_of((3.5, -3.5)))
    assert math.dist(way[0], (1.5, -1.5)) < 0.1
    assert math.dist(way[-1], (3.5, -3.5)) < 0.1
    steps = [math.dist(one, other) for one, other in pairwise(way)]
    assert max(steps) < 0.15
    assert 3.2 < sum(steps) < 4.2
    corner = min(math.dist(place, (3.0, -2.0)) for place in way)
    assert corner > 0.25


def test_there_is_no_way_through_walls():
    space = seen_from(WAY[:1])
    plan = plan_from(space, (1.5, -1.5), PICO.radius, SETTINGS.plan)
    assert plan.way_to(space.cell_of((1.5, -0.5))) == ()
    assert plan.way_to((-1, 5)) == ()
    assert plan.nearest((1.5, 3.0), 0.4) is None


def test_a_robot_beside_a_wall_has_ways_all_the_same():
    space = seen_from(WAY)
    plan = plan_from(space, (1.5, -1.12), PICO.radius, SETTINGS.plan)
    assert plan.way_to(space.cell_of((3.5, -1.5)))


def test_what_has_been_seen_ends_where_a_corridor_turns_off():
    space = seen_from(WAY[:1])
    found = plan_from(space, (1.5, -1.5), PICO.radius, SETTINGS.plan).frontiers()
    assert found
    assert all(state(space, *frontier.place) == 1 for frontier in found)
    # From the lower left the robot sees along one side of the ring, not round its corners.
    assert any(math.dist(frontier.beyond, (3.4, -2.2)) < 1.0 for frontier in found)


def test_where_all_has_been_seen_nothing_is_left():
    ring = cells(["#####", "#...#", "#####"])
    poses = [Pose(1.5, -y, heading) for y in (1.5, 2.5, 3.5) for heading in (-math.pi / 2, math.pi / 2)]
    found = plan_from(seen_from(poses, ring), (1.5, -2.5), PICO.radius, SETTINGS.plan).frontiers()
    assert found == []


@pytest.mark.parametrize("laser", [Laser(beams=180, range_max=3.5), Laser(beams=1500)], ids=["180", "1500"])
def test_other_lasers_see_the_same_corridor(laser):
    space = seen_from(WAY, laser=laser)
    way = plan_from(space, (1.5, -1.5), PICO.radius, SETTINGS.plan).way_to(space.cell_of((3.5, -3.5)))
    assert way
