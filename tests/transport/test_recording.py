"""Recordings: read back bit for bit, opened by other people's readers, whole up to where a crash cut them off."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from toy_world import ToyWorld, seen, wander

from transport.messages import Command, LinkStatus, Observation
from transport.recording import Recorder, RecordingError, ReplayRobot, read_recording
from transport.recording import recorder as recording
from transport.robot import LinkError
from transport.world import LockstepRobot

RUN = {"machine": "toy", "seed": "3"}


def record(path: Path, ticks: int = 60, seed: int = 3) -> list[tuple[Observation, Command, dict[str, object]]]:
    robot = LockstepRobot(ToyWorld(seed))
    rows = []
    with Recorder(path, "toy", RUN, patience=10.0) as recorder:
        for index in range(ticks):
            observation = robot.observe()
            command = wander(observation)
            rows.append((observation, command, {"states": ["a", "b"], "tick": index}))
            recorder.record(observation, command, partial(dict, rows[-1][2]))
            robot.command(command)
    assert recorder.lost == 0
    return rows


def same(observation: Observation, other: Observation) -> bool:
    return (*seen(observation), observation.link) == (*seen(other), other.link)


def test_a_run_is_read_back_bit_for_bit(tmp_path: Path) -> None:
    rows = record(tmp_path / "run.mcap")
    back = read_recording(tmp_path / "run.mcap")
    assert back.complete
    assert back.robot == "toy"
    assert RUN.items() <= back.run.items()
    assert len(back.ticks) == len(rows)
    for tick, (observation, command, step) in zip(back.ticks, rows, strict=True):
        assert same(tick.observation, observation)
        assert (tick.command, tick.step) == (command, step)


def test_ticks_that_see_old_data_again_are_read_back_too(tmp_path: Path) -> None:
    world = ToyWorld(1)
    first = world.observation
    stale = replace(first, link=LinkStatus(0.4, 0.3, 2, stopped=True))
    world.step(Command())
    mixed = replace(world.observation, odometry=first.odometry)
    with Recorder(tmp_path / "run.mcap", "toy") as recorder:
        for observation in (first, stale, mixed):
            recorder.record(observation, Command())
    back = [tick.observation for tick in read_recording(tmp_path / "run.mcap").ticks]
    assert [same(*pair) for pair in zip(back, (first, stale, mixed), strict=True)] == [True] * 3


def test_a_replay_shows_the_same_and_ends(tmp_path: Path) -> None:
    rows = record(tmp_path / "run.mcap", 10)
    robot = ReplayRobot(read_recording(tmp_path / "run.mcap"))
    for observation, _, _ in rows:
        assert not robot.finished
        assert same(robot.observe(), observation)
        assert wander(robot.observe()) == wander(observation)
        robot.command(Command())
    assert robot.finished
    with pytest.raises(LinkError, match="ended"):
        robot.observe()


def test_rosbags_opens_it(tmp_path: Path) -> None:
    rows = record(tmp_path / "run.mcap", 30)
    with AnyReader([tmp_path / "run.mcap"], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        kinds = {connection.topic: connection.msgtype for connection in reader.connections}
        assert kinds == {
            "/toy/scan": "sensor_msgs/msg/LaserScan",
            "/toy/odom": "nav_msgs/msg/Odometry",
            "/toy/cmd_vel": "geometry_msgs/msg/Twist",
            "/toy/tick": "std_msgs/msg/String",
            "/clock": "rosgraph_msgs/msg/Clock",
            "/tf": "tf2_msgs/msg/TFMessage",
            "/tf_static": "tf2_msgs/msg/TFMessage",
            "/toy/path": "nav_msgs/msg/Path",
            "/toy/points": "sensor_msgs/msg/PointCloud2",
        }
        scans = [c for c in reader.connections if c.topic == "/toy/scan"]
        for (_, stamp, raw), (observation, _, _) in zip(reader.messages(scans), rows, strict=True):
            message = reader.deserialize(raw, "sensor_msgs/msg/LaserScan")
            assert stamp == observation.stamp
            assert message.ranges.tobytes() == observation.scan.ranges.tobytes()


def test_mcaps_own_reader_opens_it_and_finds_the_profile(tmp_path: Path) -> None:
    rows = record(tmp_path / "run.mcap", 30)
    with (tmp_path / "run.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}
        # Seven a tick, the static transforms once, and the path every second.
        seconds = 1 + (rows[-1][0].stamp - rows[0][0].stamp) // recording.PATH_EVERY
        assert summary.statistics.message_count == 7 * len(rows) + 1 + seconds
        steps = [
            json.loads(message.data[8:].rstrip(b"\0"))["step"] for _, _, message in reader.iter_messages("/toy/tick")
        ]
    assert steps == [step for _, _, step in rows]


@pytest.mark.parametrize("share", [0.3, 0.5, 0.77, 0.95, 0.98, 0.99, 0.995, 0.999])
def test_a_file_that_a_crash_cut_off_is_read_to_its_last_chunk(
    long_run: tuple[bytes, list[tuple[Observation, Command, dict[str, object]]]], share: float, tmp_path: Path
) -> None:
    whole, rows = long_run
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: int(share * len(whole))])
    back = read_recording(cut)
    assert not back.complete
    lost = len(rows) - len(back.ticks)
    a_chunk = recording.CHUNK_SIZE / 4060
    assert lost <= (1 - share) * len(rows) + a_chunk
    for tick, (observation, command, _) in zip(back.ticks, rows, strict=False):
        assert same(tick.observation, observation)
        assert tick.command == command


def test_a_file_that_was_cut_off_before_its_first_chunk_says_so(
    long_run: tuple[bytes, list[object]], tmp_path: Path
) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(long_run[0][: len(long_run[0]) // 20])
    with pytest.raises(RecordingError, match="holds no message: it was cut off before the first chunk was written"):
        read_recording(cut)


@pytest.fixture(scope="module")
def long_run(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, list[object]]:
    path = tmp_path_factory.mktemp("long") / "run.mcap"
    rows = record(path, 300)
    return path.read_bytes(), rows


CRASH = """
import sys, os, pathlib
sys.path.insert(0, sys.argv[2])
from toy_world import ToyWorld, wander
from transport.recording import Recorder
from transport.world import LockstepRobot
robot, recorder = LockstepRobot(ToyWorld(3)), Recorder(pathlib.Path(sys.argv[1]), "toy", patience=10.0)
for _ in range(400):
    observation = robot.observe()
    recorder.record(observation, wander(observation))
    robot.command(wander(observation))
while recorder._ticks.qsize():
    pass
os.kill(os.getpid(), 9)
"""


def test_a_killed_process_leaves_a_readable_file(tmp_path: Path) -> None:
    arguments = [str(tmp_path / "run.mcap"), str(Path(__file__).parent)]
    killed = subprocess.run([sys.executable, "-c", CRASH, *arguments], check=False, timeout=60)
    assert killed.returncode == -9
    back = read_recording(tmp_path / "run.mcap")
    assert not back.complete
    assert len(back.ticks) >= 400 - 3 * recording.CHUNK_SIZE / 4060


def test_a_stalled_disk_does_not_stall_the_loop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    go_on = threading.Event()
    write = recording._TickWriter.write

    def stalled(writer: object, tick: object) -> None:
        assert go_on.wait(60)
        write(writer, tick)

    monkeypatch.setattr(recording._TickWriter, "write", stalled)
    monkeypatch.setattr(recording, "BACKLOG", 20)
    observation = ToyWorld(1).observation
    with Recorder(tmp_path / "run.mcap", "toy") as recorder:
        for _ in range(200):
            recorder.record(observation, Command())
        assert recorder.lost >= 179
        go_on.set()
    assert len(read_recording(tmp_path / "run.mcap").ticks) == 200 - recorder.lost


def test_a_full_disk_is_told_at_the_end_and_does_not_stop_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(recording._TickWriter, "write", full)
    observation = ToyWorld(1).observation
    recorder = Recorder(tmp_path / "run.mcap", "toy")
    for _ in range(2 * recording.BACKLOG):
        recorder.record(observation, Command())
    with pytest.raises(RecordingError, match="No space left"):
        recorder.close()
    recorder.close()


def test_an_exception_in_the_run_leaves_a_whole_file(tmp_path: Path) -> None:
    def fails() -> None:
        with Recorder(tmp_path / "run.mcap", "toy", RUN) as recorder:
            recorder.record(ToyWorld(1).observation, Command())
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fails()
    assert read_recording(tmp_path / "run.mcap").complete


@pytest.mark.parametrize("content", [b"", b"no recording", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" + bytes(100)])
def test_another_file_is_one_message(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "other.mcap").write_bytes(content)
    with pytest.raises(RecordingError, match=r"other\.mcap (is|cannot|has)") as caught:
        read_recording(tmp_path / "other.mcap")
    assert "\n" not in str(caught.value)


def test_a_missing_file_and_a_missing_folder_are_one_message(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="No such file"):
        read_recording(tmp_path / "none.mcap")
    with pytest.raises(RecordingError, match="No such file"):
        Recorder(tmp_path / "none" / "run.mcap", "toy")
