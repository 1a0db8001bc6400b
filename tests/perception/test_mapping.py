"""The map: matching scans, the graph of their poses, loops; with exact oracles where there are any."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import least_squares

from perception.mapping import Cloud, Mapper, MappingSettings, cloud_of
from perception.mapping.frames import between, compose
from perception.mapping.graph import Link, PoseGraph
from perception.mapping.information import Symmetric
from perception.mapping.matching import Reference, matched
from perception.mapping.searching import BlurredWalls, Window, search
from perception.mapping.uncertainty import Paths, certainties
from perception.sweep import ScanPoints
from tests.perception import carmen
from tests.perception.scenes import PICO, cells, corridor, polyline, scan_of
from transport.description import Laser
from transport.messages import Pose

SETTINGS = MappingSettings()
ROOM = cells(["#######", "#.....#", "###.#.#", "#...#.#", "#######"])
HERE = Pose(1.4, -3.5, 0.2)
MATRIX = st.lists(st.floats(-2, 2), min_size=9, max_size=9)


def rows(matrix: Symmetric):
    a = matrix
    return np.array([[a.xx, a.xy, a.xt], [a.xy, a.yy, a.yt], [a.xt, a.yt, a.tt]])


def positive(numbers) -> Symmetric:
    root = np.array(numbers).reshape(3, 3)
    full = root @ root.T + 0.1 * np.eye(3)
    return Symmetric(full[0, 0], full[0, 1], full[0, 2], full[1, 1], full[1, 2], full[2, 2])


def cloud_at(walls, pose, seed=0, laser: Laser = PICO.laser):
    return cloud_of(ScanPoints.of(scan_of(walls, pose, laser, np.random.default_rng(seed))), SETTINGS.cloud)


@given(MATRIX, st.floats(-4, 4))
def test_plain_numbers_do_what_matrices_do(numbers, heading):
    matrix = positive(numbers)
    turn = np.array([[math.cos(heading), -math.sin(heading), 0], [math.sin(heading), math.cos(heading), 0], [0, 0, 1]])
    assert np.allclose(rows(matrix.inverse()) @ rows(matrix), np.eye(3), atol=1e-7)
    assert np.allclose(rows(matrix.turned(heading)), turn @ rows(matrix) @ turn.T)
    limited = np.linalg.inv(np.linalg.inv(rows(matrix)) + np.diag([0.04, 0.04, 0.01]))
    assert np.allclose(rows(matrix.limited(0.2, 2.0)), limited, atol=1e-7)


def test_a_cloud_lies_on_the_walls_and_looks_at_the_sensor():
    cloud = cloud_at(corridor(1.0), Pose(0, 0.1, 0.1))
    seen = cloud.seen_from(Pose(0, 0.1, 0.1))
    x, y = seen.points
    assert len(cloud) < 250
    assert np.abs(np.abs(y) - 0.5).max() < 0.01
    assert np.all(seen.normals[1] * np.sign(y) < -0.9)
    far = np.abs(x) > 2
    assert cloud.variances[far].mean() < cloud.variances[np.abs(x) < 0.5].mean()


@pytest.mark.parametrize("laser", [PICO.laser, Laser(beams=180, angle_min=-1.57, angle_max=1.57)], ids=["1000", "180"])
def test_a_scan_is_moved_onto_what_was_seen_before(laser):
    reference = Reference(cloud_at(ROOM, HERE, laser=laser))
    for seed, step in enumerate([Pose(0.1, 0.02, 0.05), Pose(-0.05, 0.05, -0.15), Pose(0.15, 0, 0)]):
        found = matched(cloud_at(ROOM, compose(HERE, step), seed + 1, laser), reference, Pose(), None, SETTINGS.match)
        off = between(step, found.pose)
        assert math.hypot(off.x, off.y) < 0.01
        assert abs(off.heading) < 0.005
        assert found.information.square(off.x, off.y, off.heading) < 16


def test_along_a_bare_corridor_odometry_decides_and_the_match_says_that_it_knows_nothing():
    walls = polyline((-30, -0.5), (30, -0.5)) + polyline((-30, 0.5), (30, 0.5))
    reference = Reference(cloud_at(walls, Pose()))
    prior = Symmetric.diagonal(1 / 0.05**2, 1 / 0.05**2, 1 / 0.05**2)
    found = matched(cloud_at(walls, Pose(0.3, 0.03, 0.02), 1), reference, Pose(0.25, 0, 0), prior, SETTINGS.match)
    assert found.pose.x == pytest.approx(0.25, abs=0.03)
    assert found.pose.y == pytest.approx(0.03, abs=0.005)
    covariance = found.information.inverse()
    assert math.sqrt(covariance.xx) > 0.02
    assert math.sqrt(covariance.yy) < 0.01


def test_a_scan_of_nowhere_is_no_match():
    reference = Reference(cloud_at(ROOM, HERE))
    empty = cloud_at([], Pose())
    assert matched(empty, reference, Pose(), None, SETTINGS.match) is None


def test_the_wide_search_finds_what_a_guess_has_lost():
    reference = cloud_at(ROOM, HERE)
    truth = Pose(0.4, -0.2, 1.4)
    found = search(
        cloud_at(ROOM, compose(HERE, truth), 1),
        BlurredWalls.of(reference, SETTINGS.search),
        Pose(),
        Window(1.0, math.pi),
    )
    off = between(truth, found.pose)
    assert math.hypot(off.x, off.y) < 0.15
    assert abs(off.heading) < 0.1
    assert found.rival < SETTINGS.search.distinct * found.score


def test_the_wide_search_says_that_two_places_look_alike():
    walls = polyline((-30, -0.5), (30, -0.5)) + polyline((-30, 0.5), (30, 0.5))
    near = Laser(range_max=3.0)
    seen = [cloud_at(walls, Pose(x, 0, 0), laser=near).seen_from(Pose(x, 0, 0)) for x in (0, 1, 2, 3)]
    grid = BlurredWalls.of(Cloud.joined(seen), SETTINGS.search)
    found = search(cloud_at(walls, Pose(), 1, near), grid, Pose(), Window(3.0, 0.1))
    assert found.rival >= SETTINGS.search.distinct * found.score


def ring(count, seed):
    """A graph that goes twice around a ring with noisy steps, and its true poses."""
    rng = np.random.default_rng(seed)
    step = Pose(1.0, 0.0, math.tau / count)
    known = Symmetric.diagonal(1 / 0.05**2, 1 / 0.03**2, 1 / 0.02**2)
    graph, truth = PoseGraph(SETTINGS.graph), [Pose()]
    graph.add(Pose(), Symmetric())
    for _ in range(2 * count - 1):
        off = Pose(*(rng.normal(0, (0.05, 0.03, 0.02))).tolist())
        graph.add(compose(step, off), known)
        truth.append(compose(truth[-1], step))
    for number in range(0, count, 3):
        off = Pose(*(rng.normal(0, (0.02, 0.02, 0.01))).tolist())
        seen = compose(between(truth[number], truth[number + count]), off)
        graph.close(Link(number, number + count, seen, Symmetric.diagonal(1 / 0.02**2, 1 / 0.02**2, 1 / 0.01**2)))
    return graph, truth


def finished(work):
    """What a piece of work returns once it is done."""
    while True:
        try:
            next(work)
        except StopIteration as end:
            return end.value


def test_the_graph_is_solved_as_by_dense_least_squares():
    graph, _ = ring(10, 1)

    def residuals(flat):
        poses = [Pose(), *(Pose(*one) for one in flat.reshape(-1, 3))]
        out = []
        for link in graph.steps + graph.loops:
            off = between(compose(poses[link.first], link.measured), poses[link.second])
            root = np.sqrt([link.information.xx, link.information.yy, link.information.tt])
            out.extend(root * [off.x, off.y, off.heading])
        return np.array(out)

    first = np.array([[pose.x, pose.y, pose.heading] for pose in graph.poses[1:]])
    best = least_squares(residuals, first.ravel()).x.reshape(-1, 3)
    graph.settings = graph.settings.model_copy(update={"doubtful": 1e9, "settled": 1e-6, "tolerance": 1e-6})
    finished(graph.optimise())
    ours = np.array([[pose.x, pose.y] for pose in graph.poses[1:]])
    assert np.abs(ours - best[:, :2]).max() < 1e-3


def test_one_false_loop_is_outvoted():
    graph, truth = ring(20, 2)
    graph.close(Link(3, 33, Pose(0, 0, 0), Symmetric.diagonal(1e4, 1e4, 1e4)))
    finished(graph.optimise())
    assert max(math.dist((a.x, a.y), (b.x, b.y)) for a, b in zip(graph.poses, truth, strict=True)) < 0.5
    assert graph.deviations()[-1] > 100


def test_poses_that_come_while_the_graph_is_solved_are_carried_along():
    graph, _ = ring(10, 3)
    work = graph.optimise()
    next(work)
    number = graph.add(Pose(1, 0, 0), Symmetric.diagonal(100, 100, 100))
    finished(work)
    step = between(graph.poses[number - 1], graph.poses[number])
    assert (step.x, step.y, step.heading) == pytest.approx((1, 0, 0), abs=1e-6)


def test_the_uncertainty_of_a_path_is_that_of_its_links():
    graph, _ = ring(10, 4)
    graph.loops.clear()
    paths = Paths()
    for link in graph.steps:
        paths.add(link)
    found = finished(paths.from_pose(graph, 12, 1.0))
    at = graph.poses[12]
    expected = np.zeros((3, 3))
    for link in graph.steps[4:12]:
        end = graph.poses[link.second]
        turn = np.array(
            [
                [math.cos(end.heading), -math.sin(end.heading), -(at.y - end.y)],
                [math.sin(end.heading), math.cos(end.heading), at.x - end.x],
                [0, 0, 1],
            ]
        )
        expected += turn @ np.linalg.inv(rows(link.information)) @ turn.T
    assert np.allclose(rows(found[4].at(at)), expected)


def test_scans_with_keyframes_in_common_do_not_err_independently():
    graph, _ = ring(10, 4)
    paths = Paths()
    for link in (*graph.steps, *graph.loops):
        paths.add(link)
    bound = finished(paths.from_pose(graph, 0, 1.0))
    first, *others = certainties(graph, paths, shared=15)
    assert not any(first)
    for number, found in enumerate(others, 1):
        assert np.allclose(15 * rows(found), rows(bound[number].at(graph.poses[number])))


def drive_round(lost_step=None, pieces=1000):
    """A map made on two rounds through a ring of corridors, with the true poses at the scans."""
    walls = cells(["#####", "#...#", "#.#.#", "#...#", "#####"])
    centre = np.array([(1.5, -1.5), (1.5, -3.5), (3.5, -3.5), (3.5, -1.5)])
    poses = []
    for side in range(9):
        start, end = centre[side % 4], centre[(side + 1) % 4]
        heading = math.atan2(*(end - start)[::-1])
        poses += [Pose(*(start + share * (end - start)), heading) for share in np.linspace(0, 1, 10)[:-1]]
        poses += [Pose(*end, heading + math.pi / 6 * number) for number in (1, 2)]
    mapper, rng = Mapper(SETTINGS), np.random.default_rng(0)
    found = []
    for number, pose in enumerate(poses):
        step = between(poses[number - 1], pose) if number else None
        known = number > 0 and number != lost_step
        if known:
            scale = 1 + rng.normal(0, 0.05)
            mapper.move(Pose(step.x * scale, step.y, step.heading * scale))
        elif number:
            mapper.move(None)
        mapper.see(cloud_at(walls, pose, number), measured=known or not number)
        mapper.work(pieces)
        found.append(mapper.pose)
    return mapper, [between(between(poses[0], pose), seen) for pose, seen in zip(poses, found, strict=True)]


def test_a_map_of_a_ring_is_true_and_its_loops_are_closed():
    mapper, off = drive_round()
    assert max(math.hypot(one.x, one.y) for one in off) < 0.02
    assert max(abs(one.heading) for one in off) < math.radians(0.4)
    assert len(mapper.graph.loops) > 5


def test_a_turn_that_odometry_did_not_notice_is_found_by_the_wide_search():
    _, off = drive_round(lost_step=10)
    assert max(math.hypot(one.x, one.y) for one in off[11:]) < 0.03


def test_work_is_done_by_count_whatever_the_clock_says():
    one, other = drive_round(pieces=3)[0], drive_round(pieces=3)[0]
    assert one.graph.poses == other.graph.poses
    assert len(one.graph.loops) > 5


@pytest.mark.skipif(not carmen.LOGS.is_dir(), reason="the laser logs are not here")
def test_a_real_log_is_mapped():
    mapper = Mapper(SETTINGS)
    records = carmen.read_log(carmen.LOGS / "seattle-corrected.log.gz")
    places = []
    for number, record in enumerate(records):
        if number:
            mapper.move(record.step)
        mapper.see(cloud_of(ScanPoints.of(record.scan), SETTINGS.cloud), measured=not number or record.step is not None)
        mapper.work(10_000)
        places.append((len(mapper.clouds) - 1, mapper.offset))
    mapper.finish()
    ours = np.array([(pose.x, pose.y) for at, offset in places for pose in [compose(mapper.graph.poses[at], offset)]])
    theirs = np.array([(record.corrected.x, record.corrected.y) for record in records])
    ours, theirs = ours - ours.mean(axis=0), theirs - theirs.mean(axis=0)
    turn = np.angle(np.sum((theirs[:, 0] + 1j * theirs[:, 1]) * (ours[:, 0] - 1j * ours[:, 1])))
    apart = (ours[:, 0] + 1j * ours[:, 1]) * np.exp(1j * turn) - (theirs[:, 0] + 1j * theirs[:, 1])
    assert math.sqrt(np.mean(np.abs(apart) ** 2)) <= 0.08
