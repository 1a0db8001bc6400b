"""Maps of mapping tools, the course's present files, and what a user chooses of any maze."""

import io
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from sim.formats import Choices, Grey, read_maze, write_maze
from sim.formats.chosen import OPENED, opened
from sim.formats.image import Picture, areas
from sim.formats.ros_map import Description, occupied_and_free
from sim.maze import Leave, Maze, MazeError, Nothing, Reach, Start, Survive
from sim.referee import AttemptOutcome
from sim.robot import SimulatedRobot
from sim.settings import Rules, SimulatorSettings
from sim.solvability import shortest_way
from sim.world import UNKNOWN
from transport.description import RobotDescription
from transport.messages import STOP, Command, Pose, Twist

MAZES = Path(__file__).parent / "mazes"
ROOMS = MAZES / "rooms.yaml"


def described(folder, pixels, **said):
    """A description of a map and its image in a folder; gives the description's file."""
    Image.fromarray(pixels).save(folder / "map.png")
    lines = {"image": "map.png", "resolution": 0.1, "origin": [0, 0, 0], **said}
    (folder / "map.yaml").write_text("".join(f"{key}: {value}\n" for key, value in lines.items()))
    return folder / "map.yaml"


def room(free=254, wall=0, around=205):
    """A room of 2 x 1 m with walls of one pixel of 0.1 m, in the lower left corner of 4 x 3 m of something else."""
    image = np.full((30, 40), around, dtype=np.uint8)
    image[18:30, 0:22] = wall
    image[19:29, 1:21] = free
    return image


class TestMapsOfMappingTools:
    def test_unknown_cells_are_edges_and_no_doors(self):
        maze = read_maze(ROOMS, radius=RobotDescription().radius)
        assert maze.doors == ()
        assert maze.goal == Nothing()
        # A hole of 0.25 m in the wall at the west, seen from inside.
        assert [sorted(edge) for edge in maze.unknown.tolist()] == [pytest.approx([-0.95, -0.95, -0.5, -0.25])]

    def test_the_robot_is_put_down_at_the_maps_origin_or_in_its_middle(self, tmp_path):
        assert read_maze(ROOMS, radius=RobotDescription().radius).start.pose == Pose()
        grid = np.full((30, 40), 254, dtype=np.uint8)
        grid[0] = 0
        pose = read_maze(described(tmp_path, grid, origin=[10, 20, 0]), radius=RobotDescription().radius).start.pose
        assert (pose.x, pose.y, pose.heading) == pytest.approx((12.0, 21.5, math.pi / 2))

    def test_the_frame_is_the_maps_own(self, tmp_path):
        straight = read_maze(
            described(tmp_path, room(), origin=[1, 2, 0]),
            Choices(start=Start(Pose(2.1, 2.6, 0.0))),
            radius=RobotDescription().radius,
        )
        assert straight.bounds == pytest.approx((1.0, 2.0, 3.2, 3.2))
        yaw = math.pi / 2
        turned = read_maze(
            described(tmp_path, room(), origin=[1, 2, yaw]),
            Choices(start=Start(Pose(0.4, 3.1, 0.0))),
            radius=RobotDescription().radius,
        )
        assert turned.bounds == pytest.approx((-0.2, 2.0, 1.0, 4.2))

    @pytest.mark.parametrize(
        ("said", "image"),
        [
            ({}, room()),
            ({"negate": 1}, 255 - room()),
            ({"negate": "true"}, 255 - room()),
            ({"mode": "scale", "occupied_thresh": 1.0, "free_thresh": 0.01}, room()),
            ({"mode": "raw"}, room(free=0, wall=100, around=255)),
            ({"mode": "Raw"}, room(free=0, wall=100, around=255)),
            ({"occupied_thresh": 0.9, "free_thresh": 0.1}, room(free=240, wall=20, around=127)),
        ],
        ids=["trinary", "negated", "negated by a word", "scale", "raw", "in capitals", "other thresholds"],
    )
    def test_thresholds_negation_and_modes_are_the_map_servers(self, tmp_path, said, image):
        maze = read_maze(
            described(tmp_path, image, **said),
            Choices(start=Start(Pose(1.1, 0.6, 0.0))),
            radius=RobotDescription().radius,
        )
        expected = {(0.1, 0.1, 0.1, 1.1), (2.1, 0.1, 2.1, 1.1), (0.1, 0.1, 2.1, 0.1), (0.1, 1.1, 2.1, 1.1)}
        drawn = {tuple(np.round([*min(a, b), *max(a, b)], 6)) for *a, c, d in maze.walls.tolist() for b in [[c, d]]}
        assert expected <= drawn
        assert len(maze.unknown) == 0

    def test_what_is_transparent_is_unknown(self):
        grey = np.array([[0, 254, 254]], dtype=np.uint8)
        opaque = np.array([[False, False, True]])
        description = Description(image="x", resolution=1.0, origin=(0, 0, 0))
        wall, free = occupied_and_free(Picture(grey, opaque), description)
        assert (wall.tolist(), free.tolist()) == ([[False] * 3], [[False, False, True]])

    def test_an_image_without_its_description_is_known_by_its_values(self, tmp_path):
        image = np.asarray(Image.open(MAZES / "rooms.pgm"))
        Image.fromarray(image).save(tmp_path / "alone.png")
        choices = Choices(start=Start(Pose(1.5, 4.0, 0.0)), goal=Reach((4.5, 4.0)))
        alone = read_maze(tmp_path / "alone.png", choices, radius=RobotDescription().radius)
        assert alone.doors == ()
        described = read_maze(ROOMS, radius=RobotDescription().radius)
        assert np.allclose(alone.walls - [1.5, 4.0] * 2, described.walls)
        assert read_maze(MAZES / "rooms.pgm", radius=RobotDescription().radius).start == described.start, (
            "the description beside it is used"
        )

    def test_the_map_savers_comment_gives_the_scale(self, tmp_path):
        content = (MAZES / "rooms.pgm").read_bytes()
        (tmp_path / "alone.pgm").write_bytes(content.replace(b"P5\n", b"P5\n# CREATOR: map_saver.cpp 0.100 m/pix\n", 1))
        maze = read_maze(
            tmp_path / "alone.pgm", Choices(start=Start(Pose(3.0, 8.0, 0.0))), radius=RobotDescription().radius
        )
        assert maze.bounds[2] - maze.bounds[0] == pytest.approx(13.0)

    def test_a_map_that_was_moved_with_its_image_is_read(self, tmp_path):
        file = described(tmp_path, room(), image="/opt/maps/map.png")
        assert (
            len(read_maze(file, Choices(start=Start(Pose(1.1, 0.6, 0.0))), radius=RobotDescription().radius).walls) == 8
        )

    @pytest.mark.parametrize(
        ("name", "text"),
        [
            ("map.yaml", "{image: map.png, resolution: 0.1, origin: [-1, -0.5, 0]}"),
            ("map.json", '{"image": "map.png",\n"resolution": 0.1, "origin": [-1, -0.5, 0]}'),
            ("map.yaml", "image: maps\\map.png\nresolution: 0.1\norigin:\n  - -1\n  - -0.5\n  - 0\n"),
        ],
        ids=["in one line", "as JSON", "with a path of Windows"],
    )
    def test_a_description_is_any_yaml(self, tmp_path, name, text):
        described(tmp_path, room())
        (tmp_path / "maps").mkdir()
        (tmp_path / "map.png").rename(tmp_path / "maps" / "map.png" if "maps" in text else tmp_path / "map.png")
        (tmp_path / name).write_text(text)
        maze = read_maze(tmp_path / name, radius=RobotDescription().radius)
        assert maze.bounds[:2] == pytest.approx((-1.0, -0.5))

    def test_a_robot_that_touches_the_edge_of_the_unknown_is_told_so(self):
        maze = replace(read_maze(ROOMS, radius=RobotDescription().radius), start=Start(Pose(-0.5, -0.375, math.pi)))
        robot = SimulatedRobot(maze)
        while not robot.finished:
            robot.command(Command(Twist(0.5, 0.0, 0.0)))
        assert robot.verdict.contacts[0].other in (UNKNOWN, "wall")
        assert robot.verdict.outcome is AttemptOutcome.TOUCHED

    def test_it_survives_being_written_as_our_own(self, tmp_path):
        maze = read_maze(ROOMS, Choices(goal=Reach((3.0, -0.4), 0.25)), radius=RobotDescription().radius)
        write_maze(maze, tmp_path / "again.maze")
        again = read_maze(tmp_path / "again.maze", radius=RobotDescription().radius)
        assert np.array_equal(again.walls, maze.walls)
        assert np.array_equal(again.unknown, maze.unknown)
        assert (again.goal, again.start) == (maze.goal, maze.start)
        for name in ("again.png", "again.txt"):
            with pytest.raises(MazeError, match="cannot hold"):
                write_maze(maze, tmp_path / name)

    @pytest.mark.parametrize(
        ("said", "reason"),
        [
            ({"resolution": -1}, "`resolution` must be more than 0"),
            ({"resolution": ".nan"}, "resolution"),
            ({"resolution": 100.0}, "more than 200 m"),
            ({"origin": "[0]"}, "origin"),
            ({"origin": "[0, .inf, 0]"}, "origin"),
            ({"origin": "[1e300, 0, 0]"}, "`origin.0` must be at most 10000"),
            ({"mode": "binary"}, "`mode` must be one of"),
            ({"free_thresh": 0.7}, r"`free_thresh` \(0.7\) must not be above `occupied_thresh` \(0.65\)"),
            ({"free_thresh": 2}, "`free_thresh` must be at most 1"),
            ({"image": "none.png"}, r"none\.png: cannot be read"),
            ({"image": "map.yaml"}, "cannot be decoded"),
            ({"image": "/dev/zero"}, "not a regular file"),
            ({"image": "[" * 60}, "few brackets"),
            ({"image": "x" * 5000}, "at most 4000 bytes"),
            ({"image": "[" * 40}, "not valid YAML"),
            ({"image": "&a [*a, *a"}, "not valid YAML"),
        ],
    )
    def test_a_wrong_description_is_refused(self, tmp_path, said, reason):
        with pytest.raises(MazeError, match=reason) as caught:
            read_maze(described(tmp_path, room(), **said), radius=RobotDescription().radius)
        assert "\n" not in str(caught.value)

    @given(values=st.lists(st.integers(0, 255), min_size=1, max_size=20), negate=st.booleans())
    def test_no_pixel_is_a_wall_and_free(self, values, negate):
        picture = Picture(np.array([values], dtype=np.uint8), np.ones((1, len(values)), dtype=np.bool_))
        for mode in ("trinary", "scale", "raw"):
            description = Description(image="x", resolution=1.0, origin=(0, 0), negate=negate, mode=mode)
            wall, free = occupied_and_free(picture, description)
            assert not (wall & free).any()


CONFIG = {
    "uncertain_odom": True,
    "objects": [
        {
            "length": 1.0,
            "width": 0.5,
            "trigger_radius": 1.5,
            "repeat": True,
            "velocity": 0.6,
            "init_pose": [3.0, -2.0, math.pi / 2],
            "final_pose": [4.0, -2.0, 0.0],
        }
    ],
    "initial_pose": [0.2, -0.3, 0.5],
}


class TestTheCoursesObjects:
    def read(self, folder, content):
        (folder / "config.json").write_text(content if isinstance(content, str) else json.dumps(content))
        return read_maze(ROOMS, Choices(objects=folder / "config.json"), radius=RobotDescription().radius)

    def test_they_are_put_into_the_maze(self, tmp_path):
        maze = self.read(tmp_path, CONFIG)
        (thing,) = maze.objects
        assert (thing.speed, thing.near, thing.returns) == (0.6, 1.5, True)
        assert thing.path == ((3.0, -2.0), (4.0, -2.0))
        # It is turned by a right angle, so that its length goes along y.
        assert np.abs(np.asarray(thing.outline)).max(axis=0) == pytest.approx([0.25, 0.5])
        assert maze.start.pose == Pose(0.2, -0.3, 0.5)

    def test_one_without_velocity_does_not_move(self, tmp_path):
        (thing,) = self.read(tmp_path, {"objects": [{**CONFIG["objects"][0], "velocity": 0.0}]}).objects
        assert thing.path == ((3.0, -2.0),)

    def test_a_chosen_start_goes_first(self, tmp_path):
        (tmp_path / "config.json").write_text(json.dumps(CONFIG))
        chosen = Choices(objects=tmp_path / "config.json", start=Start(Pose(0.1, 0.1, 0.0)))
        assert read_maze(ROOMS, chosen, radius=RobotDescription().radius).start == chosen.start

    @pytest.mark.parametrize(
        ("content", "reason"),
        [
            ("{", "not JSON"),
            ("[" * 100_000, "not JSON"),
            ("[]", "must be"),
            ({"objects": [{"length": 1}]}, "is missing"),
            ({"objects": [{**CONFIG["objects"][0], "velocity": 1e300}]}, "velocity"),
            ({"objects": [{**CONFIG["objects"][0], "init_pose": [1e300, 0, 0]}]}, "init_pose"),
            ({"objects": [{**CONFIG["objects"][0], "final_pose": [5000, 0, 0]}]}, "more than 200 m"),
            ({"objects": CONFIG["objects"] * 101}, "objects"),
        ],
    )
    def test_a_wrong_file_is_refused(self, tmp_path, content, reason):
        with pytest.raises(MazeError, match=reason) as caught:
            self.read(tmp_path, content)
        assert "\n" not in str(caught.value)

    def test_as_a_maze_it_says_how_it_is_used(self, tmp_path):
        (tmp_path / "config.json").write_text(json.dumps(CONFIG))
        with pytest.raises(MazeError, match="with `--objects`"):
            read_maze(tmp_path / "config.json", radius=RobotDescription().radius)

    def test_grey_of_its_map_can_be_read_as_doors(self, tmp_path):
        grid = np.full((60, 60), 255, dtype=np.uint8)
        grid[0] = grid[-1] = 0
        grid[:, 0] = grid[:, -1] = 0
        grid[20, :] = 0
        grid[20, 20:40] = 127
        file = described(tmp_path, grid, occupied_thresh=0.9, free_thresh=0.1, resolution=0.05)
        (door,) = read_maze(file, Choices(grey=Grey.DOOR), radius=RobotDescription().radius).doors
        assert door.length == pytest.approx(1.0)
        assert len(read_maze(file, radius=RobotDescription().radius).unknown) == 2
        assert len(read_maze(file, Choices(grey=Grey.SPLIT), radius=RobotDescription().radius).unknown) == 0


ROOM = "start 1 1 0\nwall 0 0  2 0  2 2  0 2  0 0\n"


class TestWhatIsChosen:
    @pytest.fixture
    def closed(self, tmp_path):
        (tmp_path / "closed.maze").write_text(ROOM)
        return tmp_path / "closed.maze"

    def test_a_closed_maze_is_refused_unless_another_goal_is_chosen(self, closed):
        with pytest.raises(MazeError, match=r"no way leads .* choose another goal"):
            read_maze(closed, radius=RobotDescription().radius)
        for goal in (Reach((0.5, 0.5)), Survive(20.0), Nothing()):
            assert read_maze(closed, Choices(goal=goal), radius=RobotDescription().radius).goal == goal

    def test_a_closed_image_is_a_world_in_which_nothing_is_to_be_done(self, tmp_path):
        image = np.full((80, 80), 255, dtype=np.uint8)
        image[10:70, 10:70] = 0
        image[12:68, 12:68] = 255
        Image.fromarray(image).save(tmp_path / "closed.png")
        assert read_maze(tmp_path / "closed.png", radius=RobotDescription().radius).goal == Nothing()

    def test_a_file_says_its_goal(self, closed):
        for line, goal in (
            ("goal none", Nothing()),
            ("goal survive 5", Survive(5.0)),
            ("goal 0.5 0.5", Reach((0.5, 0.5))),
            ("goal 0.5 0.5 0.1", Reach((0.5, 0.5), 0.1)),
        ):
            closed.write_text(f"{ROOM}{line}\n")
            assert read_maze(closed, radius=RobotDescription().radius).goal == goal

    def test_a_goal_that_cannot_be_reached_is_refused(self, closed):
        with pytest.raises(MazeError, match=r"no way leads .* to the goal"):
            read_maze(closed, Choices(goal=Reach((5.0, 5.0))), radius=RobotDescription().radius)
        with pytest.raises(MazeError, match="the way to the goal is only about"):
            read_maze(closed, Choices(goal=Reach((1.95, 1.95), 0.1)), radius=RobotDescription().radius)

    def test_a_chosen_exit_opens_the_wall_along_it(self, closed):
        maze = read_maze(closed, Choices(exits=(((2.0, 0.5), (2.0, 1.5)),)), radius=RobotDescription().radius)
        assert maze.goal == Leave()
        assert len(maze.exits) == 1
        assert shortest_way(maze, radius=RobotDescription().radius) is not None

    @pytest.mark.parametrize("x", [0.85, 0.9, 1.0, 1.1, 1.15])
    def test_a_chosen_exit_leads_through_a_thick_wall_wherever_in_it_it_lies(self, tmp_path, x):
        grid = room()
        grid[18:30, 19:21], grid[:, 21:] = 0, 205
        file = described(tmp_path, grid, origin=[-1.0, -0.5, 0])
        choices = Choices(exits=(((x, -0.2), (x, 0.3)),), start=Start(Pose(0.0, 0.0, 0.0)))
        maze = read_maze(file, choices, radius=0.15)
        way = shortest_way(maze, radius=0.15)
        assert way == pytest.approx(x, abs=0.4)
        with pytest.raises(MazeError, match=r"only about 0\.5"):
            read_maze(file, choices, radius=0.3)

    def test_a_chosen_exit_replaces_the_files(self):
        maze = read_maze(
            MAZES / "cells.txt", Choices(exits=(((4.0, 3.0), (4.0, 4.0)),)), radius=RobotDescription().radius
        )
        assert {tuple(sorted(edge)) for edge in maze.exits.tolist()} == {(3.0, 4.0, 4.0, 4.0)}
        assert read_maze(MAZES / "cells.txt", radius=RobotDescription().radius).exits.tolist() != maze.exits.tolist()

    def test_the_robot_decides_what_fits(self, tmp_path):
        (tmp_path / "narrow.maze").write_text("start 0.2 0.2 0\nwall 2 0 0 0 0 0.4 2 0.4\nexit 2 0 2 0.4\n")
        with pytest.raises(MazeError, match="does not fit at its start"):
            read_maze(tmp_path / "narrow.maze", radius=RobotDescription().radius)
        assert len(read_maze(tmp_path / "narrow.maze", radius=0.105).exits) == 1

    @given(
        wall=st.tuples(*[st.floats(-3, 3)] * 4),
        gate=st.tuples(*[st.floats(-3, 3)] * 4).filter(lambda g: math.dist(g[:2], g[2:]) > 0.2),
    )
    def test_what_is_opened_is_gone_and_nothing_else(self, wall, gate):
        (gx, gy, hx, hy), length = gate, math.dist(gate[:2], gate[2:])
        ex, ey = (hx - gx) / length, (hy - gy) / length
        kept = opened(np.array([wall]), ((gx, gy), (hx, hy)))
        shares = np.linspace(0.0, 1.0, 101)
        points = np.array(wall[:2]) + shares[:, None] * (np.array(wall[2:]) - np.array(wall[:2]))
        along = (points - [gx, gy]) @ [ex, ey]
        aside = (points - [gx, gy]) @ [-ey, ex]
        for point, u, v in zip(points, along, aside, strict=True):
            depth = min(u, length - u, OPENED - abs(v))
            away = min((_distance(point, piece) for piece in kept), default=math.inf)
            if depth > 1e-3:
                assert away > 1e-6
            if depth < -1e-3:
                assert away < 1e-6


def _distance(point, segment):
    (ax, ay, bx, by), (px, py) = segment, point
    square = (bx - ax) ** 2 + (by - ay) ** 2
    along = 0.0 if square == 0 else min(max(((px - ax) * (bx - ax) + (py - ay) * (by - ay)) / square, 0.0), 1.0)
    return math.hypot(px - ax - along * (bx - ax), py - ay - along * (by - ay))


class TestWhatIsJudged:
    def robot(self, goal, **rules):
        walls = np.array([[0, 0, 3, 0], [3, 0, 3, 2], [3, 2, 0, 2], [0, 2, 0, 0]], dtype=float)
        maze = Maze("room", walls, Start(Pose(1.0, 1.0, 0.0)), goal=goal)
        return SimulatedRobot(maze, settings=SimulatorSettings(rules=Rules(**rules)))

    def drive(self, robot, twist, ticks):
        for _ in range(ticks):
            if not robot.finished:
                robot.command(Command(twist))

    def test_reaching_a_place(self):
        robot = self.robot(Reach((2.0, 1.0), 0.2))
        self.drive(robot, Twist(0.5, 0.0, 0.0), 100)
        verdict = robot.verdict
        assert (verdict.outcome, verdict.solved, verdict.escaped) == (AttemptOutcome.REACHED, True, False)
        assert math.dist((robot.truth.x, robot.truth.y), (2.0, 1.0)) <= 0.2
        assert verdict.line().startswith("reached the goal after ")
        assert "coming within 0.2 m of (2.00, 1.00) m" in str(verdict.goal)

    def test_going_by_at_a_distance_is_no_reaching(self):
        robot = self.robot(Reach((2.0, 1.5), 0.2))
        self.drive(robot, Twist(0.3, 0.0, 0.0), 40)
        assert not robot.verdict.solved

    def test_surviving(self):
        robot = self.robot(Survive(3.0))
        self.drive(robot, Twist(0.0, 0.0, 0.5), 100)
        verdict = robot.verdict
        assert (verdict.outcome, verdict.solved, verdict.time) == (AttemptOutcome.SURVIVED, True, pytest.approx(3.0))

    def test_who_touches_a_wall_has_not_survived(self):
        for fails in (True, False):
            robot = self.robot(Survive(6.0), contact_fails=fails)
            self.drive(robot, Twist(0.5, 0.0, 0.0), 100)
            assert robot.verdict.outcome is AttemptOutcome.TOUCHED

    def test_where_nothing_is_to_be_done_a_robot_may_stand(self):
        robot = self.robot(Nothing())
        self.drive(robot, STOP, 350)
        assert not robot.finished
        assert robot.verdict.solved
        assert robot.verdict.line().startswith("touched nothing after 35.0 s")

    def test_where_nothing_is_to_be_done_a_contact_fails(self):
        robot = self.robot(Nothing())
        self.drive(robot, Twist(0.5, 0.0, 0.0), 100)
        assert (robot.verdict.outcome, robot.verdict.solved) == (AttemptOutcome.TOUCHED, False)


@given(rows=st.integers(1, 12), columns=st.integers(1, 12), seed=st.integers(0, 2**32), share=st.floats(0.0, 1.0))
def test_areas_hang_together_and_are_all_there(rows, columns, seed, share):
    mask = np.random.default_rng(seed).random((rows, columns)) < share
    pieces = [set(zip(ys.tolist(), xs.tolist(), strict=True)) for ys, xs in areas(mask)]
    assert sum(map(len, pieces)) == mask.sum()
    for piece in pieces:
        reached, todo = set(), [next(iter(piece))]
        while todo:
            row, column = todo.pop()
            if (row, column) not in reached:
                reached.add((row, column))
                beside = {(row + i, column + j) for i in (-1, 0, 1) for j in (-1, 0, 1)}
                assert not any(beside & other for other in pieces if other is not piece)
                todo += beside & piece
        assert reached == piece


def test_an_image_of_every_kind_is_read(tmp_path):
    grey = np.asarray(Image.open(MAZES / "doors.png"))
    expected = read_maze(MAZES / "doors.png", radius=RobotDescription().radius)
    for kind in ("PNG", "PPM", "BMP", "GIF"):
        buffer = io.BytesIO()
        Image.fromarray(grey).save(buffer, kind)
        (tmp_path / "any").write_bytes(buffer.getvalue())
        assert np.array_equal(read_maze(tmp_path / "any", radius=RobotDescription().radius).walls, expected.walls), kind


def test_grey_edges_can_be_split(tmp_path):
    grey = np.asarray(Image.open(MAZES / "doors.png"))
    split = read_maze(MAZES / "doors.png", Choices(grey=Grey.SPLIT), radius=RobotDescription().radius)
    assert split.doors == ()
    assert len(split.walls) > len(read_maze(MAZES / "doors.png", radius=RobotDescription().radius).walls)
    assert ((grey >= 50) & (grey <= 205)).any()
