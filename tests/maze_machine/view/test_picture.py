"""Pictures of runs: they show what happened, and need no display."""

import numpy as np
import pytest
from PIL import Image

from maze_machine.view.palette import DOOR, EXIT, INKS
from maze_machine.view.run_figure import Scene, Trail, save_picture

SQUARE = np.array([[[0, 0], [4, 0]], [[4, 0], [4, 4]], [[4, 4], [0, 4]], [[0, 4], [0, 0]]], dtype=np.float64)
NONE = np.empty((0, 2, 2))


def colours(file):
    return {colour for _, colour in Image.open(file).convert("RGB").getcolors(1 << 24)}


def rgb(ink):
    return tuple(int(ink[at : at + 2], 16) for at in (1, 3, 5))


def trail(states=()):
    times = np.linspace(0, 10, 50)
    return Trail(times, np.column_stack([np.linspace(1, 3, 50), np.full(50, 2.0)]), states)


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf", "jpg"])
def test_the_suffix_decides_the_format(tmp_path, suffix):
    file = tmp_path / f"run.{suffix}"
    save_picture(file, Scene(SQUARE, NONE, NONE), trail(), "out")
    head = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF", "jpg": b"\xff\xd8"}[suffix]
    assert file.read_bytes().startswith(head)


def test_states_are_told_apart_by_colour(tmp_path):
    file = tmp_path / "run.png"
    save_picture(file, Scene(SQUARE, NONE, NONE), trail(["drive"] * 25 + ["turn"] * 25))
    assert {rgb(ink) for ink in INKS["light"][:2]} <= colours(file)


def test_doors_and_exits_are_shown_only_where_there_are_any(tmp_path):
    orange, green = rgb(DOOR), rgb(EXIT)
    file = tmp_path / "run.png"
    save_picture(file, Scene(SQUARE, SQUARE[:1] + 1.0, SQUARE[1:2]), trail())
    assert {orange, green} <= colours(file)
    save_picture(file, Scene(SQUARE, NONE, NONE), trail())
    assert not {orange, green} & colours(file)


@pytest.mark.parametrize("walls", [SQUARE, NONE])
@pytest.mark.parametrize("points", [0, 1, 2])
def test_a_short_trail_or_no_walls_are_no_reason_to_fail(tmp_path, walls, points):
    full = trail()
    save_picture(tmp_path / "run.png", Scene(walls, NONE, NONE), Trail(full.times[:points], full.positions[:points]))
    assert (tmp_path / "run.png").stat().st_size > 0


def test_many_states_give_way_to_time(tmp_path):
    save_picture(tmp_path / "run.png", Scene(SQUARE, NONE, NONE), trail([f"s{index}" for index in range(50)]))
    assert (253, 231, 37) in colours(tmp_path / "run.png")  # the upper end of viridis, in the colour bar
