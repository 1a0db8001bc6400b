"""Files from anywhere: read whatever editor wrote them, or refused in one line, soon and in little memory."""

import os
import struct
import tracemalloc
import zlib
from pathlib import Path

import pytest

from sim.formats import Choices, read_maze
from sim.maze import MazeError
from transport.description import RobotDescription

MAZES = Path(__file__).parent / "mazes"
CORRIDOR = "start 0.5 0.5 0\nwall 2 0  0 0  0 1  2 1\nexit 2 0  2 1\n"
EXAMPLES = {
    "a.maze": CORRIDOR,
    "a.txt": (MAZES / "cells.txt").read_text(),
    "a.num": (MAZES / "cells.num").read_text(),
}


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize(
    "written",
    [
        lambda text: text.encode("utf-8-sig"),
        lambda text: text.replace("\n", "\r\n").encode(),
        lambda text: text.replace("\n", "\r").encode(),
        lambda text: text.encode("utf-16"),
        lambda text: b"\r\n\r\n# a comment\r\n" + text.encode() + b"\r\n\r\n# the end\r\n\r\n",
    ],
    ids=["byte order mark", "CRLF", "CR", "UTF-16", "comments and empty lines"],
)
def test_the_way_an_editor_writes_text_does_not_matter(tmp_path, name, written):
    (tmp_path / "plain").write_text(EXAMPLES[name])
    (tmp_path / "other").write_bytes(written(EXAMPLES[name]))
    plain, other = (
        read_maze(tmp_path / "plain", radius=RobotDescription().radius),
        read_maze(tmp_path / "other", radius=RobotDescription().radius),
    )
    assert plain.walls.tolist() == other.walls.tolist()
    assert (plain.start, plain.exits.tolist()) == (other.start, other.exits.tolist())


def test_a_byte_order_mark_does_not_shift_places(tmp_path):
    (tmp_path / "a.maze").write_bytes("start 0.5 0.5 x".encode("utf-8-sig"))
    with pytest.raises(MazeError) as caught:
        read_maze(tmp_path / "a.maze", radius=RobotDescription().radius)
    assert (caught.value.line, caught.value.column) == (1, 15)


SMALL = "o---o---o---o\n|       | G |\no   o---o   o\n| S         |\no---o---o---o\n"


@pytest.mark.parametrize(
    "drawn",
    [
        SMALL.replace("S", " ").replace("G", " ").replace("o   o---o   o\n|  ", "o   o---o   o\n|  "),
        SMALL.replace("o", "+"),
        SMALL.replace("   |", " . |"),
        SMALL.replace("S", "s").replace("G", "g"),
        SMALL.replace("o", "."),
        "".join(f"    {line}\n" for line in SMALL.splitlines()),
        "+-+-+-+\n|   |G|\n+ +-+ +\n|S    |\n+-+-+-+\n",
        "+--+--+--+\n|     |G |\n+  +--+  +\n|S       |\n+--+--+--+\n",
        "o===o===o===o\n|       | G |\no   o===o   o\n| S         |\no===o===o===o\n",
    ],
    ids=["no marks", "+", "dots", "small letters", "posts as dots", "indented", "narrow", "two wide", "="],
)
def test_micromouse_drawings_in_their_variants(tmp_path, drawn):
    (tmp_path / "small.txt").write_text(SMALL)
    (tmp_path / "other.txt").write_text(drawn)
    expected, maze = (
        read_maze(tmp_path / "small.txt", radius=RobotDescription().radius),
        read_maze(tmp_path / "other.txt", radius=RobotDescription().radius),
    )
    assert maze.walls.tolist() == expected.walls.tolist()
    if "G" in drawn.upper():
        assert maze.start == expected.start
    else:
        assert (maze.start.pose.x, maze.start.pose.y) == (1.5, 1.5)


def test_a_mark_in_the_middle_is_no_entrance(tmp_path):
    (tmp_path / "a.txt").write_text((MAZES / "cells.txt").read_text().replace("S", " ").replace("G", "S"))
    with pytest.raises(MazeError, match="not at the outer wall") as caught:
        read_maze(tmp_path / "a.txt", radius=RobotDescription().radius)
    assert (caught.value.line, caught.value.column) == (4, 11)


def png(columns, rows, content=b"", colour=0):
    """A PNG that declares a size, with whatever pixels."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", columns, rows, 8, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", content) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (png(13_000, 13_000, zlib.compress(bytes(100_000))), "13000 x 13000 pixels"),
        (png(2_000_000_000, 2_000_000_000), "pixels|decoded"),
        (b"P5\n30000 30000\n255\n", "more than 25 million pixels"),
        (b"P6 9 9999999 255\n", "pixels"),
        (b"P5\n9000 2\n255\n" + bytes(18_000), "225 by 0.05 m"),
        (b"BM" + bytes(100), "cannot be decoded"),
        (b"GIF89a" + bytes(100), "cannot be decoded"),
        (b"\xff\xd8\xff" + bytes(100), "cannot be decoded"),
    ],
)
def test_an_image_is_judged_by_its_declared_size(tmp_path, content, reason):
    (tmp_path / "a.png").write_bytes(content)
    tracemalloc.start()
    with pytest.raises(MazeError, match=reason) as caught:
        read_maze(tmp_path / "a.png", radius=RobotDescription().radius)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20e6
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "content",
    [
        png(40, 40, zlib.compress(bytes(40 * 41)), colour=3),
        b"P5\n" + b"9" * 5000 + b" 3\n255\n",
        b"P2\n3 3\n255\n1 2 3 4 5 6 7 8 x",
        b"P5\nx y\n",
    ],
    ids=["a palette that is missing", "digits without end", "a word among numbers", "words for a size"],
)
def test_a_damaged_image_is_refused_in_words(tmp_path, content):
    (tmp_path / "a.png").write_bytes(content)
    with pytest.raises(MazeError) as caught:
        read_maze(tmp_path / "a.png", radius=RobotDescription().radius)
    assert "cannot be decoded: it is damaged" in str(caught.value)


def test_noise_is_no_map(tmp_path):
    rows = columns = 1500
    line = bytes(255 * (column % 2) for column in range(columns + 1))
    pixels = b"".join(line[row % 2 :][:columns] for row in range(rows))
    (tmp_path / "a.pgm").write_bytes(b"P5\n%d %d\n255\n" % (columns, rows) + pixels)
    with pytest.raises(MazeError, match="photograph, or noise"):
        read_maze(tmp_path / "a.pgm", radius=RobotDescription().radius)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (CORRIDOR + "object o box 1e300 1e300 path 1 1", "10 km"),
        (CORRIDOR + "object o box 1 1 path 1e300 1 1 1", "10 km"),
        (CORRIDOR + "object o box 1 1 path 0 9000", "more than 200 m"),
        (CORRIDOR + "object o outline 0 0 1 0 300 300 path 0 0", "more than 200 m"),
        (CORRIDOR + "object o box 1 1 path 0 0 1 1 speed 1e300", "100 m/s"),
        (CORRIDOR + "object o box -1 1 path 0 0 1 1", "longer and wider"),
        (CORRIDOR + "door d 0 0 1 1 speed 1e9", "100 m/s"),
        (CORRIDOR + "wall 0 0 1e300 1", "10 km"),
        (CORRIDOR + "wall 0 0 190 190", "more than 200 m or 20000 m2"),
        (CORRIDOR + "goal 0 1e300", "10 km"),
        (CORRIDOR + "x" * 200_000, "more than 100000 characters"),
        ("wall " + "0 0 1 1 " * 10_000 + "\n", "no start"),
        ("wall " + "0 0 1 1 " * 10_000 + "\n" + ("wall " + "0 0 1 1 " * 10_000 + "\n") * 10, "more than 100000 pieces"),
        ("x" * 9_000_000, "8 MB of text"),
        (CORRIDOR + "\x1b]0;title\x07 1 2", r"\?\]0;title\?"),
        ("9999 9999 1 1 1 1\n", r"cell \(0, 0\) is missing"),
        ("0 0 1 1 1 1\n²2 0 1 1 1 1\n", "a cell is"),
        ("1" * 5000 + " 0 1 1 1 1\n", "a cell is"),
        ("o" + "---o" * 20_000, "x 0 cells|do not fit|more than 200 m"),
    ],
)
def test_absurd_text_is_refused_in_one_line(tmp_path, content, reason):
    (tmp_path / "a.maze").write_text(content)
    with pytest.raises(MazeError, match=reason) as caught:
        read_maze(tmp_path / "a.maze", radius=RobotDescription().radius)
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < 600


def test_a_name_from_a_file_cannot_write_to_the_terminal(tmp_path):
    (tmp_path / "a.maze").write_text(CORRIDOR + "name \x1b[2J gone\n")
    assert read_maze(tmp_path / "a.maze", radius=RobotDescription().radius).name == "?[2J gone"


def test_cells_are_not_larger_than_the_largest_maze(tmp_path):
    with pytest.raises(MazeError, match="check the metres a cell"):
        read_maze(MAZES / "cells.txt", Choices(metres_a_cell=60.0), radius=RobotDescription().radius)


@pytest.mark.parametrize("special", ["/dev/zero", "/dev/null", "/dev/full", "folder", "pipe", "loop"])
def test_what_is_no_regular_file_is_refused(tmp_path, special):
    path = tmp_path / special if not special.startswith("/") else Path(special)
    if special == "folder":
        path.mkdir()
    if special == "pipe":
        os.mkfifo(path)
    if special == "loop":
        path.symlink_to(path)
    with pytest.raises(MazeError, match=r"not a regular file|cannot be read"):
        read_maze(path, radius=RobotDescription().radius)
