"""Maze files of every format: what they say, what is wrong with them and where."""

import io
import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sim.formats import FORMATS, heightmap, micromouse, mms, read_maze, text, write_maze
from sim.formats.format import Choices, Source
from sim.formats.grid import exit_maze
from sim.geometry import distances
from sim.maze import MazeError, Nothing
from sim.shipped import shipped_mazes
from sim.solvability import shortest_way
from transport.description import RobotDescription

MAZES = Path(__file__).parent / "mazes"
FOREIGN = Path(__file__).parents[2].parent / "shared" / "data" / "mazes"


def as_set(segments):
    """Walls without order or direction, to the millimetre."""
    rounded = np.round(segments, 3) + 0.0
    return {tuple(sorted((tuple(wall[:2]), tuple(wall[2:])))) for wall in rounded.tolist()}


def example(form):
    """A file of a format: a shipped maze, or one of the tests'."""
    for path in [*shipped_mazes().values(), *sorted(MAZES.iterdir())]:
        if path.suffix in form.suffixes:
            return path
    raise AssertionError(f"put an example of a {form.name} into {MAZES}")


@pytest.mark.parametrize("form", FORMATS, ids=lambda form: form.name)
class TestEveryFormat:
    def test_its_files_are_recognised_by_their_content_alone(self, form, tmp_path):
        source = Source(tmp_path / "file", example(form).read_bytes())
        assert next(other for other in FORMATS if other.recognises(source)) is form

    def test_its_files_are_solvable_mazes_with_the_robot_inside(self, form, tmp_path):
        maze = read_maze(example(form), radius=RobotDescription().radius)
        assert maze.name
        assert np.isfinite(maze.walls).all()
        assert maze.goal == Nothing() or (
            len(maze.exits) >= 1 and shortest_way(maze, radius=RobotDescription().radius) is not None
        )
        left, bottom, right, top = maze.bounds
        assert left < maze.start.pose.x < right
        assert bottom < maze.start.pose.y < top

    def test_it_is_written_in_every_suffix_and_read_again(self, form, tmp_path):
        maze = read_maze(example(form), radius=RobotDescription().radius)
        for suffix in form.suffixes if form.write else ():
            write_maze(maze, tmp_path / f"again{suffix}")
            again = read_maze(tmp_path / f"again{suffix}", radius=RobotDescription().radius)
            assert shortest_way(again, radius=RobotDescription().radius) == pytest.approx(
                shortest_way(maze, radius=RobotDescription().radius), rel=0.1
            )
            assert len(again.doors) == len(maze.doors)

    def test_half_a_file_is_read_or_refused_with_its_name(self, form, tmp_path):
        whole = example(form)
        for share in (0.2, 0.5, 0.9):
            path = tmp_path / f"half{whole.suffix}"
            path.write_bytes(whole.read_bytes()[: int(share * whole.stat().st_size)])
            try:
                read_maze(path, radius=RobotDescription().radius)
            except MazeError as error:
                refusal = str(error)
                assert refusal.startswith(str(path))


@pytest.mark.parametrize("name", sorted(shipped_mazes()))
def test_shipped_mazes_can_be_solved_and_survive_being_written(name, tmp_path):
    maze = read_maze(shipped_mazes()[name], radius=RobotDescription().radius)
    write_maze(maze, tmp_path / "again.maze")
    again = read_maze(tmp_path / "again.maze", radius=RobotDescription().radius)
    assert np.array_equal(again.walls, maze.walls)
    assert np.array_equal(again.exits, maze.exits)
    assert (again.doors, again.objects, again.start) == (maze.doors, maze.objects, maze.start)
    assert (again.name, again.time_limit) == (maze.name, maze.time_limit)


def test_the_final_keeps_the_rules_of_doors(final):
    (door,) = final.doors
    assert 0.5 <= door.length <= 1.5
    assert math.dist(door.leaf[0], final.start_point) > 1.3
    assert door.length / door.speed <= 5.0


def test_micromouse_text_is_used_from_the_goal_outwards():
    maze = read_maze(MAZES / "cells.txt", radius=RobotDescription().radius)
    assert (maze.start.pose.x, maze.start.pose.y) == (2.5, 2.5)
    # The way into the entrance comes from the north, so the opening is in the south, facing south.
    assert maze.exits.tolist() == [[1.0, 0.0, 0.0, 0.0]]
    assert as_set(maze.walls) >= {((1.0, 0.0), (4.0, 0.0)), ((0.0, 4.0), (4.0, 4.0)), ((1.0, 3.0), (1.0, 4.0))}
    assert (
        read_maze(MAZES / "cells.txt", Choices(metres_a_cell=0.5), radius=RobotDescription().radius).walls.tolist()
        == (maze.walls / 2).tolist()
    )


def test_mms_and_micromouse_files_of_one_maze_have_the_same_walls():
    drawn, numbered = (
        read_maze(MAZES / "cells.txt", radius=RobotDescription().radius),
        read_maze(MAZES / "cells.num", radius=RobotDescription().radius),
    )
    assert as_set(drawn.walls) == as_set(numbered.walls)
    assert (numbered.start.pose.x, numbered.start.pose.y) == (1.5, 2.5)


def test_heightmap_walls_are_the_outlines_of_black_pixels_in_the_documented_frame():
    image = np.full((40, 60), 255, dtype=np.uint8)
    image[10:13, 20:40] = 0
    maze = heightmap.read(Source(Path("one.png"), _png(image)), Choices(metres_a_pixel=0.1)).maze
    # Rows 10 to 12 are x from (20 - 13) to (20 - 10) pixels above the centre; columns 20 to 39 y from -10 to 10.
    assert as_set(maze.walls) == {
        ((0.7, -1.0), (0.7, 1.0)),
        ((1.0, -1.0), (1.0, 1.0)),
        ((0.7, 1.0), (1.0, 1.0)),
        ((0.7, -1.0), (1.0, -1.0)),
    }


def test_png_and_pgm_are_the_same_maze_with_straight_and_slanted_doors():
    png, pgm = (
        read_maze(MAZES / "doors.png", radius=RobotDescription().radius),
        read_maze(MAZES / "doors.pgm", radius=RobotDescription().radius),
    )
    assert np.array_equal(png.walls, pgm.walls)
    assert png.doors == pgm.doors
    assert len(png.exits) == 2
    straight = next(door for door in png.doors if door.leaf[0][1] == pytest.approx(door.leaf[1][1]))
    assert straight.length == pytest.approx(38 * 0.025, abs=1e-9)
    (slanted,) = (door for door in png.doors if door is not straight)
    (ax, ay), (bx, by) = slanted.leaf
    assert math.degrees(math.atan2(abs(bx - ax), abs(by - ay))) == pytest.approx(math.degrees(math.atan(1 / 6)), abs=1)
    # It leaves no gap to the walls on both sides, at y = 0.45 and -0.45.
    assert max(ay, by) >= 0.45 - 1e-9
    assert min(ay, by) <= -0.45 + 1e-9


def test_transparent_and_deep_images_are_read_as_what_they_look_like(tmp_path):
    grey = np.asarray(Image.open(MAZES / "doors.png"))
    opaque = np.dstack([np.zeros_like(grey)] * 3 + [255 - grey])
    Image.fromarray(opaque, "RGBA").save(tmp_path / "alpha.png")
    Image.fromarray(grey.astype(np.uint16) * 257).save(tmp_path / "deep.png")
    expected = read_maze(MAZES / "doors.png", radius=RobotDescription().radius)
    for name in ("alpha.png", "deep.png"):
        assert np.array_equal(read_maze(tmp_path / name, radius=RobotDescription().radius).walls, expected.walls)


def test_a_heightmap_written_from_a_maze_has_its_walls_within_a_pixel(final, tmp_path):
    write_maze(final, tmp_path / "final.png")
    image = read_maze(tmp_path / "final.png", radius=RobotDescription().radius)
    # The robot looks up in both; the image's x is the maze's y, its y points the other way.
    points = image.walls.reshape(-1, 2) @ [[0.0, 1.0], [-1.0, 0.0]]
    away = distances(points + np.array([1.5, -0.45]), final.walls).min(axis=1)
    assert away.max() < 2 * 0.025
    assert len(image.doors) == len(image.exits) == 1
    assert image.doors[0].length == pytest.approx(1.0, abs=0.06)
    assert shortest_way(image, radius=RobotDescription().radius) == pytest.approx(
        shortest_way(final, radius=RobotDescription().radius), abs=0.2
    )


def test_cells_survive_being_written(tmp_path):
    maze = read_maze(MAZES / "cells.txt", radius=RobotDescription().radius)
    for name in ("again.txt", "again.maze"):
        write_maze(maze, tmp_path / name)
        assert as_set(read_maze(tmp_path / name, radius=RobotDescription().radius).walls) == as_set(maze.walls)
    cells = micromouse.parse(Source(MAZES / "cells.txt", (MAZES / "cells.txt").read_bytes()))
    again = mms.parse(Source(Path("cells.num"), mms.numbered(cells).encode()))
    assert as_set(exit_maze(again, 1.0).walls) == as_set(exit_maze(cells, 1.0).walls)


def test_what_a_format_cannot_hold_is_refused(final, tmp_path):
    for name, reason in (
        ("a.txt", "neither doors nor moving"),
        ("a.xyz", "no format for mazes"),
        ("no/a.maze", "written"),
    ):
        with pytest.raises(MazeError, match=reason):
            write_maze(final, tmp_path / name)


def _png(image):
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, "PNG")
    return buffer.getvalue()


ROOM = "start 1 1 0\nwall 0 0 2 0 2 2 0 2 0 1.5\nwall 0 0 0 0.5\nexit 0 0.5 0 1.5\n"


@pytest.mark.parametrize(
    ("content", "place", "reason"),
    [
        ("wall 0 0 1 1\n", (None, None), "no start"),
        (ROOM.replace("start 1 1 0", "start 1 1 0 spread 0.7 0.7 0"), (1, None), "nearer than 1.21 m"),
        (ROOM + "wal 0 0 1 1\n", (5, 1), "the word `wal` is unknown"),
        (ROOM + "wall 0 0 1\n", (5, 11), "a y in metres is missing"),
        (ROOM + "wall 0 0 1 x\n", (5, 12), "should be a number, not `x`"),
        (ROOM + "wall 0 0 1 nan\n", (5, 12), "should be a number|finite"),
        (ROOM + "wall 1 1\n", (5, 9), "at least 2 points"),
        (ROOM + "wall 1 1 1 1\n", (5, 12), "the same"),
        (ROOM + "start 1 1.95 0\n", (5, None), "does not fit at its start"),
        (ROOM + "door a 0 0 1 0 speed 0\n", (5, 22), "greater than zero"),
        (ROOM + "door a 0 0 1 0 2 0\n", (5, 18), "two ends"),
        (ROOM + "limit 3 4\n", (5, 9), "superfluous"),
        (ROOM.replace("start 1 1 0", "start 0.1 0.2 0"), (1, None), "does not fit at its start"),
        (ROOM.replace("wall 0 0 0 0.5\n", ""), (3, None), "does not separate the inside"),
        (ROOM + "wall 0 0.4 0 1.6\n", (1, None), "no way leads"),
        (ROOM + "wall 0 0.4 0 1.1\n", (4, None), "only about 0.4"),
    ],
)
def test_a_bad_maze_file_is_refused_with_place_and_reason(content, place, reason, tmp_path):
    path = tmp_path / "bad.maze"
    path.write_text(content)
    with pytest.raises(MazeError, match=reason) as caught:
        read_maze(path, radius=RobotDescription().radius)
    if place != (None, None):
        assert (caught.value.line, caught.value.column) == place
    assert str(caught.value).startswith(str(path))


CELLS = (MAZES / "cells.txt").read_text()


@pytest.mark.parametrize(
    ("content", "place", "reason"),
    [
        (CELLS.replace("G", "x"), (4, 11), "`x` is not allowed here"),
        (CELLS.replace("o   o   o---o   o", "o   x   o---o   o", 1), (3, 5), "a post `o` is missing"),
        (CELLS.replace("o---o   o   o   o", "o-- o   o   o   o", 1), (5, 2), "`-- ` cannot be between two posts"),
        (CELLS + "|   \n", (10, None), "2H.1 lines"),
        (CELLS.replace("| S             |", "| S             |    |"), (8, 18), "longer than the first"),
        (
            CELLS.replace("|       | G |", "|       | G |").replace("o---o   o   o   o", "o---o   o---o   o"),
            (4, 11),
            "no way",
        ),
    ],
)
def test_a_bad_micromouse_maze_is_refused_with_place_and_reason(content, place, reason, tmp_path):
    path = tmp_path / "bad.txt"
    path.write_text(content)
    with pytest.raises(MazeError, match=reason) as caught:
        read_maze(path, radius=RobotDescription().radius)
    assert (caught.value.line, caught.value.column) == place


@pytest.mark.parametrize(
    ("content", "line", "reason"),
    [
        ("0 0 1 1 1 1\n0 1 1 1 0 x\n", 2, "a cell is"),
        ("0 0 1 1 1 1\n0 0 1 1 1 1\n", 2, "given in line 1 already"),
        ("0 0 1 1 1 1\n1 1 1 1 1 1\n", None, r"cell \(0, 1\) is missing"),
        ("0 0 0 1 1 1\n0 1 1 1 1 1\n", 1, "disagree about the wall"),
        ("0 0 1 1 1 1\n0 1 1 1 1 1\n", 2, "no way leads"),
    ],
)
def test_a_bad_mms_maze_is_refused_with_line_and_reason(content, line, reason, tmp_path):
    path = tmp_path / "bad.num"
    path.write_text(content)
    with pytest.raises(MazeError, match=reason) as caught:
        read_maze(path, radius=RobotDescription().radius)
    assert caught.value.line == line


def test_a_bad_image_is_refused(tmp_path):
    white = np.full((80, 80), 255, dtype=np.uint8)
    closed = white.copy()
    closed[10:70, 10:70] = 0
    closed[12:68, 12:68] = 255
    off_centre = np.full((200, 200), 255, dtype=np.uint8)
    off_centre[10:60, 10] = 0
    for image, reason, place in (
        (white, "no wall", (None, None)),
        (off_centre, "lies outside", (101, 101)),
    ):
        path = tmp_path / "bad.png"
        path.write_bytes(_png(image))
        with pytest.raises(MazeError, match=reason) as caught:
            read_maze(path, radius=RobotDescription().radius)
        assert (caught.value.line, caught.value.column) == place
    path.write_bytes(_png(closed)[:60])
    with pytest.raises(MazeError, match="cannot be decoded"):
        read_maze(path, radius=RobotDescription().radius)


def test_a_file_that_is_not_there_or_no_text_is_refused(tmp_path):
    with pytest.raises(MazeError, match="cannot be read"):
        read_maze(tmp_path / "none.maze", radius=RobotDescription().radius)
    (tmp_path / "binary.maze").write_bytes(b"start 1 1 0\n\xff\xfe")
    with pytest.raises(MazeError, match="neither an image nor text") as caught:
        read_maze(tmp_path / "binary.maze", radius=RobotDescription().radius)
    assert caught.value.line == 2


def test_every_key_of_the_text_format_is_read():
    lines = [
        "name the yard  # a comment",
        "limit none",
        "start 1 2 180 spread 0.1 0.2 5",
        "start 3 2 0",
        "wall 0 0 1 0 1 1",
        "door gate 0 0 0 1 speed 0.2 stays 7",
        "object cart box 0.4 0.2 path 0 0 1 0 speed 0.5 near 2 returns",
        "object post outline 0.1 0 0 0.1 -0.1 0 path 3 3",
        "exit 5 5 5 6",
    ]
    maze = text.read(Source(Path("yard.maze"), "\n".join(lines).encode()), Choices()).maze
    assert maze.name == "the yard"
    assert maze.time_limit == math.inf
    assert maze.start.pose.heading == pytest.approx(math.pi)
    assert maze.start.spread.heading == pytest.approx(math.radians(5))
    assert [start.pose.x for start in maze.starts] == [1.0, 3.0]
    assert len(maze.walls) == 2
    (door,) = maze.doors
    assert (door.name, door.speed, door.stays) == ("gate", 0.2, 7.0)
    cart, post = maze.objects
    assert (cart.speed, cart.near, cart.returns, len(cart.path)) == (0.5, 2.0, True, 2)
    assert cart.outline[0] == (0.2, -0.1)
    assert (post.near, post.returns, len(post.outline)) == (math.inf, False, 3)
    again = text.read(Source(Path("yard.maze"), text.write(maze)), Choices()).maze
    assert (again.doors, again.objects, again.starts, again.time_limit) == (
        maze.doors,
        maze.objects,
        maze.starts,
        maze.time_limit,
    )


@pytest.mark.skipif(not FOREIGN.exists(), reason="the foreign mazes are not here")
def test_every_foreign_maze_is_read_and_can_be_solved():
    paths = sorted(FOREIGN.glob("*/*"))
    assert len(paths) > 40
    for path in paths:
        maze = read_maze(path, radius=RobotDescription().radius)
        assert shortest_way(maze, radius=RobotDescription().radius) is not None
        assert len(maze.exits) >= 1


def test_an_exit_that_is_not_drawn_is_found_and_faces_outwards(final, tmp_path):
    path = tmp_path / "open.maze"
    lines = text.write(final).decode().splitlines()
    path.write_text("\n".join(line for line in lines if not line.startswith("exit")))
    (found,) = read_maze(path, radius=RobotDescription().radius).exits.tolist()
    (drawn,) = final.exits.tolist()
    assert found == pytest.approx(drawn, abs=0.1)
