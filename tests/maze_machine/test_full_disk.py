"""A full disk costs a file, never the result of a run nor what was there before: one line, the cause, status 3."""

from __future__ import annotations

import resource
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
from typer.testing import CliRunner

from maze_machine.catalogue.machines import shipped_machines
from maze_machine.cli import app

RUN = ["run", "right_hand", "--maze", "corridor", "--time-limit", "6"]
SMALL = """\
machine small
initial a
state a
    do drive(speed = 0.1 m/s)
    on blocked -> b
final b
"""
SCENARIO = """\
test small
scenario it stops
    expect a
    when drive reports blocked
    expect b
"""
BIN = Path(sys.executable).parent / "maze-machine"


@contextmanager
def little_room(most):
    """No file may grow larger than so many bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("recorded") / "run.mcap"
    ended = CliRunner().invoke(app, [*RUN, "--no-picture", "--record", str(path)])
    assert path.stat().st_size > 10_000, ended.output
    return path


def invoke(*arguments):
    ended = CliRunner().invoke(app, [str(argument) for argument in arguments], env={"COLUMNS": "200"})
    assert ended.exception is None or isinstance(ended.exception, SystemExit), ended.exception
    return ended


def in_little_room(*arguments, most=4096):
    with little_room(most):
        ended = invoke(*arguments)
    assert ended.exit_code == 3, ended.output
    (message,) = (line for line in ended.stderr.splitlines() if line.startswith("maze-machine: "))
    assert "File too large" in message
    assert "slow" not in ended.stderr
    return ended


@pytest.mark.parametrize(
    ("option", "name", "told"),
    [
        ("--trace", "run.jsonl", "is not complete"),
        ("--record", "run.mcap", "is not complete"),
        ("--picture", "run.png", "no picture: "),
    ],
)
@pytest.mark.parametrize("there", [False, True])
def test_a_run_prints_its_verdict_first_and_then_which_file_is_not_complete(tmp_path, option, name, told, *, there):
    file = tmp_path / name
    if there:
        file.write_bytes(b"before")
    ended = in_little_room(*RUN, *([] if option == "--picture" else ["--no-picture"]), option, file)
    assert ended.stdout.startswith("right_hand in corridor, seed 0: failed: ")
    assert told in ended.stderr
    assert str(file) in ended.stderr
    if there:
        assert file.read_bytes() == b"before"


def test_several_files_that_are_not_complete_are_told_in_one_line(tmp_path):
    ended = in_little_room(
        *RUN, "--trace", tmp_path / "a", "--record", tmp_path / "b.mcap", "--picture", tmp_path / "c.png"
    )
    for name in ("a is not complete", "b.mcap is not complete", "c.png"):
        assert name in ended.stderr


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (["diagram", "pledge", "-o"], "made.mmd"),
        (["export", "tremaux", "-o"], "made.scxml"),
        (["maze", "convert", "final_2015"], "made.pgm"),
        (["maze", "show", "final_2015", "--picture"], "made.png"),
        (["test", "small.maze-machine", "--html"], "made"),
        (["test", "small.maze-machine", "--lcov"], "made.info"),
    ],
    ids=lambda value: value if isinstance(value, str) else value[0],
)
def test_every_command_that_writes_names_the_file_and_the_cause(tmp_path, monkeypatch, arguments, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "small.maze-machine").write_text(SMALL)
    (tmp_path / "small.maze-test").write_text(SCENARIO)
    file = tmp_path / name
    ended = in_little_room(*arguments, file, most=64)
    assert str(file) in ended.stderr
    if arguments[0] == "test":
        assert "1 scenario, 0 failed" in ended.stdout


def test_a_page_that_does_not_fit_leaves_the_one_before(tmp_path, recording):
    page = tmp_path / "run.html"
    page.write_text("before")
    in_little_room("view", recording, "-o", page)
    assert page.read_text() == "before"


def test_a_machine_that_cannot_be_written_is_not_lost(tmp_path):
    machine = tmp_path / "m.maze-machine"
    text = "machine  m\ninitial a\nstate a\n do wait()\n" + "# a long comment\n" * 500
    machine.write_text(text)
    in_little_room("fmt", machine)
    assert machine.read_text() == text
    assert list(tmp_path.iterdir()) == [machine]
    assert invoke("fmt", machine).exit_code == 0
    assert machine.read_text().startswith("machine m\n")


@pytest.mark.parametrize("arguments", [["profile"], ["list", "signals"], [*RUN, "--no-picture"]])
def test_a_full_disk_behind_standard_output_is_one_line(arguments):
    with Path("/dev/full").open("w") as full:
        ended = subprocess.run(
            [BIN, *arguments], stdout=full, stderr=subprocess.PIPE, text=True, check=False, timeout=60
        )
    assert ended.returncode == 3
    assert ended.stderr == "maze-machine: the output cannot be written: No space left on device\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ["view", "RECORDING", "-o", "RECORDING"],
        ["replay", "RECORDING", "--trace", "RECORDING"],
        ["run", "MACHINE", "--trace", "MACHINE"],
        ["run", "MACHINE", "--trace", "x", "--record", "x"],
        ["diagram", "MACHINE", "-o", "MACHINE"],
        ["export", "MACHINE", "-o", "MACHINE"],
        ["test", "MACHINE", "--lcov", "MACHINE"],
    ],
    ids=lambda value: f"{value[0]} {value[-2]} {value[-1]}",
)
@pytest.mark.parametrize("linked", [False, True])
def test_no_command_writes_over_what_it_reads(tmp_path, monkeypatch, recording, arguments, *, linked):
    monkeypatch.chdir(tmp_path)
    files = {"RECORDING": tmp_path / "run.mcap.dot", "MACHINE": tmp_path / "m.maze-machine.dot", "x": tmp_path / "x"}
    files["RECORDING"].write_bytes(recording.read_bytes())
    files["MACHINE"].write_text(shipped_machines()["corridor_2015"].read_text())
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    named = [str(files.get(one, one)) for one in arguments]
    if linked:
        link = tmp_path / "link.dot"
        link.symlink_to(named[-1])
        named[-1] = str(link)
    ended = invoke(*named)
    assert ended.exit_code == 2, ended.output
    assert len(ended.stderr.splitlines()) == 1
    assert "overwrite" in ended.stderr or "same file" in ended.stderr
    assert {path: path.read_bytes() for path in before} == before
