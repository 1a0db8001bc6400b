"""Traces: everything that was decided, the same bytes for the same seed."""

import json
from pathlib import Path

import pytest

from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import drive, prepare
from maze_machine.drive.trace import TraceWriter
from maze_machine.simulated.world import SimulatedWorld, find_maze
from transport.description import RobotDescription
from transport.world import LockstepRobot


@pytest.fixture
def traced(tmp_path):
    """The trace of the first seconds of a run."""

    def run(seed, seconds=12.0):
        profile = load_profile()
        mission = prepare("pledge", profile, time_limit=seconds)
        robot = LockstepRobot(SimulatedWorld(find_maze("final_2015", robot=RobotDescription()), profile.robot, seed))
        file = tmp_path / "trace.jsonl"
        with file.open("w", encoding="utf-8") as out:
            drive(mission, robot, robot, [TraceWriter(out, mission)])
        return file.read_bytes()

    return run


def test_one_seed_one_trace(traced):
    first = traced(3)
    assert traced(3) == first
    assert traced(4) != first


def test_a_trace_tells_states_transitions_poses_and_commands(traced):
    head, *lines = map(json.loads, traced(0).splitlines())
    assert head["machine"] == "pledge"
    assert [line["tick"] for line in lines] == list(range(len(lines)))
    assert [line["stamp"] for line in lines] == [100_000_000 * k for k in range(len(lines))]
    assert all(set(line) == {"tick", "stamp", "states", "taken", "pose", "twist", "ring"} for line in lines)
    entered = {state for line in lines for state in line["states"]}
    assert len(entered) > 2
    changes = [k for k in range(1, len(lines)) if lines[k]["states"] != lines[k - 1]["states"]]
    assert changes
    assert all(lines[k]["taken"] for k in changes), "no state changes without a transition"
    assert any(line["twist"] != [0, 0, 0] for line in lines)


def test_the_trace_depends_neither_on_hash_seeds_nor_on_the_folder(finish, tmp_path, monkeypatch):
    texts = set()
    for seed in ("1", "2"):
        monkeypatch.setenv("PYTHONHASHSEED", seed)
        status, _, err = finish("run", "pledge", "--time-limit", 8, "--no-picture", "--trace", tmp_path / seed)
        assert (status, err) == (1, "")
        texts.add((tmp_path / seed).read_bytes())
    assert len(texts) == 1
    assert str(Path.cwd()).encode() not in texts.pop()
