"""Absurd values end in one clear message and status 2 or 3, at once and in little memory."""

from __future__ import annotations

import math
import os

import pymunk
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from pymunk.autogeometry import convex_decomposition
from typer.testing import CliRunner

from maze_machine.catalogue.profile import Profile
from maze_machine.cli import app
from transport.description import RobotDescription
from transport.outline import outline_fault

DEEP = "[" * 3000 + "]" * 3000


def invoke(*arguments):
    ended = CliRunner().invoke(app, [str(argument) for argument in arguments], env={"COLUMNS": "200"})
    assert ended.exception is None or isinstance(ended.exception, SystemExit), ended.exception
    assert "\x1b" not in ended.output
    return ended


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("robot.period=1e300", "at most 10"),
        ("robot.period=1e-300", "at least 0.001"),
        ("robot.period=nan", "not nan"),
        ("robot.period=true", "must have a number for `period`, not true"),
        ("robot.laser.beams=false", "must have a number for `beams`, not false"),
        ("robot.limits.acceleration=1e-300", "at least 0.001"),
        (f"robot.name={'a' * 5000}", "letters, digits"),
        (f"link.command={'a' * 5000}", "a ROS name"),
        ("link.scan=**", "a ROS name"),
        ("link.odometry=a//b", "a ROS name"),
        ("link.door=\x1b[2Jx", "a ROS name"),
        ("robot.laser.beams=1000000000", "at most 100000"),
        ("robot.laser.range_min=20", "below `range_max`"),
        ("robot.laser.range_max=inf", "`robot.laser.range_max`"),
        ("robot.laser.angle_min=nan", "not nan"),
        ("robot.laser.angle_min=2.0", "below `angle_max`"),
        ("robot.laser.angle_max=200", "in radians"),
        ("robot.laser.mount_x=1e300", "at most 10"),
        ("robot.laser.mount_x=5", "outside the circle of 0.224 m"),
        ("robot.laser.mount_y=-0.3", "the laser is a part of the robot"),
        ("robot.laser.range_max=0.3", "needs 0.357 m to stop"),
        ("robot.limits.speed=100", "lower `limits.speed`"),
        ("robot.limits.acceleration=0.01", "its laser sees 10 m"),
        ("robot.footprint=[]", "corners"),
        ("robot.footprint=[[0,0],[1,0],[2,0]]", "with an area"),
        ("robot.footprint=[[0,0],[2,0],[2,2],[1,-0.5]]", "cross itself"),
        ("robot.footprint=[[0,0],[1e300,0],[0,1e300]]", "at most 10"),
        (f"robot.footprint={DEEP}", "nested too deep"),
        ("robot.limits.speed=1e300", "at most"),
        (f"robot.limits.speed={'9' * 5000}", "too many digits"),
        ("robot.name=../x", "letters, digits"),
        ("robot.name=\x1b[2J", "letters, digits"),
        ("link.connect=1e300", "at most"),
        ("perception.hough.step=1e-9", "at least"),
        ("perception.minimap.cell=1e-9", "at least"),
    ],
)
def test_a_setting_that_makes_no_sense_is_refused_by_name(setting, words):
    ended = invoke("run", "pledge", "--set", setting, "--no-picture")
    assert ended.exit_code == 2
    assert words in ended.stderr
    assert setting.partition("=")[0] in ended.stderr
    assert len(ended.stderr.splitlines()) == 1
    assert len(ended.stderr) < 400


@pytest.mark.parametrize(
    "arguments",
    [
        ["--speed", "inf"],
        ["--seed", "9" * 400],
        ["--library", "a" * 5000],
        ["--speed", "nan"],
        ["--time-limit", "nan"],
        ["--simulate", "substep=1e-300"],
        ["--simulate", "noise.size=nan"],
        ["--simulate", f"noise.size={DEEP}"],
        ["--simulate", "odometry.redraw=1e-300"],
        ["--fault", "odometry_jump by=1e300,0,0"],
        ["--fault", "command_late ticks=1000000000"],
        ["--param", "cruise=1e999 m/s"],
        ["--param", f"cruise={'(' * 3000}"],
    ],
    ids=lambda value: " ".join(value)[:40],
)
def test_an_option_that_makes_no_sense_is_refused(arguments):
    ended = invoke("run", "pledge", *arguments, "--no-picture")
    assert ended.exit_code == 2
    assert "Traceback" not in ended.output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["send", "--advance", "1000001"], "must be at most 1000000"),
        (["send", "a" * 1001], "at most 1000 characters"),
        (["send", "--set", f"a={'9' * 201}"], "at most 200 characters"),
        (["send", "--pause-at", "a" * 1001], "at most 1000 characters"),
        (["send", "go", "--connect", f"tcp/127.0.0.1:{'9' * 5000}"], "ports go from 1 to 65535"),
        (["watch", "--connect", "tcp/127.0.0.1:\N{ARABIC-INDIC DIGIT THREE}"], "is not an endpoint"),
        (["dap", "--listen", "9" * 5000], "is not a port"),
    ],
    ids=lambda value: " ".join(value)[:40] if isinstance(value, list) else "",
)
def test_what_no_machine_could_be_sent_is_refused_before_anything_is_dialled(arguments, words):
    ended = invoke(*arguments)
    assert ended.exit_code == 2
    assert words in " ".join(ended.stderr.split())
    assert len(ended.stderr) < 700


@pytest.mark.parametrize(
    "address",
    ["", "x", "\x1b[2J:1", "127.0.0.1:0", f"127.0.0.1:{'9' * 5000}", "ucx://127.0.0.1:1", "tls://127.0.0.1:1"],
)
def test_what_is_no_address_of_a_scheduler_is_refused(tmp_path, address):
    pytest.importorskip("distributed")
    jobs = ("--machines", "pledge", "--mazes", "corridor", "--out", tmp_path / "r.jsonl")
    ended = invoke("sweep", *jobs, "--scheduler", address)
    assert ended.exit_code == 2
    assert "scheduler" in ended.stderr or "needs certificates" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


def test_what_is_piped_in_need_not_be_text():
    formatted = CliRunner().invoke(app, ["fmt", "-"], input=b"\xff\xfe\n")
    assert formatted.exit_code == 3
    assert "standard input cannot be read: byte 1 is not UTF-8" in formatted.stderr
    tried = CliRunner().invoke(app, ["simulate", "pledge"], input=b"\xff\xfe\n")
    assert tried.exit_code == 1
    assert "a line begins with given" in tried.stderr


@pytest.mark.parametrize("command", ["check", "fmt", "import"])
def test_a_file_without_end_is_refused(command):
    ended = invoke(command, "/dev/zero")
    assert ended.exit_code == 3
    assert "/dev/zero cannot be read: it is larger than 32 MiB" in ended.output


def test_results_without_end_are_refused():
    ended = invoke("sweep", "show", "/dev/zero")
    assert ended.exit_code == 3
    assert "/dev/zero is not a regular file" in ended.output


@pytest.mark.parametrize("command", ["check", "fmt", "import", "test"])
def test_a_pipe_that_nobody_writes_is_refused(tmp_path, command):
    pipe = tmp_path / ("m.scxml" if command == "import" else "m.maze-machine")
    os.mkfifo(pipe)
    ended = invoke(command, pipe)
    assert ended.exit_code == 3
    assert str(pipe) in ended.output
    assert "it is a pipe" in ended.output or "is not a regular file" in ended.output


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (f"a = {DEEP}", "nested too deep"),
        ("x = 1\n" * 200_000, "larger than 1 MiB"),
        (f"a = {'9' * 5000}", "too many digits"),
        ("\0", "TOML"),
    ],
    ids=["deep", "large", "digits", "NUL"],
)
def test_a_profile_that_nobody_wrote_is_refused(tmp_path, text, words):
    file = tmp_path / "mine.toml"
    file.write_text(text)
    ended = invoke("run", "pledge", "--robot", file, "--no-picture")
    assert ended.exit_code == 3
    assert words in ended.stderr or words == "TOML"
    assert len(ended.stderr.splitlines()) == 1


def test_a_profile_with_a_byte_order_mark_is_read(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_bytes(b"\xef\xbb\xbf[robot]\nperiod = 0.2\n")
    assert "period = 0.2" in invoke("profile", file).stdout


def test_imports_that_are_very_deep_are_refused(tmp_path):
    for number in range(300):
        text = f"machine m{number}\nimport m{number + 1}\ninitial a\nstate a\n    do drive(speed = 0.1 m/s)\n"
        (tmp_path / f"m{number}.maze-machine").write_text(text)
    ended = invoke("check", tmp_path / "m0.maze-machine", "--ignore", "W", "--ignore", "N")
    assert ended.exit_code == 1
    assert "imports are nested more than 100 levels deep here" in ended.stdout
    assert ended.stdout.splitlines()[-1] == "1 file checked: 1 error"


@pytest.mark.parametrize("name", ["../x:y", "x/y:z", ":", "x:", "x:1", "os path:x"])
def test_a_library_by_a_path_is_refused(name):
    ended = invoke("test", "pledge", "--library", name)
    assert ended.exit_code == 2
    assert "names no library" in ended.stderr


@pytest.mark.parametrize("arguments", [["run"], ["check"], ["test"], ["replay"], ["run", "pledge", "--maze"]])
def test_escape_codes_in_a_name_reach_no_terminal(tmp_path, arguments):
    for name in ("\x1b[31mred", "\x1b]0;title\x07", "back\rspace", "right\u202eleft"):
        file = tmp_path / name
        ended = invoke(*arguments, file)
        assert ended.exit_code in (1, 2, 3)
        assert not set("\x1b\x07\r\u202e") & set(ended.output)
        file.write_text("machine m\x1b[2J\n")
        ended = invoke(*arguments, file)
        assert not set("\x1b\x07\r\u202e") & set(ended.output)


def test_every_number_of_a_profile_is_finite_and_bounded():
    """A field that takes an absurd value would be found here, also one that is added later."""

    def numbers(section, path=()):
        for name, field in type(section).model_fields.items():
            value = getattr(section, name)
            if hasattr(type(value), "model_fields"):
                yield from numbers(value, (*path, name))
            elif field.annotation in (int, float) and not isinstance(value, bool):
                yield (*path, name)

    found = list(numbers(Profile()))
    assert len(found) > 100
    for path in found:
        for absurd in (1e300, -1e300, math.inf, -math.inf, math.nan):
            table: object = absurd
            for name in reversed(path):
                table = {name: table}
            with pytest.raises(ValidationError):
                Profile.model_validate(table)


corners = st.tuples(st.floats(-10, 10), st.floats(-10, 10))


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.lists(corners, max_size=8))
def test_an_outline_is_refused_or_a_body_can_be_made_of_it(outline):
    if outline_fault(outline):
        with pytest.raises(ValidationError):
            RobotDescription(footprint=tuple(outline))
        return
    area = sum(ax * by - ay * bx for (ax, ay), (bx, by) in zip(outline, outline[1:] + outline[:1], strict=True))
    turned = outline if area > 0 else outline[::-1]
    parts = convex_decomposition([*turned, turned[0]], 0.0)
    assert sum(pymunk.moment_for_poly(1.0, part) for part in parts) > 0


@pytest.mark.parametrize(
    ("outline", "fault"),
    [
        ([(0, 0), (1, 0), (1, 1), (0, 1)], ""),
        ([(0, 1), (1, 1), (1, 0), (0, 0)], ""),
        ([(0.1, -0.2), (0.1, -0.1), (0.05, -0.1), (0.05, 0.1), (0.1, 0.1), (0.1, 0.2), (-0.1, 0.2), (-0.1, -0.2)], ""),
        ([(0, 0), (1, 1), (1, 0), (0, 1)], "must be an outline with an area"),
        ([(0, 0), (2, 0), (2, 2), (1, -0.5)], "must not cross itself"),
        ([(0, 0), (1, 0), (1, 0), (1, 1)], "must not have a corner twice"),
        ([(0, 0), (2, 0), (2, 1), (1, 0), (0, 1)], "must not cross itself"),
    ],
)
def test_what_is_an_outline(outline, fault):
    assert outline_fault(outline).startswith(fault)
    assert bool(outline_fault(outline)) == bool(fault)
