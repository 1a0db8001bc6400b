"""Wrong input gets one clear message and an exit status, never a traceback."""

import pytest
from typer.testing import CliRunner

from maze_machine.cli import app

BROKEN = """\
machine broken
initial here
state here
    do drive(sped = 0.3 m/s)
    on done -> nowhere
"""

SPINNING = """\
machine spinning
var count : int = 0
initial one
state one
    when count >= 0 -> two / count += 1
state two
    when count >= 0 -> one / count += 1
"""


def run(*arguments):
    ended = CliRunner().invoke(app, ["run", *map(str, arguments), "--no-picture"], env={"COLUMNS": "200"})
    assert "Traceback" not in ended.output
    assert ended.exception is None or isinstance(ended.exception, SystemExit)
    return ended.exit_code, ended.stderr


@pytest.mark.parametrize(
    ("arguments", "status", "told"),
    [
        (["plegde"], 3, "there is no machine `plegde`; did you mean `pledge`?"),
        (["zzzz"], 3, "known machines: "),
        (["nothing.maze-machine"], 3, "there is no machine `nothing.maze-machine`"),
        (["pledge", "--maze", "final_2051"], 3, "did you mean `final_2015`?"),
        (["pledge", "--maze", "nothing.pgm"], 3, "there is no maze `nothing.pgm`"),
        (["pledge", "--robot", "nobody"], 3, "there is no profile `nobody`"),
        (["pledge", "--param", "cruise"], 2, "write --param name=value"),
        (["pledge", "--param", "cruise=fast"], 2, "m/s"),
        (["pledge", "--param", "crusie=1"], 2, "did you mean `cruise`?"),
        (["pledge", "--set", "robot.limits.speed=-1"], 2, "must be at least 0.001"),
        (["pledge", "--maze", "final_2015", "--connect", "tcp/127.0.0.1:1"], 2, "--maze does not go with --connect"),
        (["pledge", "--picture", "path.xyz"], 2, ".png"),
        (["pledge", "--trace", "no/such/folder/trace"], 3, "no/such/folder/trace: No such file or directory"),
        (["pledge", "--connect", "nonsense"], 2, "tcp/HOST:PORT"),
        (["pledge", "--set", "robot.name=a b"], 2, "must be letters, digits, - and _, a letter first, not 'a b'"),
        (["pledge", "--set", "robot.laser.angle_max=200"], 2, "200 degrees are 3.4907 rad"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_it_is_told_in_one_line(arguments, status, told):
    ended, err = run(*arguments)
    assert ended == status, err
    assert told in err
    assert len(err.splitlines()) == 1


def test_nobody_at_the_address(endpoint):
    ended, err = run("pledge", "--connect", endpoint)
    assert ended == 4
    assert endpoint in err
    assert len(err.splitlines()) == 1


def test_a_busy_port(finish, simulator):
    _, endpoint = simulator()
    ended, _, err = finish("sim", "final_2015", "--listen", endpoint)
    assert ended == 4
    assert endpoint in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("mode", [["--realtime"], ["--set", "link.gate=false"]])
def test_real_time_has_no_other_speed(endpoint, mode):
    ended = CliRunner().invoke(app, ["sim", "corridor", "--listen", endpoint, *mode, "--speed", "4"])
    assert ended.exit_code == 2
    assert "--speed is for a simulator that waits" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


def test_a_machine_that_does_not_parse_is_told_with_line_column_and_caret(tmp_path):
    file = tmp_path / "broken.maze-machine"
    file.write_text(BROKEN)
    ended, err = run(file)
    assert ended == 3
    assert f"{file}:4:14" in err
    assert "do drive(sped = 0.3 m/s)" in err, "the source line"
    assert "^^^^" in err
    assert "speed" in err, "a suggestion"
    assert "nowhere" in err, "all faults in one run"


@pytest.mark.parametrize("text", ["", "start 0 0 0", "name x\nstart 1 1 0\nwall 0 0 2 0 2 2 0 2 0 0\n"])
def test_a_maze_without_a_way_out_is_refused_with_the_reason(tmp_path, text):
    file = tmp_path / "box.maze"
    file.write_text(text)
    ended, err = run("pledge", "--maze", file)
    assert ended == 3
    assert str(file) in err
    assert len(err.splitlines()) == 1


def test_a_machine_that_fails_while_it_runs_stops_the_robot_and_names_its_line(tmp_path):
    file = tmp_path / "spinning.maze-machine"
    file.write_text(SPINNING)
    ended, err = run(file)
    assert ended in (1, 3), "whether the checker finds the spin or the run does"
    assert f"{file}:" in err


@pytest.mark.parametrize(
    ("arguments", "known"),
    [
        (["export", "pledge", "-o"], ".scxml or .rrd"),
        (["import", "lift.scxml", "-o"], ".maze-machine"),
        (["diagram", "pledge", "-o"], ".svg or .png or .dot or .mmd"),
        (["plot", "run.mcap", "-o"], ".svg or .png or .pdf or .jpg"),
        (["view", "run.mcap", "-o"], ".html"),
        (["view", "run.mcap", "--foxglove"], ".json"),
        (["test", "pledge", "--generate", "--output"], ".maze-test"),
        (["run", "pledge", "--picture"], ".png or .svg or .pdf or .jpg"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
@pytest.mark.parametrize("name", ["x.foo", "x"])
def test_a_suffix_that_names_no_format_is_refused(tmp_path, monkeypatch, arguments, known, name):
    monkeypatch.chdir(tmp_path)
    ended = CliRunner().invoke(app, [*arguments, name])
    assert ended.exit_code == 2
    assert f"use {known}\n" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1
    assert not list(tmp_path.iterdir())
