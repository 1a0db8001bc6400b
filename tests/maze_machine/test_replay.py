"""Recorded runs, replayed."""

import base64
import gzip
import json
import re
import socket
from dataclasses import replace
from pathlib import Path
from shutil import copyfile

import pytest
from mcap.reader import make_reader
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter

from hsm.dsl.syntax.lexer import IN_PLACE, RESERVED, STATEMENTS
from maze_machine.catalogue.profile import load_profile
from maze_machine.drive.mission import drive, prepare
from maze_machine.drive.replay import Difference, first_difference, named_machine, recorded_mission
from maze_machine.errors import FileError
from maze_machine.report.outputs import Outputs
from maze_machine.simulated.world import SimulatedWorld, find_maze
from maze_machine.view.foxglove import layout
from transport import codec
from transport.description import RobotDescription
from transport.recording import read_recording
from transport.world import LockstepRobot


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A short recorded run and its trace."""
    folder = tmp_path_factory.mktemp("recorded")
    profile = load_profile(overrides=["skills.motion.slow_gain=1"])
    mission = prepare("pledge", profile, [("cruise", "0.4 m/s")], time_limit=10.0)
    world = SimulatedWorld(find_maze("final_2015", robot=RobotDescription()), profile.robot)
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
    assert all(
        [one["transition"] for one in step["why"] if one["verdict"] == "taken"] == step["fired"] for step in steps
    )
    assert all(one["reason"] for step in steps for one in step["why"])
    waiting = [one for step in steps if not step["taken"] for one in step["why"]]
    assert any(" was false" in one["reason"] for one in waiting), "also where nothing fires"


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
    text = page.read_text(encoding="utf-8")
    told = json.loads(text.partition("const DATA = ")[2].partition(";\n")[0])
    assert told["head"]["model"]["machine"] == "pledge"
    assert told["head"]["scene"]["walls"]
    assert told["verdict"]["line"].startswith("unfinished: still inside")
    shown = frames_of(text)
    lines = [json.loads(line) for line in trace.read_text().splitlines()[1:]]
    assert [{name: one[name] for name in line} for one, line in zip(shown, lines, strict=True)] == lines
    assert any(one["sights"]["landmarks"] for one in shown)


def frames_of(page):
    """The frames in a page, complete again."""
    packed = (
        page.partition(f'<script id="{part}" type="text/plain">')[2].partition("<")[0] for part in ("frames", "more")
    )
    lines = [line for one in packed for line in gzip.decompress(base64.b64decode(one)).splitlines()]
    found, before = [], {}
    for line in lines:
        said = json.loads(line)
        gone = said.pop("gone", ())
        before = {**({} if said.pop("whole", False) else before), **said}
        for name in gone:
            del before[name]
        found.append(before)
    return found


@pytest.fixture(scope="module")
def bag(recorded, tmp_path_factory):
    """The sensors of the recorded run in a rosbag2 folder, as another robot's topics."""
    folder = tmp_path_factory.mktemp("bags") / "bag"
    renamed = {"/pico/scan": "/scan", "/pico/odom": "/wheels", "/tf_static": "/tf_static"}
    with recorded[0].open("rb") as file, BagWriter(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {}
        for schema, channel, message in make_reader(file).iter_messages(list(renamed)):
            if channel.topic not in connections:
                connections[channel.topic] = writer.add_connection(
                    renamed[channel.topic], schema.name, typestore=codec.TYPES
                )
            writer.write(connections[channel.topic], message.log_time, message.data)
    return folder


class TestSomebodyElsesRecording:
    def test_a_machine_does_with_it_what_it_did_in_the_run(self, finish, bag, recorded, tmp_path):
        robot = ("--robot", "pico", "--set", "skills.motion.slow_gain=1")
        status, out, err = finish("replay", "pledge", bag, *robot, "--trace", "again.jsonl")
        assert (status, err) == (0, "")
        head, *lines = out.splitlines()
        assert head == "pledge on 101 ticks of /scan and /wheels: still active at the end"
        lines_of_run = [json.loads(line) for line in recorded[1].read_text().splitlines()[1:]]
        states = [json.loads(line)["states"] for line in (tmp_path / "again.jsonl").read_text().splitlines()[1:]]
        assert states == [line["states"] for line in lines_of_run]
        assert len(lines) == sum(len(line["taken"]) for line in lines_of_run)
        assert any("speed = " in line for line in lines)

    def test_as_json(self, finish, bag):
        status, out, _ = finish("replay", "pledge", bag, "--json")
        told = json.loads(out)
        assert status == 0
        assert told["topics"] == {"scan": "/scan", "odometry": "/wheels", "command": None}
        assert told["transitions"][0]["time"] == pytest.approx(0.1)

    def test_it_becomes_a_page(self, finish, bag, tmp_path):
        assert finish("view", bag, "-o", tmp_path / "bag.html")[0] == 0
        assert len(frames_of((tmp_path / "bag.html").read_text(encoding="utf-8"))) == 101

    @pytest.mark.parametrize(
        ("arguments", "status", "words"),
        [
            (["replay", "BAG"], 3, "does not name its machine; give a machine before the recording"),
            (["replay", "pledge", "BAG", "--machine", "pledge"], 2, "two machines"),
            (["replay", "pledge", "BAG", "--scan", "/none"], 3, "has no sensor_msgs/msg/LaserScan on `/none`"),
            (["replay", "none", "BAG"], 3, "there is no machine `none`"),
        ],
    )
    def test_what_is_missing_is_one_line(self, finish, bag, arguments, status, words):
        ended, _, err = finish(*[str(bag) if word == "BAG" else word for word in arguments])
        assert ended == status
        assert words in err
        assert len(err.splitlines()) == 1


class TestWhatARecordingNames:
    """A recording is somebody else's file: what it names is not opened unless it looks like what it should be."""

    @pytest.mark.parametrize(
        ("said", "words"),
        [
            ({"machine": "SECRET"}, "which is not a machine's file"),
            ({"machine": "\x1b[2J"}, "which is not a machine's file"),
            ({"machine": "/dev/zero"}, "which is not a machine's file"),
            ({"profile": "[" * 100_000}, "recorded profile cannot be used|not name its robot"),
            ({"profile": "{}{"}, "recorded profile cannot be used"),
            ({"profile": '{"robot": {"period": -1}}'}, "recorded profile cannot be used: .*period"),
            ({"parameters": "[1]"}, "parameters"),
            ({"parameters": "[" * 100_000}, "parameters"),
        ],
    )
    def test_it_is_validated(self, recorded, tmp_path, said, words):
        secret = tmp_path / "secret"
        secret.write_text("the secret\n")
        said = {key: str(secret) if value == "SECRET" else value for key, value in said.items()}
        recording = read_recording(recorded[0])
        with pytest.raises(FileError, match=words) as caught:
            recorded_mission(replace(recording, run={**recording.run, **said}))
        assert str(caught.value).isprintable()
        assert "the secret" not in str(caught.value)

    def test_a_machines_file_may_be_named(self, recorded, tmp_path):
        machine = tmp_path / "mine.maze-machine"
        machine.write_text("machine mine\nstart -> only\nstate only\n")
        recording = read_recording(recorded[0])
        named = replace(recording, run={**recording.run, "machine": str(machine), "parameters": "{}"})
        assert named_machine(named) == str(machine)

    def test_its_recorded_text_is_used_where_its_file_is_not(self, recorded, tmp_path):
        recording = read_recording(recorded[0])
        gone, texts = (
            str(tmp_path / "gone.maze-machine"),
            {"gone.maze-machine": "machine kept\n\ninitial only\n\nstate only\n"},
        )
        said = {**recording.run, "machine": gone, "parameters": "{}"}
        kept = replace(recording, run={**said, "sources": json.dumps(texts)})
        assert recorded_mission(kept).machine.model.name == "kept"
        for sources in ("[", json.dumps({"../out.maze-machine": "machine out\n"}), "{}"):
            with pytest.raises(FileError, match="there is no machine"):
                recorded_mission(replace(recording, run={**said, "sources": sources}))
        assert not (tmp_path / "out.maze-machine").exists()


def test_a_layout_for_foxglove_names_what_is_in_the_recording(recorded):
    topics = read_recording(recorded[0]).heard
    made = layout(topics)
    json.dumps(made)
    panels = made["configById"]
    shown = set(panels["3D!plan"]["topics"])
    assert shown == {"/map", "/pico/scan", "/pico/path", "/pico/footprint"}
    assert [path["value"] for path in panels["StateTransitions!states"]["paths"]] == [
        "/pico/state/solve.data",
        "/pico/state/watch.data",
    ]
    placed = [made["layout"]]
    for part in placed:
        if isinstance(part, dict):
            placed += [part["first"], part["second"]]
    assert {part for part in placed if isinstance(part, str)} == set(panels)


def test_the_panels_of_a_layout_are_those_of_foxglove_s_own_library(recorded):
    """Its classes list what each panel knows. Only the plan has another name in files that the application saves."""
    layouts = pytest.importorskip("foxglove.layouts")
    topics = read_recording(recorded[0]).heard
    panels = {name.partition("!")[0]: config for name, config in layout(topics)["configById"].items()}

    def knows(made: object, said: dict[str, object]) -> bool:
        return said.keys() <= made._to_dict().keys()

    for panel in (layouts.ThreeDeePanel, layouts.StateTransitionsPanel, layouts.PlotPanel, layouts.RawMessagesPanel):
        empty = panel()._to_dict()
        kind = {"ThreeDee": "3D"}.get(empty["panelType"], empty["panelType"])
        assert knows(empty["config"], panels.pop(kind))
    assert not panels
    panels = layout(topics)["configById"]
    settings = {
        "nav_msgs/msg/OccupancyGrid": layouts.BaseRendererRosOccupancyGridTopicSettings,
        "sensor_msgs/msg/LaserScan": layouts.BaseRendererLaserScanTopicSettings,
        "nav_msgs/msg/Path": layouts.BaseRendererPosesTopicSettings,
        "geometry_msgs/msg/PolygonStamped": layouts.BaseRendererRosPolygonTopicSettings,
    }
    plan = panels["3D!plan"]
    assert knows(layouts.ThreeDeeCameraState(), plan["cameraState"])
    for topic, said in plan["topics"].items():
        assert knows(settings[topics[topic]](), said)
    for series, name in (
        (layouts.StateTransitionsSeries, "StateTransitions!states"),
        (layouts.PlotSeries, "Plot!velocity"),
    ):
        assert panels[name]["paths"]
        for path in panels[name]["paths"]:
            assert knows(series(), path)


def test_a_busy_port_of_the_live_page_is_told(finish):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        status, _, err = finish("run", "pledge", "--view", "--port", port, "--no-picture")
    assert status == 2
    assert err == f"maze-machine: --host 127.0.0.1 --port {port}: Address already in use; port 0 takes any\n"


def test_every_construct_is_replayed(finish, tmp_path):
    for path in (Path(__file__).parent / "machines").iterdir():
        copyfile(path, tmp_path / path.name)
    text = "".join(path.read_text(encoding="utf-8") for path in tmp_path.glob("*.maze-machine"))
    unused = {word for word in STATEMENTS | RESERVED | IN_PLACE if not re.search(rf"\b{word}\b", text)}
    assert unused <= {"member", "or", "before", "eventually", "true", "false"}
    sent = ["0.1:note(3, quick)", "1.2:again", "2:go", "2.3:note(4, slow)", "3.5:note(12, slow)"]
    events = [word for one in sent for word in ("--event-at", one)]
    machine = ("everything.maze-machine", "--maze", "corridor", "--no-picture")
    status, out, _ = finish("run", *machine, *events, "--record", "run.mcap", "--trace", "run.jsonl")
    assert status == 1
    assert "the machine ended in `over`" in out
    status, out, _ = finish("replay", "run.mcap", "--trace", "again.jsonl")
    assert (status, out) == (0, "everything on 55 recorded ticks: no difference\n")
    trace = (tmp_path / "run.jsonl").read_text()
    assert (tmp_path / "again.jsonl").read_text() == trace
    lines = (tmp_path / "everything.maze-machine").read_text().splitlines()
    timed = [number for number, line in enumerate(lines, 1) if re.match(r" +(on|when|else|after|every) ", line)]
    assert len([one for one in timed if f"(line {one})" not in trace]) <= 4
    assert '"sent":["go"]' in trace
    assert '"broken":["brief"]' in trace
