"""Whatever a file holds, it is read or refused with a `MazeError`, never anything else."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from sim.formats import Choices, read_maze, write_maze
from sim.maze import MazeError, Nothing
from sim.solvability import shortest_way
from transport.description import RobotDescription

WORDS = ["wall", "start", "exit", "door", "object", "name", "limit", "box", "outline", "path", "speed", "near", "#"]
number = st.one_of(st.integers(-3, 5), st.sampled_from([0.5, 1e300, -1e-300, 1e9])).map(str)
word = st.one_of(st.sampled_from(WORDS), number, number, number, st.text(max_size=3))
line = st.lists(word, max_size=9).map(" ".join)
drawing = st.text(alphabet="o|- SG\n", max_size=80)
cells = st.lists(st.lists(st.integers(0, 2).map(str), min_size=6, max_size=6).map(" ".join), max_size=6).map("\n".join)


def read_or_refuse(path):
    try:
        maze = read_maze(path, radius=RobotDescription().radius)
    except MazeError as error:
        refusal = str(error)
    else:
        assert maze.goal == Nothing() or shortest_way(maze, radius=RobotDescription().radius) is not None
        write_maze(maze, path.with_suffix(".again.maze"))
        return
    assert refusal.startswith(str(path))
    assert "\n" not in refusal


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


@given(content=st.one_of(st.lists(line, max_size=8).map("\n".join), drawing, cells))
def test_any_text(folder, content):
    path = folder / "any.maze"
    path.write_bytes(("start 1 1 0\n" + content if content[:1] == "w" else content).encode())
    read_or_refuse(path)


@given(content=st.binary(max_size=200), head=st.sampled_from([b"", b"P5", b"P5\n4 4\n255\n", b"\x89PNG\r\n\x1a\n"]))
def test_any_bytes(folder, content, head):
    path = folder / "any.bin"
    path.write_bytes(head + content)
    read_or_refuse(path)


keys = st.sampled_from(["image", "resolution", "origin", "negate", "mode", "occupied_thresh", "free_thresh"])
values = st.one_of(
    st.sampled_from(["rooms.pgm", "0.05", "[0, 0, 0]", "1", "scale", "raw", "[", "{", "&a", "*a", "!!x", "1e999"]),
    st.floats().map(str),
    st.text(max_size=6),
)
described = st.lists(st.tuples(keys, values).map(": ".join), max_size=9).map("\n".join)


@given(content=described, whole=st.booleans())
def test_any_description_of_a_map(folder, content, whole):
    head = "image: rooms.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n" if whole else ""
    (folder / "rooms.pgm").write_bytes((Path(__file__).parent / "mazes" / "rooms.pgm").read_bytes())
    path = folder / "any.yaml"
    path.write_text(head + content, encoding="utf-8", errors="replace")
    read_or_refuse(path)


nested = st.recursive(
    st.one_of(st.none(), st.booleans(), st.floats(), st.integers(), st.text(max_size=3)),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)
pose = st.lists(st.one_of(st.floats(), st.integers(-3, 3)), min_size=2, max_size=4)
thing = st.fixed_dictionaries(
    {"length": st.floats(), "width": st.floats(0.1, 2), "trigger_radius": st.floats(0, 9), "velocity": st.floats()}
    | {"repeat": st.booleans(), "init_pose": pose, "final_pose": pose}
)


@given(content=st.one_of(nested, st.fixed_dictionaries({"objects": st.lists(thing, max_size=3), "initial_pose": pose})))
def test_any_objects_of_the_course(folder, content):
    path = folder / "config.json"
    path.write_text(json.dumps(content))
    try:
        read_maze(
            Path(__file__).parent / "mazes" / "rooms.yaml", Choices(objects=path), radius=RobotDescription().radius
        )
    except MazeError as error:
        refusal = str(error)
        assert refusal.isprintable()


@given(seed=st.integers(0, 2**32), share=st.floats(0.0, 0.2), doors=st.integers(0, 30))
def test_any_image(folder, seed, share, doors):
    generator = np.random.default_rng(seed)
    image = np.full((40, 50), 255, dtype=np.uint8)
    image[5, 5:45] = image[35, 5:45] = image[5:35, 5] = 0
    image[generator.random(image.shape) < share] = 0
    image[generator.integers(0, 40, doors), generator.integers(0, 50, doors)] = 120
    image[15:25, 20:30] = 255
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, "PNG")
    path = folder / "any.png"
    path.write_bytes(buffer.getvalue())
    read_or_refuse(path)
