"""Recorded runs, replayed."""

import json
import socket

import pytest

from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import drive, prepare
from maze_machine.drive.replay import Difference, first_difference
from maze_machine.report.outputs import Outputs
from maze_machine.simulated.world import SimulatedWorld, find_maze
from transport.recording import read_recording
from transport.world import LockstepRobot


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A short recorded run and its trace."""
    folder = tmp_path_factory.mktemp("recorded")
    profile = load_profile(overrides=["skills.motion.slow_gain=1"])
    mission = prepare("pledge", profile, [("cruise", "0.4 m/s")], time_limit=10.0)
    world = SimulatedWorld(find_maze("final_2015"), profile.robot)
    robot, outputs = LockstepRobot(world), Outputs(folder / "run.jsonl", folder / "run.mcap")
    with outputs.watchers(mission, "pledge", world, []) as watchers:
        drive(mission, robot, robot, watchers)
    return folder / "run.mcap", folder / "run.jsonl"


def test_the_same_machine_gives_the_same_trace_byte_for_byte(finish, recorded, tmp_path):
    recording, trace = recorded
    status, out, err = finish("replay", recording, "--trace", "again.jsonl")
    assert (status, err) == (0, "")
    assert out == "pledge on 101 recorded ticks: no difference\n"
    assert (tmp_path / "again.jsonl").read_bytes() == trace.read_bytes()


def test_a_recording_says_why_transitions_fired(recorded):
    steps = [tick.step for tick in read_recording(recorded[0]).ticks]
    assert all(("reasons" in step) == bool(step["taken"]) for step in steps)
    assert any(" was true" in reason for step in steps for reason in step.get("reasons", ()))


def test_with_another_machine_the_first_difference_is_shown(finish, recorded, tmp_path):
    recording, trace = recorded
    status, out, _ = finish("replay", recording, "--machine", "right_hand", "--trace", "other.jsonl", "--json")
    assert status == 1
    told = json.loads(out)
    assert told["same"] is False
    index = told["difference"]["tick"]
    lines = [json.loads(line) for line in trace.read_text().splitlines()[1:]]
    others = [json.loads(line) for line in (tmp_path / "other.jsonl").read_text().splitlines()[1:]]
    assert lines[:index] == others[:index]
    assert lines[index] != others[index]
    assert told["difference"]["recorded"].items() <= lines[index].items()
    assert told["difference"]["replayed"].items() <= others[index].items()
    assert lines[index]["pose"] == others[index]["pose"], "the sensors are the recorded ones"


def test_a_recording_that_a_crash_cut_off_is_replayed_as_far_as_it_goes(finish, recorded, tmp_path):
    recording, _ = recorded
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(recording.read_bytes()[: recording.stat().st_size * 3 // 4])
    status, out, _ = finish("replay", cut, "--json")
    told = json.loads(out)
    assert status == 0
    assert told["complete"] is False
    assert 0 < told["ticks"] < 101


@pytest.mark.parametrize("content", [b"", b"no recording at all"])
def test_a_file_that_is_no_recording_is_refused_in_one_line(finish, tmp_path, content):
    file = tmp_path / "x.mcap"
    file.write_bytes(content)
    status, _, err = finish("replay", file)
    assert status == 3
    assert str(file) in err
    assert len(err.splitlines()) == 1
    assert finish("replay", tmp_path / "nothing")[0] == 3


def test_the_first_difference_of_two_traces():
    one, other = {"tick": 0, "states": ["a"]}, {"tick": 0, "states": ["b"]}
    assert first_difference([one, one], [one, one]) is None
    assert first_difference([one, one], [one, other]) == Difference(1, {"states": ["a"]}, {"states": ["b"]})
    assert first_difference([one], [one, other]) == Difference(1, {}, other)


def test_a_recording_becomes_a_page(finish, recorded, tmp_path):
    recording, trace = recorded
    page = tmp_path / "run.html"
    assert finish("view", recording, "-o", page) == (0, f"{page}\n", "")
    data = page.read_text().partition("const DATA = ")[2].partition(";\n")[0]
    shown = json.loads(data)["frames"]
    lines = [json.loads(line) for line in trace.read_text().splitlines()[1:]]
    assert [one["states"] for one in shown] == [line["states"] for line in lines]
    assert [one["pose"][:2] for one in shown] == [[round(value, 4) for value in line["pose"][:2]] for line in lines]


def test_a_busy_port_of_the_live_page_is_told(finish):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        status, _, err = finish("run", "pledge", "--live", port, "--no-picture")
    assert status == 2
    assert err == f"maze-machine: --live {port}: Address already in use; 0 takes any port that is free\n"
