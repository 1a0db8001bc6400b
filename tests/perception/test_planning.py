"""The grid of free space and the ways over it."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from perception.mapping import MappingSettings
from perception.mapping.free_space import FreeSpace
from perception.mapping.planning import plan_from, ways_outward
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


@pytest.mark.parametrize(
    "laser",
    [
        PICO.laser,
        Laser(beams=36, angle_min=-math.pi, angle_max=math.pi * 17 / 18, range_max=3.5),
        Laser(beams=5, angle_min=0.5, angle_max=2.5, mount_x=0.2, mount_y=-0.1, mount_heading=2.0),
    ],
    ids=["PICO's", "coarse", "askew"],
)
def test_no_free_cell_is_left_out_to_save_time(laser, monkeypatch):
    part = seen_from(WAY, laser=laser)

    def everything(space, *_):
        columns, rows = space.belief.shape
        return (0, 0), (columns - 1, rows - 1)

    monkeypatch.setattr(FreeSpace, "_box", everything)
    whole = seen_from(WAY, laser=laser)
    assert np.count_nonzero(whole.belief) > 50
    np.testing.assert_array_equal(part.belief, whole.belief)


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


def room_with_gap(gap):
    """A grid that holds the walls of a room of 4 m by 4 m, with a gap of so many cells in the wall to the right."""
    belief = np.zeros((60, 60), dtype=np.int8)
    belief[10:51, [10, 50]] = belief[[10, 50], 10:51] = -4
    belief[50, 40 - gap : 40] = 0
    belief[15:20, 15:20] = 4
    return FreeSpace(SETTINGS.free_space, belief=belief)


def outward_from(space, x, y, radius=PICO.radius):
    room = plan_from(space, (1.75, 1.75), radius, SETTINGS.plan).room
    return ways_outward(space, room, SETTINGS.plan.room * radius).length(space.cell_of((x, y)))


@pytest.mark.parametrize("radius", [PICO.radius, 0.1], ids=["pico", "burger"])
def test_the_way_outward_leads_through_what_has_not_been_seen_and_through_no_wall(radius):
    through_the_gap = math.dist((1.75, 1.75), (5.0, 3.5))
    length = outward_from(room_with_gap(10), 1.75, 1.75, radius)
    assert through_the_gap <= length <= 1.15 * through_the_gap + 0.6
    assert outward_from(room_with_gap(10), 4.5, 3.5, radius) < 1.5


def test_a_gap_too_narrow_for_the_robot_does_not_lead_outward():
    shut, narrow = (outward_from(room_with_gap(gap), 1.75, 1.75) for gap in (0, 2))
    assert narrow == shut
    assert shut > outward_from(room_with_gap(10), 1.75, 1.75)


def test_beyond_all_walls_seen_the_robot_is_outside():
    assert outward_from(room_with_gap(0), 5.9, 0.1) == 0.0
    assert outward_from(room_with_gap(0), -20.0, 30.0) == 0.0


def test_the_rim_of_what_has_been_seen_has_a_way_outward():
    found = plan_from(seen_from(WAY[:1]), (1.5, -1.5), PICO.radius, SETTINGS.plan).frontiers()
    assert found
    # The seen corridors are 5 m by 5 m.
    assert all(0.0 < one.outward < 5.0 for one in found)
