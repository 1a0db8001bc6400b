"""Pictures of runs: they show what happened, and need no display."""

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from maze_machine.catalogue.profile import load_profile
from maze_machine.cli import app
from maze_machine.drive.mission import drive, prepare
from maze_machine.drive.replay import Keeper
from maze_machine.report.pages import said_of
from maze_machine.report.run_plot import plotted
from maze_machine.simulated.world import SimulatedWorld, find_maze
from maze_machine.view.palette import DOOR, EXIT, INKS
from maze_machine.view.run_figure import Scene, Trail, save_picture
from maze_machine.view.run_plot import RunSeries, save_plot
from transport.description import RobotDescription
from transport.recording import Recorder, read_recording
from transport.world import LockstepRobot

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


@pytest.mark.parametrize("suffix", ["png", "svg"])
def test_a_plot_shows_the_path_the_curves_and_the_lanes(tmp_path, suffix):
    file = tmp_path / f"run.{suffix}"
    states = ["drive"] * 25 + ["turn"] * 25
    times = np.linspace(0, 10, 50)
    course = RunSeries(
        times, np.full(50, 0.5), np.zeros(50), np.full(50, 0.3), {"solve": states, "watch": ["well"] * 50}
    )
    save_plot(file, Scene(SQUARE, NONE, NONE), trail(states), course, "out")
    if suffix == "png":
        assert {rgb(ink) for ink in INKS["light"][:2]} <= colours(file)
    else:
        assert file.read_bytes().startswith(b"<?xml")


def test_a_recording_becomes_a_plot(tmp_path):
    profile, file = load_profile(), tmp_path / "run.mcap"
    mission = prepare("pledge", profile, time_limit=3.0)
    world = SimulatedWorld(find_maze("final_2015", robot=RobotDescription()), profile.robot)
    robot = LockstepRobot(world)
    with Recorder(file, "pico", said_of(mission, world), patience=10.0) as recorder:
        drive(mission, robot, robot, [Keeper(recorder)], truth=world.pose)
    scene, path, course = plotted(read_recording(file), profile.robot)
    assert len(scene.walls) == len(world.maze.barriers)
    assert [tuple(place) for place in path.positions] == [(one.x, one.y) for one in map(world.pose, range(31))]
    assert set(course.lanes) == {"solve", "watch"}
    assert course.speeds.max() == pytest.approx(0.5, abs=0.05)
    assert 0.1 < np.nanmin(course.clearances) < 0.6
    done = CliRunner().invoke(app, ["plot", str(file), "-o", str(tmp_path / "run.svg")])
    assert (done.exit_code, done.output) == (0, f"{tmp_path / 'run.svg'}\n")
    assert CliRunner().invoke(app, ["plot", str(file), "-o", "run.gif"]).exit_code == 2
