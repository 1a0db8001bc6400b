"""Lost and found: what the map makes of scans that do not fit it, and how a robot finds itself again."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from perception import Perception
from perception.mapping.agreement import Agreement, agreement_of
from perception.mapping.confidence import Confidence, Knowledge
from perception.mapping.frames import between, compose
from perception.mapping.settings import PlaceSettings
from skills.strategies import places
from tests.perception.scenes import NOISE, PICO, cells, scan_of
from transport.messages import Observation, Odometry, Pose, Scan

WALLS = cells(["########", "#......#", "#.####.#", "#.#....#", "#...##.#", "########"])
ROUND = [Pose(4.5, -1.5), Pose(4.5, -6.5), Pose(2.5, -6.5), Pose(2.5, -3.5), Pose(1.5, -3.5), Pose(1.5, -1.5)]

BACK = [Pose(4.4, -5.0), Pose(4.5, -1.5), Pose(1.5, -1.5), Pose(1.5, -3.3)]
CARRIED_TO = Pose(4.4, -5.0, math.atan2(3.5, 0.1))


def way(corners):
    """Poses along a way, 5 cm or some degrees apart; it begins along its first stretch."""
    out = []
    for start, end in pairwise(corners):
        heading = math.atan2(end.y - start.y, end.x - start.x)
        if out:
            turn = math.remainder(heading - out[-1].heading, math.tau)
            out += [Pose(start.x, start.y, out[-1].heading + turn * share) for share in np.linspace(0, 1, 13)[1:]]
        steps = round(math.dist((start.x, start.y), (end.x, end.y)) / 0.05)
        out += [
            Pose(start.x + share * (end.x - start.x), start.y + share * (end.y - start.y), heading)
            for share in np.linspace(0, 1, steps + 1)[bool(out) :]
        ]
    return out


class Driven:
    """A robot that is moved along ways, and carried between them without its wheels turning."""

    def __init__(self):
        self.perception, self.rng = Perception(PICO), np.random.default_rng(5)
        self.tick, self.odometry, self.at, self.first = 0, Pose(), None, None
        self.facts, self.known, self.off, self.events = None, [], [], []

    def drive(self, poses, *, blind=False):
        """Along poses; the first of them is where the robot is put."""
        self.at = poses[0]
        for pose in poses:
            self.odometry = compose(self.odometry, between(self.at, pose))
            self.at = pose
            stamp = self.tick * 100_000_000
            scan = scan_of(WALLS, pose, PICO.laser, self.rng, noise=NOISE, stamp=stamp)
            if blind:
                scan = Scan(stamp, scan.geometry, np.full_like(scan.ranges, np.nan))
            self.facts = self.perception.facts(Observation(stamp, scan, Odometry.at(stamp, self.odometry)))
            self.perception.world.begin_map(self.facts.sweep)
            self.first = self.first or (pose, self.facts.pose)
            off = between(between(self.first[0], pose), between(self.first[1], self.facts.pose))
            self.known.append(places.place_known(self.facts))
            self.events += self.facts.world.events
            self.off.append(math.hypot(off.x, off.y))
            self.tick += 1
        return self


@pytest.fixture(scope="module")
def lost():
    """A robot that has been carried back to its first corridor while it took itself to be at the end of its way."""
    robot = Driven().drive(way(ROUND))
    robot.on_its_way = list(robot.known), max(robot.off)
    space = robot.perception.world.surveyor.free_space
    robot.before = (space.changes, space.belief.copy(), len(robot.perception.world.surveyor.mapper.clouds))
    robot.carried_at = robot.tick
    robot.drive([CARRIED_TO] * 20)
    return robot


def test_on_its_way_the_place_is_known(lost):
    known, off = lost.on_its_way
    assert all(known)
    assert off < 0.03


def test_a_carried_robot_is_lost_within_two_seconds(lost):
    # Every other scan is looked at.
    assert not any(lost.known[lost.carried_at + 1 :])
    assert places.place_lost(lost.facts)
    assert places.place_deviation(lost.facts) == 1000
    assert lost.events == ["lost"]


def test_while_it_doubts_its_place_nothing_enters_the_map(lost):
    changes, belief, keyframes = lost.before
    surveyor = lost.perception.world.surveyor
    assert surveyor.free_space.changes == changes
    assert np.array_equal(surveyor.free_space.belief, belief)
    assert len(surveyor.mapper.clouds) == keyframes


def test_a_lost_robot_finds_itself_once_it_has_moved(lost):
    lost.drive(way(BACK))
    assert lost.known[-1]
    found = next(tick for tick in range(lost.carried_at + 1, lost.tick) if lost.known[tick])
    assert max(lost.off[found:]) < 0.03
    assert all(lost.known[found:])
    assert lost.events == ["lost", "found"]


def test_a_blind_robot_that_is_carried_notices_when_it_sees_again():
    robot = Driven().drive(way(ROUND[:2]))
    robot.drive([robot.at] * 10, blind=True)
    seen = robot.tick
    robot.drive([Pose(3.5, -6.5, 0.4)] * 18)
    assert not any(robot.known[seen + 1 :])
    assert places.place_lost(robot.facts)


def test_a_robot_carried_to_where_all_looks_much_the_same_does_not_take_itself_to_be_there():
    robot = Driven().drive(way(ROUND[:2]))
    carried = robot.tick
    robot.drive([Pose(4.5, -6.1, -math.pi / 2)] * 20)
    assert not any(robot.known[carried + 2 :])
    assert robot.events == ["lost"]


def test_a_door_that_shuts_is_not_a_reason_to_doubt():
    robot = Driven().drive(way(ROUND[:2]))
    surveyor, settings = robot.perception.world.surveyor, PlaceSettings()
    door = [(4.0, -3.0, 5.0, -3.0)]
    pose = Pose(4.5, -1.9, -math.pi / 2)
    scan = scan_of([*WALLS, *door], pose, PICO.laser, np.random.default_rng(0), noise=NOISE)
    sweep = Perception(PICO).facts(Observation(0, scan, Odometry.at(0, pose))).sweep
    here = compose(robot.first[1], between(robot.first[0], pose))
    agreement = agreement_of(surveyor.free_space, sweep, here, settings)
    assert agreement.contradicted > settings.contradicted
    assert agreement.elsewhere == 1.0


def test_a_doubt_that_scans_do_not_settle_ends_as_lost():
    settings = PlaceSettings()
    confidence = Confidence(settings)
    confidence.saw(fits=False)
    for number in range(settings.doubts - 1):
        assert confidence.knowledge is Knowledge.DOUBTFUL
        confidence.saw(fits=bool(number % settings.convincing))
    confidence.saw(fits=False)
    assert confidence.knowledge is Knowledge.LOST


def test_a_doubt_that_is_settled_begins_anew():
    settings = PlaceSettings()
    confidence = Confidence(settings)
    for _ in range(settings.doubts):
        for fits in (False, *(True for _ in range(settings.convincing))):
            confidence.saw(fits=fits)
        assert confidence.knowledge is Knowledge.KNOWN


@pytest.mark.parametrize(("elsewhere", "believed"), [(1.0, True), (0.9, False)])
def test_one_sector_may_look_otherwise_than_the_map_where_the_walls_of_all_others_agree(elsewhere, believed):
    confidence = Confidence(PlaceSettings())
    opening_door = Agreement(334, 0.92, contradicted=0.08, hidden=0.0, elsewhere=elsewhere)
    assert confidence.believes(None, opening_door) == believed


def test_a_doubt_passes_after_some_scans_that_fit():
    confidence = Confidence(PlaceSettings())
    confidence.saw(fits=False)
    assert confidence.knowledge is Knowledge.DOUBTFUL
    for _ in range(PlaceSettings().convincing - 1):
        confidence.saw(fits=True)
        assert confidence.knowledge is Knowledge.DOUBTFUL
    confidence.saw(fits=True)
    assert confidence.knowledge is Knowledge.KNOWN


def test_a_long_way_without_scans_is_a_doubt_and_no_scan_makes_it_less():
    confidence = Confidence(PlaceSettings())
    confidence.saw_nothing(0.05)
    assert confidence.knowledge is Knowledge.KNOWN
    confidence.saw_nothing(0.2)
    assert confidence.knowledge is Knowledge.DOUBTFUL


def test_who_is_lost_stays_so_until_found():
    confidence = Confidence(PlaceSettings())
    for _ in range(PlaceSettings().patience):
        confidence.saw(fits=False)
    assert confidence.knowledge is Knowledge.LOST
    for _ in range(10):
        confidence.saw(fits=True)
    assert confidence.knowledge is Knowledge.LOST
    confidence.found()
    assert confidence.knowledge is Knowledge.KNOWN
