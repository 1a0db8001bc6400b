"""Whatever a file holds, it is read or refused with a `MazeError`, never anything else."""

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from sim.formats import read_maze, write_maze
from sim.maze import MazeError
from sim.solvability import shortest_way

WORDS = ["wall", "start", "exit", "door", "object", "name", "limit", "box", "outline", "path", "speed", "near", "#"]
number = st.one_of(st.integers(-3, 5), st.sampled_from([0.5, 1e300, -1e-300, 1e9])).map(str)
word = st.one_of(st.sampled_from(WORDS), number, number, number, st.text(max_size=3))
line = st.lists(word, max_size=9).map(" ".join)
drawing = st.text(alphabet="o|- SG\n", max_size=80)
cells = st.lists(st.lists(st.integers(0, 2).map(str), min_size=6, max_size=6).map(" ".join), max_size=6).map("\n".join)


def read_or_refuse(path):
    try:
        maze = read_maze(path)
    except MazeError as error:
        refusal = str(error)
    else:
        assert shortest_way(maze) is not None
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
