"""Runs that save a map or begin with one, and the command that shows one."""

import json

import pytest
from typer.testing import CliRunner

from maze_machine.cli import app
from perception.map_document import read_map

LIMIT = ("--maze", "corridor", "--time-limit", "4", "--json")


def invoke(*arguments):
    ended = CliRunner().invoke(app, list(map(str, arguments)), env={"COLUMNS": "200"})
    assert ended.exception is None or isinstance(ended.exception, SystemExit), ended.exception
    return ended


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """The map of a run of explorer, and its result."""
    file = tmp_path_factory.mktemp("maps") / "maze.map"
    ended = invoke("run", "explorer", *LIMIT, "--save-map", file, "--picture", file.with_suffix(".png"))
    return file, json.loads(ended.stdout)


def test_a_run_saves_its_map_and_draws_it(kept):
    file, result = kept
    assert result["files"] == {"map": str(file), "picture": str(file.with_suffix(".png"))}
    document = read_map(file)
    assert document.robot is not None
    assert document.way_out is None, "it is still inside"
    assert file.with_suffix(".png").stat().st_size > 10_000


def test_a_machine_without_a_map_gets_one_beside_its_run(tmp_path):
    traces = [tmp_path / "a.jsonl", tmp_path / "b.jsonl"]
    invoke("run", "pledge", *LIMIT, "--no-picture", "--trace", traces[0])
    ended = invoke("run", "pledge", *LIMIT, "--no-picture", "--trace", traces[1], "--save-map", tmp_path / "a.map")
    assert json.loads(ended.stdout)["files"]["map"] == str(tmp_path / "a.map")
    assert len(read_map(tmp_path / "a.map").keyframes) > 2
    assert traces[0].read_bytes() == traces[1].read_bytes(), "the map has no influence"


@pytest.mark.parametrize("at", ["start", "0 0 0"])
def test_a_run_begins_with_a_map(kept, tmp_path, at):
    file, _ = kept
    ended = invoke(
        "run", "explorer", *LIMIT, "--no-picture", "--map", file, "--at", at, "--save-map", tmp_path / "more.map"
    )
    assert json.loads(ended.stdout)["files"] == {"map": str(tmp_path / "more.map")}
    before, after = read_map(file), read_map(tmp_path / "more.map")
    assert after.keyframes[0].pose == before.keyframes[0].pose
    assert len(after.keyframes) > len(before.keyframes)
    assert after.robot is not None


def test_show_describes_and_draws_a_map(kept, tmp_path):
    file, _ = kept
    ended = invoke("map", "show", file, "--picture", tmp_path / "map.svg")
    assert ended.exit_code == 0
    first, *plan, last = ended.stdout.splitlines()
    assert first.startswith(f"{file}: ")
    assert "the way out is not known" in first
    dots = [one for line in plan for one in line if 0x2800 < ord(one) < 0x2900]
    assert len(dots) > 30, "walls"
    assert len([one for line in plan for one in line if one in "→↗↑↖←↙↓↘"]) == 1, "the robot"
    assert last == f"picture: {tmp_path / 'map.svg'}"
    assert (tmp_path / "map.svg").stat().st_size > 10_000


def test_show_gives_numbers_to_programs(kept):
    file, _ = kept
    told = json.loads(invoke("map", "show", file, "--json", "--no-picture").stdout)
    document = read_map(file)
    assert told["keyframes"] == len(document.keyframes)
    assert told["way_out"] is None
    assert 0 < told["deviation"] < 0.1
    assert "picture" not in told


@pytest.mark.parametrize(
    ("arguments", "status", "told"),
    [
        (["--map", "none.map"], 3, "none.map: No such file or directory"),
        (["--at", "start"], 2, "--at needs --map; give the map's file, too"),
        (["--map", "MAP", "--at", "here"], 2, "--at here: no place; --at start, or as in"),
        (["--map", "MAP", "--at", "nan 0 0"], 2, "--at nan 0 0: no place"),
        (["--map", "MAP", "--at", "99 0 0"], 2, "--at 99 0 0: this place is not on the map"),
        (["--map", "MAP", "--record", "run.mcap"], 2, "--record cannot be combined with --map"),
        (["--map", "MAP", "--save-map", "MAP"], 2, "would overwrite what is read"),
        (["--save-map", "map.json"], 2, "there is no format `.json`; use .map"),
        (["--save-map", "absent/a.map"], 3, "--save-map absent/a.map: there is no folder absent; make it, or"),
        (["--map", __file__], 3, "this is not a map (`maze-machine run --save-map FILE` writes one)"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_cannot_be_is_said_in_one_line(kept, arguments, status, told):
    named = [str(kept[0]) if one == "MAP" else one for one in arguments]
    ended = invoke("run", "explorer", *LIMIT, "--no-picture", *named)
    assert ended.exit_code == status, ended.output
    assert told in ended.stderr
    assert len(ended.stderr.splitlines()) == 1
