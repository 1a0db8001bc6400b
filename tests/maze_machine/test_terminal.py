"""A run in a terminal: what a person sees of it, and that it is paused, stepped, stopped and left."""

import asyncio
import threading

import pytest
from typer.testing import CliRunner

from maze_machine.catalogue.profile import load_profile
from maze_machine.cli import app
from maze_machine.drive.mission import drive, prepare
from maze_machine.remote.operated import OperatedRun
from maze_machine.report.text_plan import text_plan
from maze_machine.simulated.world import SimulatedWorld, find_maze
from transport.description import RobotDescription
from transport.messages import Pose
from transport.world import LockstepRobot

SQUARE = [[0, 0, 4, 0], [4, 0, 4, 4], [4, 4, 0, 4], [0, 4, 0, 0]]


def test_a_plan_has_walls_the_way_and_the_robot():
    drawn = text_plan(SQUARE, [(1.0, 1.0), (2.0, 1.0)], Pose(2.0, 1.0, 1.57), 30, 15)
    assert len(drawn) <= 15
    assert max(map(len, drawn)) <= 30
    row = next(number for number, line in enumerate(drawn) if "↑" in line)
    assert row > len(drawn) / 2
    assert max(len(line.strip()) for line in drawn) > 20
    assert text_plan([], [], Pose(0.0, 0.0, 3.1), 5, 3)[1].strip() == "←"
    assert text_plan(SQUARE, [], Pose(0.0, 0.0, 0.0), 0, 0) == []


@pytest.fixture
def terminal():
    pytest.importorskip("textual", reason="textual is not installed")
    from maze_machine.report.terminal import RunTerminal, TerminalRun  # noqa: PLC0415 - an extra

    mission = prepare("pledge", load_profile(), time_limit=60.0)
    world = SimulatedWorld(find_maze("final_2015", robot=RobotDescription()), mission.profile.robot)
    operated, shown, robot = OperatedRun(mission, pausable=True), TerminalRun(), LockstepRobot(world)
    operated.answer(b'{"kind": "advance", "ticks": 30}')

    def work():
        shown.end(drive(mission, robot, None, [shown, operated], operator=operated, truth=world.pose))

    return RunTerminal("pledge", shown, world.maze.barriers.tolist(), operated.answer, work), shown


async def until(pilot, condition):
    for _ in range(600):
        await pilot.pause(0.05)
        if condition():
            return
    raise AssertionError("it did not come to that")


@pytest.mark.parametrize("size", [(80, 24), (120, 40)])
def test_a_run_is_seen_paused_stepped_and_stopped(terminal, size):
    made, shown = terminal

    def text(name):
        return str(made.query_one(f"#{name}").render())

    async def follow():
        async with made.run_test(size=size) as pilot:
            await until(pilot, lambda: shown.tick is not None and shown.tick.index == 29)
            await until(pilot, lambda: shown.tick.doing in text("now"))
            assert text("states").splitlines() == list(shown.tick.configuration)
            model = shown.tick.report.machine.model
            own = [one for one in model.transitions if model.states[one.source].name == shown.tick.doing]
            assert own
            assert all(f"{one.place.line}: on " in text("why") for one in own)
            assert any(arrow in text("plan") for arrow in "→↗↑↖←↙↓↘")
            assert "cruise = 0.5 m/s" in text("facts")
            assert len(text("plan").splitlines()) > size[1] / 2
            await pilot.press("space")
            await pilot.press("full_stop")
            await until(pilot, lambda: shown.tick.index == 30)
            await pilot.press("s")
            await until(pilot, lambda: "The base has stopped" in text("status"))
            assert "an operator ended the run" in text("status")
            await pilot.press("q")

    asyncio.run(follow())
    assert made.failure is None
    assert not any(one.name == "run" and one.is_alive() for one in threading.enumerate())


def test_without_a_terminal_it_is_one_message():
    done = CliRunner().invoke(app, ["run", "pledge", "--tui", "--no-picture"])
    assert done.exit_code == 2
    assert "--tui needs" in done.stderr
    assert "Traceback" not in done.stderr
