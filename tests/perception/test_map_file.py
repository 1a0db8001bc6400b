"""The file of a map: what it holds comes back, what is damaged is refused, and a robot goes on with it."""

import copy
import math
import os
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception import Perception
from perception.map_document import MapError, parsed, read_map, text_of, write_map
from perception.mapping.confidence import Knowledge
from perception.mapping.frames import between
from perception.marks import Direction
from perception.saved_map import document_of, start_of, world_of
from tests.perception.scenes import NOISE, PICO, cells, scan_of
from transport.messages import Observation, Odometry, Pose, Scan

WALLS = cells(["#######", "#.....#", "###.#.#", "#...#.#", "#######"])
PAGE = Path(__file__).parents[2] / "docs" / "reference" / "maps.md"
ROOM = re.search(r'```json title="room.map"\n(.*?)```', PAGE.read_text(encoding="utf-8"), re.DOTALL).group(1)
START = Pose(3.5, -1.5, -math.pi / 2)


def way(start, metres):
    """Poses straight ahead, 4 cm apart."""
    steps = round(metres / 0.04)
    return [
        Pose(
            start.x + number * 0.04 * math.cos(start.heading),
            start.y + number * 0.04 * math.sin(start.heading),
            start.heading,
        )
        for number in range(steps + 1)
    ]


def drive(perception, poses, *, begins, blind=0):
    rng = np.random.default_rng(3)
    for number, pose in enumerate(poses):
        stamp = number * 100_000_000
        scan = scan_of(WALLS, pose, PICO.laser, rng, noise=NOISE, stamp=stamp)
        if number < blind:
            scan = Scan(stamp, scan.geometry, np.full_like(scan.ranges, np.nan))
        facts = perception.facts(Observation(stamp, scan, Odometry.at(stamp, pose)))
        if begins:
            perception.world.begin_map(facts.sweep)
        yield pose, perception.world


@pytest.fixture(scope="module")
def world():
    """Of a robot that has driven along the upper corridor and turned the corner."""
    poses = way(START, 4.0)
    poses += [Pose(3.5, -5.5, -math.pi / 2 * (1 + part / 8)) for part in range(1, 9)]
    *_, (_, driven) = drive(Perception(PICO), poses + way(poses[-1], 1.2), begins=True)
    return driven


def test_the_map_comes_back(world):
    document = document_of(world)
    assert document.robot is not None
    again = parsed(text_of(document).encode(), "again")
    assert again == document
    assert text_of(again) == text_of(document)
    resumed = world_of(again, world.settings, start_of(again))
    assert document_of(resumed).keyframes == document.keyframes
    assert document_of(resumed).grid == document.grid
    assert document_of(resumed).steps == document.steps
    assert document_of(resumed).doors == document.doors


def test_a_map_is_small_and_its_grid_is_a_drawing(world):
    document = document_of(world)
    assert 500 < len(text_of(document)) / len(document.keyframes) < 20_000
    assert all(set(row) <= set("#. ") for row in document.grid.rows)
    # Across the corridor: a wall, a corridor of one metre, the other wall.
    assert any(re.search(r"#\.{8,10}#", row) for row in document.grid.rows)


def test_without_a_map_there_is_no_document():
    assert document_of(Perception(PICO).world) is None


@pytest.mark.parametrize(("back", "turned"), [(0.0, 0.0), (0.15, 0.1)])
def test_a_robot_at_the_stated_place_knows_it_at_once(world, back, turned):
    document = document_of(world)
    there, here = START, start_of(document)
    perception = Perception(PICO, world.settings, world_of(document, world.settings, here))
    poses = [Pose(one.x, one.y - back, one.heading + turned) for one in way(there, 0.8)]
    for number, (pose, driven) in enumerate(drive(perception, poses, begins=False)):
        assert driven.place_known, number
        off = between(between(there, pose), between(here, driven.pose))
        assert math.hypot(off.x, off.y) < 0.02
        assert abs(off.heading) < math.radians(0.5)


def test_a_robot_that_is_elsewhere_notices_it(world):
    document = document_of(world)
    perception = Perception(PICO, world.settings, world_of(document, world.settings, start_of(document)))
    elsewhere = Pose(1.5, -1.5, 0.0)
    known = [driven.surveyor.knowledge for _, driven in drive(perception, [elsewhere] * 5, begins=False)]
    assert set(known) == {Knowledge.LOST}
    assert document_of(perception.world).keyframes == document.keyframes
    assert document_of(perception.world).robot is None


def test_a_robot_that_sees_nothing_yet_waits_for_its_first_scan(world):
    document = document_of(world)
    here = start_of(document)
    perception = Perception(PICO, world.settings, world_of(document, world.settings, here))
    poses = way(START, 0.8)
    known = [driven.surveyor.knowledge for _, driven in drive(perception, poses, begins=False, blind=5)]
    assert set(known[:5]) == {Knowledge.DOUBTFUL}
    assert set(known[5:]) == {Knowledge.KNOWN}
    off = between(between(START, poses[-1]), between(here, perception.world.pose))
    assert math.hypot(off.x, off.y) < 0.02


def test_without_a_place_the_robot_is_lost_and_adds_nothing(world):
    document = document_of(world)
    resumed = world_of(document, world.settings, None)
    *_, (_, driven) = drive(Perception(PICO, world.settings, resumed), way(START, 0.8), begins=False)
    assert driven.surveyor.knowledge is Knowledge.LOST
    assert document_of(driven).keyframes == document.keyframes
    assert document_of(driven).grid == document.grid


def test_a_named_pipe_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.map")
    with pytest.raises(OSError, match="it is not a regular file"):
        read_map(tmp_path / "pipe.map")


def test_the_example_of_the_page_is_a_map():
    assert text_of(parsed(ROOM.encode(), "room.map")) == ROOM


def looped(information):
    """The map with a loop to a keyframe that is not there."""
    loop = f'{{"first": 0, "second": 4, "pose": [0, 0, 0], "information": {information}}}'
    return ROOM.replace('"loops": []', f'"loops": [{loop}]')


DAMAGED = [
    ("", "this is not a map"),
    ("[]", "this is not a map"),
    ("[" * 100_000, "this is not a map"),
    ('{"format": "maze"}', "this is not a map"),
    (ROOM[:300], "this is not a map, or a damaged one: EOF while parsing an object at line 16 column 31"),
    (ROOM.replace('"version": 2', '"version": 3'), "the map is of version 3, and this program reads versions 1 and 2"),
    (ROOM.replace(' "version": 2,\n', ""), "`version` is missing"),
    (ROOM.replace('"doors"', '"door"'), "`doors` is missing"),
    (ROOM.replace("#........#", "#...x....#"), "`grid.rows` has 'x' in row 2"),
    (ROOM.replace('"#........#"', '"#...."'), "`grid.rows` has a row 2 of 5 cells, where the first has 10"),
    (ROOM.replace('"cell": 0.25', '"cell": 0'), "`grid.cell` must be more than"),
    (ROOM.replace("0.003]", "NaN]"), "`keyframes.0.points.0.3` must be a finite number"),
    (ROOM.replace("0.003]", "1e-200]"), "`keyframes.0.points.0.3` must be"),
    (ROOM.replace("[1.0, 0.0, 3", "[1e999, 0.0, 3"), "`keyframes.0.points.0.0` must be a finite number"),
    (ROOM.replace("[0.0, 0.0, 0.0]", "[90, 0, 0]"), "`keyframes.0` is far from all that the grid shows"),
    (ROOM.replace('"place": [0.0', '"place": [90'), "`junctions.0` is far from all that the grid shows"),
    (ROOM.replace('"left": [1.0', '"left": [90'), "`doors.0.left` is far from all that the grid shows"),
    (ROOM.replace('"robot": [0.0', '"robot": [90'), "`robot` is far from all that the grid shows"),
    (ROOM.replace('"way_out": null', '"way_out": [0, 90]'), "`way_out` is far from all that the grid shows"),
    (ROOM.replace("[1, 0, 1, 0]", "[1, 0, 1]"), "`junctions.0.marks.3` is missing"),
    (ROOM.replace("[1, 0, 1, 0]", "[1, 0, -1, 0]"), "`junctions.0.marks.2` must be"),
    (ROOM.replace('"steps": []', '"steps": 3'), "`steps` must be several values"),
    (looped("[1, 0, 0, 1, 0, 1]"), "`loops.0` must lead from a keyframe to a later one"),
    (looped("[1, 0, 0, -1, 0, 1]"), "`loops.0.information` must be that of a measurement"),
]


@pytest.mark.parametrize(("text", "told"), DAMAGED, ids=[told[:60] for _, told in DAMAGED])
def test_a_damaged_file_is_refused_with_one_message(tmp_path, text, told):
    file = tmp_path / "damaged.map"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(MapError) as refused:
        read_map(file)
    message = str(refused.value)
    assert message.startswith(f"{file}: ")
    assert told in message
    assert "\n" not in message
    assert len(message) < 300 + len(str(file))


def test_a_file_that_is_too_large_is_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr("perception.map_document.LARGEST", 1000)
    file = tmp_path / "large.map"
    file.write_text(ROOM + " " * 1000, encoding="utf-8")
    with pytest.raises(MapError, match="larger than"):
        read_map(file)


@given(st.integers(0, len(ROOM) - 1), st.binary(max_size=3), st.integers(0, 40))
def test_any_damage_is_refused_or_harmless(world, at, inserted, removed):
    content = ROOM.encode()
    content = content[:at] + inserted + content[at + removed :]
    try:
        document = parsed(content, "some.map")
    except MapError as error:
        assert "\n" not in str(error)  # noqa: PT017 - of any input
        return
    world_of(document, world.settings, start_of(document))


def test_it_is_written_whole(tmp_path, world):
    file = tmp_path / "a.map"
    write_map(file, document_of(world))
    assert read_map(file) == document_of(world)
    assert [one.name for one in tmp_path.iterdir()] == ["a.map"]


@pytest.fixture
def marked(world):
    """The document of a run that has marked two junctions on its way out, and its world model."""
    driven = copy.deepcopy(world)
    for pose in (Pose(1.0, 0.0, 0.0), Pose(3.0, 0.1, math.pi / 2)):
        driven.marks.arrive(pose)
        driven.marks.mark(Direction.AHEAD)
    return document_of(driven, left=True), driven


def test_the_marks_of_a_run_that_led_out_are_in_the_file(marked):
    document, driven = marked
    assert [one.marks for one in document.junctions] == [(1, 0, 1, 0), (0, 1, 0, 1)]
    assert document_of(driven).junctions == (), "it has not left the maze"
    again = parsed(text_of(document).encode(), "again")
    assert again == document
    resumed = world_of(again, driven.settings, start_of(again))
    assert document_of(resumed).junctions == document.junctions
    # In the next run the way on from the second junction is the one that leads out.
    resumed.marks.arrive(Pose(3.05, 0.0, math.pi / 2))
    assert resumed.marks.leads_out(Direction.AHEAD)
    assert not resumed.marks.leads_out(Direction.LEFT)


@pytest.mark.parametrize("at", [None, Pose(2.0, 0.0, 0.0)])
def test_marks_say_nothing_to_a_robot_that_begins_elsewhere(marked, at):
    document, driven = marked
    resumed = world_of(document, driven.settings, at)
    resumed.marks.arrive(Pose(3.0, 0.1, math.pi / 2))
    assert not any(resumed.marks.leads_out(way) for way in Direction)
    assert document_of(resumed, left=True).junctions == ()


def test_a_file_of_the_first_version_has_no_junctions():
    first = ROOM.replace('"version": 2', '"version": 1').replace(
        ' "junctions": [\n  {"place": [0.0, 0.0, 0.0], "marks": [1, 0, 1, 0]}],\n', ""
    )
    assert "junctions" not in first
    assert parsed(first.encode(), "first").junctions == ()
