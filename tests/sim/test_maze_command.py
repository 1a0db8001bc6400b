"""``maze-machine maze``, and what `run` takes for the embedded simulator."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from maze_machine.cli import app


def invoke(*arguments):
    ended = CliRunner().invoke(app, [str(argument) for argument in arguments], env={"COLUMNS": "200"})
    assert "Traceback" not in ended.output
    return ended


def test_generate_convert_and_show_go_together(tmp_path):
    drawn, image, picture = tmp_path / "a.maze", tmp_path / "a.pgm", tmp_path / "a.svg"
    assert invoke("maze", "generate", drawn, "--seed", 3, "--doors", 1).exit_code == 0
    assert invoke("maze", "convert", drawn, image, "--metres-a-pixel", 0.05).exit_code == 0
    shown = invoke("maze", "show", image, "--metres-a-pixel", 0.05, "--picture", picture)
    assert shown.exit_code == 0
    assert "1 door" in shown.stdout
    assert picture.read_text().startswith("<?xml")


def test_a_maze_is_not_converted_over_itself(tmp_path):
    drawn = tmp_path / "a.maze"
    invoke("maze", "generate", drawn, "--seed", 3)
    before = drawn.read_bytes()
    ended = invoke("maze", "convert", drawn, tmp_path / "." / "a.maze")
    assert (ended.exit_code, drawn.read_bytes()) == (2, before)
    assert "would overwrite what is read" in ended.stderr


def test_the_same_seed_writes_the_same_bytes(tmp_path):
    for name in ("a.maze", "b.maze"):
        invoke("maze", "generate", tmp_path / name, "--seed", 8, "--skew", 3, "--islands", 1)
    invoke("maze", "generate", tmp_path / "c.maze", "--seed", 9, "--skew", 3, "--islands", 1)
    first, second, other = ((tmp_path / name).read_bytes() for name in ("a.maze", "b.maze", "c.maze"))
    assert first == second != other


@pytest.mark.parametrize(
    ("arguments", "status", "told"),
    [
        (["maze", "show", "final_2051"], 3, "did you mean `final_2015`?"),
        (["maze", "show", "final_2015", "--picture", "x.bmp"], 3, "a picture is"),
        (["maze", "convert", "final_2015", "x.txt"], 3, "cannot hold this maze"),
        (["maze", "convert", "final_2015", "x.doc"], 3, "no format for mazes is named `.doc`"),
        (["maze", "generate", "x.maze", "--size", "9"], 2, "`--size` must be columns x rows, not '9'; write 6x5"),
        (["maze", "generate", "x.maze", "--size", "2x2"], 2, "`--size` must be"),
        (["maze", "generate", "x.maze", "--size", "3x3", "--doors", "4"], 3, "request more cells"),
        (["maze", "generate", "x.maze", "--corridor", "2", "--doors", "1"], 2, "1.5 m wide"),
        (["maze", "show", "final_2015", "--start", "1 2"], 2, "--start '1 2': a heading in degrees is missing"),
        (["maze", "show", "final_2015", "--exit", "1 2 1 2"], 2, "--exit '1 2 1 2': two points in a row are the same"),
        (["maze", "show", "final_2015", "--goal", "away"], 2, "--goal 'away': an x in metres should be a number"),
        (["maze", "show", "final_2015", "--goal", "1e5 0"], 2, "at most 10 km from the origin"),
        (
            ["maze", "show", "final_2015", "--objects", "/dev/zero"],
            3,
            "/dev/zero: cannot be read: it is not a regular file",
        ),
        (["maze", "show", "final_2015", "--set", "robot.footprint=[[1,1],[-1,1],[-1,-1],[1,-1]]"], 3, "does not fit"),
        (["maze", "show", "/dev/zero"], 3, "`/dev/zero` is not a regular file"),
        (["run", "pledge", "--goal", "none", "--connect", "tcp/127.0.0.1:1"], 2, "cannot be combined with --connect"),
        (["run", "pledge", "--simulate", "rules.lax=1"], 2, "unknown key `lax`; known: still_limit"),
        (["run", "pledge", "--simulate", "rule.lax=1"], 2, "unknown section `rule`; known: noise"),
        (["run", "pledge", "--simulate", "noise.size=-1"], 2, "must be at least 0"),
        (["run", "pledge", "--simulate", "noise.size"], 2, "write section.key=value"),
        (["run", "pledge", "--fault", "door_jammed"], 2, "door_jammed"),
        (
            ["run", "pledge", "--speed", "2", "--connect", "tcp/127.0.0.1:1"],
            2,
            "--speed cannot be combined with --connect",
        ),
    ],
)
def test_wrong_input_is_told_in_one_line(arguments, status, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ended = invoke(*arguments)
    assert ended.exit_code == status
    assert told in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


def test_a_fault_befalls_the_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ended = invoke("run", "pledge", "--no-picture", "--time-limit", "150", "--fault", "door_stuck door=front")
    assert ended.exit_code == 1
    assert "doors opened                 none" in ended.stdout


def test_a_faster_simulation_is_the_same_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    traces = []
    for name, options in (("a", []), ("b", ["--speed", "1000"])):
        invoke("run", "pledge", "--no-picture", "--time-limit", "5", "--trace", name, *options)
        traces.append((tmp_path / name).read_bytes())
    assert traces[0] == traces[1]
    assert traces[0]


def test_a_map_is_driven_to_a_goal(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rooms = Path(__file__).parent / "mazes" / "rooms.yaml"
    shown = invoke("maze", "show", rooms, "--no-picture")
    assert shown.stdout.endswith("no doors, no moving objects, no exits, goal: touching nothing\n")
    ended = invoke("run", "right_hand", "--maze", rooms, "--goal", "2.9 -0.4 0.4", "--no-picture", "--json")
    told = json.loads(ended.stdout)
    assert (ended.exit_code, told["solved"]) == (0, True)
    assert told["verdict"]["goal"] == "coming within 0.4 m of (2.90, -0.40) m"
    assert told["verdict"]["outcome"] == "reached the goal"


def test_where_nothing_is_to_be_done_a_run_ends_at_its_limit_unharmed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rooms = Path(__file__).parent / "mazes" / "rooms.yaml"
    ended = invoke("run", "pledge", "--maze", rooms, "--time-limit", "3", "--no-picture")
    assert ended.exit_code == 0
    assert "judged                       touching nothing" in ended.stdout
