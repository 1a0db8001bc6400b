"""The one value that says what happened in a tick: its JSON, by the published schema, wherever it goes."""

import io
import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import drive, prepare
from maze_machine.drive.path_recorder import PathRecorder
from maze_machine.drive.replay import Keeper
from maze_machine.drive.sights import sights
from maze_machine.drive.tick import shown_ranges
from maze_machine.drive.tick_json import LINE
from maze_machine.drive.trace import TraceWriter
from maze_machine.remote.client import RemoteMachine
from maze_machine.remote.opened import OpenRun
from maze_machine.remote.operated import OperatedRun
from maze_machine.report.pages import LOOKED_AT, ShownRun, recorded_frames
from maze_machine.simulated.world import SimulatedWorld, find_maze
from perception import Perception
from transport.description import RobotDescription
from transport.memory_bus import MemoryNetwork
from transport.messages import Pose
from transport.recording import Recorder, read_recording
from transport.world import LockstepRobot

jsonschema = pytest.importorskip("jsonschema")
SCHEMA = json.loads((Path(__file__).parents[2] / "docs" / "reference" / "tick.schema.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def schema():
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    return jsonschema.Draft202012Validator(SCHEMA)


def run(machine, seconds=5.0, maze="final_2015"):
    """The ticks of a short run."""
    mission = prepare(machine, load_profile(), time_limit=seconds)
    world = SimulatedWorld(find_maze(maze, robot=RobotDescription()), mission.profile.robot)
    robot, seen = LockstepRobot(world), []
    drive(mission, robot, robot, [seen.append], truth=world.pose)
    return mission, world, seen


@pytest.mark.parametrize("machine", ["pledge", "tremaux", "explorer"])
def test_every_tick_is_by_the_schema(schema, machine):
    _, _, seen = run(machine)
    for tick in seen:
        told = json.loads(json.dumps({**tick.json, "ranges": shown_ranges(tick.observation.scan)}))
        assert not list(schema.iter_errors(told))


@pytest.mark.parametrize(
    "corrupt", [{"more": 1}, {"tick": -1}, {"pose": [0.0]}, {"why": [{"transition": 0}]}, {"fired": ["a"]}]
)
def test_what_is_not_by_the_schema_is_noticed(schema, corrupt):
    _, _, seen = run("pledge", 0.1)
    assert list(schema.iter_errors(json.loads(json.dumps({**seen[0].json, **corrupt}))))


def test_a_tick_says_what_happened():
    mission, world, seen = run("pledge", 12.0)
    model = mission.machine.model
    assert [tick.json["truth"] for tick in seen] == [[p.x, p.y, p.heading] for p in map(world.pose, range(len(seen)))]
    assert any(tick.json["fired"] for tick in seen)
    for tick in seen:
        told = tick.json
        assert {name: told[name] for name in LINE if name in told} == tick.line
        assert [model.transitions[index] for index in told["fired"]] == list(tick.step.transitions)
        assert set(told["activities"]) <= set(told["states"])
        assert told["doing"] in told["states"]
        innermost = [name for name in told["states"] if not model.states[mission.machine.indices[name]].children]
        assert sorted(told["regions"].values()) == sorted(innermost)
    begun = [one["arguments"] for tick in seen for one in tick.json["activities"].values()]
    assert any(one.get("speed") == "0.5 m/s" for one in begun), begun
    heard = [pair for tick in seen for pair in tick.json["outcomes"]]
    assert all(state in mission.machine.indices for state, _ in heard)


def test_a_tick_is_described_once_and_says_the_same_later():
    _, _, seen = run("pledge", 3.0)
    assert all(tick.json is tick.json for tick in seen)
    _, _, again = run("pledge", 3.0)
    at_once = []
    mission = prepare("pledge", load_profile(), time_limit=3.0)
    world = SimulatedWorld(find_maze("final_2015", robot=RobotDescription()), mission.profile.robot)
    robot = LockstepRobot(world)
    drive(mission, robot, robot, [lambda tick: at_once.append(json.dumps(tick.json))], truth=world.pose)
    assert [json.dumps(tick.json) for tick in again] == at_once


def test_a_recorded_run_shows_the_map_that_the_robot_made():
    _, _, ticks = run("explorer", 4.0)
    profile = load_profile()
    kept = [SimpleNamespace(observation=one.observation, command=one.command, step=one.json) for one in ticks]
    frames = list(recorded_frames(SimpleNamespace(ticks=kept), Perception(profile.robot, profile.perception)))
    assert (len(ticks) - 1) % LOOKED_AT == 0
    assert frames[-1]["place"] == "known"
    assert frames[-1]["sights"]["map"] == sights(ticks[-1].facts)["map"]
    assert "place" not in run("pledge", 0.5)[2][-1].json


def test_one_record_feeds_trace_recording_page_network_and_pictures(schema, tmp_path):
    mission, _, (*_, last) = run("pledge", 0.5)
    heading_for = replace(last.command, goal=Pose(1.0, 2.0, 0.5))
    marked = replace(last, leading="a marked state", events=("a marked event",), command=heading_for, place="known")
    trace, frames, trail, network = io.StringIO(), [], PathRecorder(), MemoryNetwork()
    recorder = Recorder(tmp_path / "run.mcap", "pico")
    with OpenRun(network.bus(), mission, OperatedRun(mission, pausable=True), {}) as opened:
        shown = ShownRun(lambda make: frames.append(make()), lambda _: None)
        for watch in (TraceWriter(trace, mission), Keeper(recorder), shown, opened, trail):
            watch(marked)
        heard = RemoteMachine(network.bus(), mission.profile.robot.name).newest_step()()
    recorder.close()
    recorded = read_recording(tmp_path / "run.mcap").ticks[0].step
    traced = json.loads(trace.getvalue().splitlines()[-1])
    assert traced == json.loads(json.dumps(marked.line))
    whole = json.loads(json.dumps(marked.json))
    for told in (recorded, frames[0], heard):
        assert {name: value for name, value in told.items() if name in whole} == whole
        assert told["doing"] == "a marked state"
        assert told["events"] == traced["events"] == ["a marked event"]
        assert told["goal"] == traced["goal"] == [1.0, 2.0, 0.5]
    assert trail.states == ["a marked state"]
    assert not list(schema.iter_errors({name: one for name, one in heard.items() if name not in ("paused", "ended")}))
