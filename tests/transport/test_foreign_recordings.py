"""Recordings that anybody may have written: read, whatever their topics are called, or refused in one line."""

import json
import math
import sqlite3
import struct
import tracemalloc
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from toy_world import ToyWorld, wander

from transport import codec
from transport.messages import NANOSECONDS, Pose, Scan
from transport.recording import RecordedScene, Recorder, RecordingError, Topics, drawings, read_recording, reading
from transport.recording import messages as reader
from transport.recording.frames import inverse, placed, pose_of
from transport.world import LockstepRobot

BEAT = NANOSECONDS // 10
LATER = 1_700_000_000 * NANOSECONDS
MOUNT = Pose(0.1, -0.05, 0.3)


def sensed(ticks=30, seed=3):
    """What a toy robot senses, tick by tick, with the command it is given."""
    robot = LockstepRobot(ToyWorld(seed))
    for _ in range(ticks):
        observation = robot.observe()
        command = wander(observation)
        yield observation, command
        robot.command(command)


def transform(parent, child, pose, stamp=0):
    half = pose.heading / 2
    return codec.Transform(stamp, parent, child, pose.x, pose.y, math.sin(half), math.cos(half))


def messages(scan="/base_scan", odometry="/wheel/odometry", command="/cmd_vel"):
    """Topic, type, time and bytes of what a robot of somebody else's sends."""
    static = codec.encode_transforms(transform("base_link", "laser", MOUNT))
    yield "/tf_static", codec.TRANSFORMS, LATER, static
    for observation, answer in sensed():
        at = LATER + observation.stamp
        yield odometry, codec.ODOMETRY, at, codec.encode_odometry(observation.odometry)
        yield scan, codec.LASER_SCAN, at + 1, codec.encode_scan(observation.scan)
        yield command, codec.TWIST, at + 2, codec.encode_twist(answer.twist)


def bag(folder, said, plugin=StoragePlugin.MCAP, mode=None):
    """A rosbag2 folder, as ROS 2's own recorder lays it out."""
    writer = BagWriter(folder, version=9, storage_plugin=plugin)
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for topic, kind, at, data in said:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=codec.TYPES)
            writer.write(connections[topic], at, data)
    return folder


@pytest.mark.parametrize(
    ("plugin", "mode"),
    [
        (StoragePlugin.MCAP, None),
        (StoragePlugin.MCAP, CompressionMode.FILE),
        (StoragePlugin.SQLITE3, None),
        (StoragePlugin.SQLITE3, CompressionMode.FILE),
        (StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
    ],
)
def test_a_rosbag2_folder_is_read_at_the_robots_beat(tmp_path, plugin, mode):
    recording = read_recording(bag(tmp_path / "bag", messages(), plugin, mode))
    expected = [observation for observation, _ in sensed()]
    assert (recording.own, recording.complete, recording.skipped) == (False, True, 0)
    assert recording.topics == Topics("/base_scan", "/wheel/odometry", "/cmd_vel")
    beams = expected[0].scan.geometry
    assert (recording.laser.beams, recording.laser.angle_min) == (beams.beams, beams.angle_min)
    assert recording.laser.angle_max == pytest.approx(beams.angle_max, abs=1e-6)
    assert len(recording.ticks) == len(expected)
    for tick, observation in zip(recording.ticks, expected, strict=True):
        assert tick.observation.scan.ranges.tobytes() == observation.scan.ranges.tobytes()
        # At a beat, which falls on the coming of a scan, the odometry is that of a nanosecond ago.
        assert (tick.observation.odometry.x, tick.observation.odometry.y) == (
            observation.odometry.x,
            observation.odometry.y,
        )
        assert tick.observation.link.odometry_age == pytest.approx(1e-9)
    stamps = [tick.observation.stamp for tick in recording.ticks]
    assert stamps == [BEAT * number for number in range(1, len(stamps) + 1)]


def test_the_files_of_a_folder_are_read_by_themselves_too(tmp_path):
    folder = bag(tmp_path / "bag", messages(), StoragePlugin.SQLITE3)
    whole = read_recording(folder)
    assert len(read_recording(folder / "bag.db3").ticks) == len(whole.ticks)
    (folder / "bag.db3").rename(folder / "bag_0.db3")
    (folder / "metadata.yaml").unlink()
    assert len(read_recording(folder).ticks) == len(whole.ticks)


def test_where_the_laser_sits_is_found(tmp_path):
    mount = read_recording(bag(tmp_path / "bag", messages())).mount
    assert (mount.x, mount.y, mount.heading) == pytest.approx((MOUNT.x, MOUNT.y, MOUNT.heading))


def test_what_is_missing_or_ambiguous_is_named(tmp_path):
    only_scans = [one for one in messages() if one[1] != codec.ODOMETRY]
    with pytest.raises(RecordingError, match=r"has no odometry .* it has /base_scan \(sensor_msgs/msg/LaserScan\)"):
        read_recording(bag(tmp_path / "a", only_scans))
    both = [*messages(scan="/front"), *messages(scan="/rear")]
    path = bag(tmp_path / "b", both)
    with pytest.raises(
        RecordingError, match=r"several topics for the scan: name one with --scan; it has /front .*, /rear "
    ):
        read_recording(path)
    assert read_recording(path, Topics(scan="/rear")).topics.scan == "/rear"
    with pytest.raises(RecordingError, match="has no sensor_msgs/msg/LaserScan on `/side`"):
        read_recording(path, Topics(scan="/side"))
    usual = [*messages(scan="/scan"), *messages(scan="/scan_filtered")]
    assert read_recording(bag(tmp_path / "c", usual)).topics.scan == "/scan"


def test_sensors_that_fall_silent_grow_old(tmp_path):
    silent = [one for one in messages() if one[1] != codec.LASER_SCAN or one[2] < LATER + 10 * BEAT]
    ages = [tick.observation.link.scan_age for tick in read_recording(bag(tmp_path / "bag", silent)).ticks]
    assert max(ages[:8]) < 0.11
    assert ages[-1] > 1.5
    assert ages == sorted(ages[:9]) + ages[9:]


def test_a_long_gap_is_bridged_for_a_while_and_left_out_then(tmp_path):
    early = list(messages())
    later = 10**6 * NANOSECONDS
    late = [(topic, kind, at + later, data) for topic, kind, at, data in early]
    ticks = read_recording(bag(tmp_path / "bag", [*early, *late])).ticks
    assert len(ticks) == pytest.approx(2 * 30 + 100, abs=2)
    stamps = [tick.observation.stamp for tick in ticks]
    assert stamps == sorted(stamps)
    assert all(stamp % BEAT == 0 for stamp in stamps)
    ages = [tick.observation.link.scan_age for tick in ticks]
    assert max(ages) == pytest.approx(10.0, abs=0.2)
    assert min(ages) >= 0.0
    assert stamps[-1] > later


def test_a_recording_of_days_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(reading, "MOST_TICKS", 20)
    with pytest.raises(RecordingError, match="longer than 20 periods"):
        read_recording(bag(tmp_path / "bag", messages()))


def test_messages_that_are_none_are_skipped_and_counted(tmp_path):
    corrupt = [
        (topic, kind, at, data[:20] if index % 7 == 5 else data)
        for index, (topic, kind, at, data) in enumerate(messages())
    ]
    recording = read_recording(bag(tmp_path / "bag", corrupt))
    assert 0 < recording.skipped < 20
    assert len(recording.ticks) > 20


def test_scans_of_other_habits_are_put_in_order(tmp_path):
    """A laser that turns clockwise, and one whose number of beams varies, give the same facts."""
    turned, varied = [], []
    for number, (topic, kind, at, data) in enumerate(messages()):
        if kind == codec.LASER_SCAN:
            scan = codec.decode_scan(data)
            beams = scan.geometry
            clockwise = replace(beams, angle_min=beams.angle_max, angle_increment=-beams.angle_increment)
            turned.append((topic, kind, at, codec.encode_scan(Scan(scan.stamp, clockwise, scan.ranges[::-1]))))
            some = number % 3
            fewer = replace(beams, beams=beams.beams - some)
            cut = scan.ranges[: beams.beams - some]
            varied.append((topic, kind, at, codec.encode_scan(Scan(scan.stamp, fewer, cut))))
        else:
            turned.append((topic, kind, at, data))
            varied.append((topic, kind, at, data))
    plain = read_recording(bag(tmp_path / "plain", messages())).ticks
    clockwise = read_recording(bag(tmp_path / "turned", turned))
    assert clockwise.skipped == 0
    for one, other in zip(clockwise.ticks, plain, strict=True):
        assert one.observation.scan.geometry.angle_increment > 0
        assert np.allclose(one.observation.scan.ranges, other.observation.scan.ranges, equal_nan=True)
    recording = read_recording(bag(tmp_path / "varied", varied))
    assert (recording.skipped, len(recording.ticks)) == (0, len(plain))
    assert len({tick.observation.scan.geometry.beams for tick in recording.ticks}) == 1


def record(path, ticks=20, setting=None, pose=None):
    with Recorder(path, "toy", {"machine": "toy"}, setting=setting, patience=10.0) as recorder:
        for observation, command in sensed(ticks):
            step = partial(dict, states=["a"], regions={"toy": "wandering"})
            recorder.record(observation, command, step, pose=pose and pose(observation))
    return path


def rewritten(source, target, *, topics=lambda topic: topic, metadata=lambda said: said):
    """A copy of an MCAP file with other topics and other metadata."""
    with source.open("rb") as old, target.open("wb") as new:
        reader, writer = make_reader(old), Writer(new)
        writer.start(profile="ros2")
        schemas, channels = {}, {}
        for schema, channel, message in reader.iter_messages():
            if schema.id not in schemas:
                schemas[schema.id] = writer.register_schema(schema.name, schema.encoding, schema.data)
            if channel.id not in channels:
                name = topics(channel.topic)
                channels[channel.id] = writer.register_channel(name, channel.message_encoding, schemas[schema.id])
            writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
        for one in reader.iter_metadata():
            said = metadata(dict(one.metadata))
            if said is not None:
                writer.add_metadata(one.name, said)
        writer.finish()
    return target


@pytest.mark.parametrize(
    "changed",
    [
        {"metadata": lambda _: None},
        {"metadata": lambda said: {key: value for key, value in said.items() if key != "robot"}},
        {"topics": lambda topic: topic.replace("/toy/", "/"), "metadata": lambda _: None},
        {"topics": lambda topic: topic.replace("/toy/", "/other/")},
    ],
    ids=["no metadata", "no robot in it", "no namespace", "another namespace"],
)
def test_a_recording_of_ours_is_known_by_its_ticks(tmp_path, changed):
    whole = read_recording(record(tmp_path / "run.mcap"))
    back = read_recording(rewritten(tmp_path / "run.mcap", tmp_path / "copy.mcap", **changed))
    assert back.own
    assert [tick.step for tick in back.ticks] == [tick.step for tick in whole.ticks]
    for one, other in zip(back.ticks, whole.ticks, strict=True):
        assert one.observation.scan.ranges.tobytes() == other.observation.scan.ranges.tobytes()
        assert one.observation.odometry == other.observation.odometry


def test_a_dated_recording_gives_back_the_robots_own_stamps(tmp_path):
    plain = read_recording(record(tmp_path / "plain.mcap"))
    dated = read_recording(record(tmp_path / "dated.mcap", setting=RecordedScene(epoch=LATER)))
    for one, other in zip(dated.ticks, plain.ticks, strict=True):
        assert one.observation.stamp == other.observation.stamp
        assert one.observation.scan.stamp == other.observation.scan.stamp
        assert one.observation.odometry == other.observation.odometry
    with (tmp_path / "dated.mcap").open("rb") as file:
        times = [message.log_time for _, _, message in make_reader(file).iter_messages()]
    assert min(times) >= LATER


def test_the_transform_tree_leads_from_each_scan_to_the_map(tmp_path):
    """A point seen by the laser lies in the map where the robot's true pose puts it."""

    def truth(observation):
        return Pose(3.0 + 0.01 * observation.time, -2.0, 0.4 + 0.05 * observation.time)

    grid = drawings.Grid(np.zeros((3, 4), dtype=np.int8), 0.5, -1.0, -2.0)
    setting = RecordedScene(((0.1, 0.1), (-0.1, 0.1), (0.0, -0.1)), MOUNT, grid, LATER)
    record(tmp_path / "run.mcap", 12, setting, truth)
    transforms, seen, kinds = [], [], {}
    with (tmp_path / "run.mcap").open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            kinds[channel.topic] = schema.name
            if schema.name == codec.TRANSFORMS:
                transforms += codec.decode_transforms(message.data)
            if channel.topic == "/toy/scan":
                seen.append((codec.decode_scan(message.data).stamp, codec.frame_of(message.data, codec.LASER_SCAN)))
    assert kinds["/map"] == drawings.GRID
    assert kinds["/toy/footprint"] == drawings.OUTLINE
    assert kinds["/toy/state/toy"] == codec.STRING
    assert len(seen) == 12
    for (stamp, frame), (observation, _) in zip(seen, sensed(12), strict=True):
        held = [one for one in transforms if one.stamp == stamp or one.parent == "base_link"]
        pose = pose_of(frame, "map", held)
        expected = placed(MOUNT, truth(observation))
        assert (pose.x, pose.y) == pytest.approx((expected.x, expected.y), abs=1e-9)
        assert math.remainder(pose.heading - expected.heading, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_where_the_true_pose_is_not_known_the_map_is_that_of_the_odometry(tmp_path):
    record(tmp_path / "run.mcap", 3)
    with (tmp_path / "run.mcap").open("rb") as file:
        messages = list(make_reader(file).iter_messages("/tf_static"))
    found = codec.decode_transforms(messages[0][2].data)
    assert {(one.parent, one.child) for one in found} == {("base_link", "laser"), ("map", "odom")}


angle, length = st.floats(-3.0, 3.0), st.floats(-10.0, 10.0)
poses = st.builds(Pose, length, length, angle)


@given(one=poses, other=poses)
def test_a_frame_and_its_inverse_undo_each_other(one, other):
    there = placed(inverse(other), other)
    assert (there.x, there.y) == pytest.approx((0.0, 0.0), abs=1e-9)
    chain = [transform("map", "odom", other), transform("odom", "base", one)]
    found = pose_of("base", "map", chain)
    expected = placed(one, other)
    assert (found.x, found.y) == pytest.approx((expected.x, expected.y), abs=1e-9)
    up = pose_of("map", "base", chain)
    assert (placed(up, found).x, placed(up, found).y) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert pose_of("elsewhere", "map", chain) is None


# What nobody should have to fear.


def mcap(path, records):
    """An MCAP file with raw records: an opcode and a body each."""
    body = b"".join(struct.pack("<BQ", opcode, len(data)) + data for opcode, data in records)
    path.write_bytes(b"\x89MCAP0\r\n" + body)
    return path


def text(words):
    return struct.pack("<I", len(words)) + words.encode()


def chunk(declared, compression, data):
    return 6, struct.pack("<QQQI", 0, 0, declared, 0) + text(compression) + struct.pack("<Q", len(data)) + data


HEADER = (1, text("ros2") + text("test"))
NAMED = (12, text("run") + struct.pack("<I", len(text("robot") + text("r"))) + text("robot") + text("r"))


@pytest.mark.parametrize(
    ("records", "reason"),
    [
        ([HEADER, chunk(2**32, "zstd", b"")], "declares 4294967296 bytes"),
        ([HEADER, chunk(2**63, "", b"")], "declares"),
        ([HEADER, chunk(1000, "zstd", zstandard.compress(bytes(10**8)))], "holds another number"),
        ([HEADER, chunk(10**7, "zstd", zstandard.compress(bytes(100)))], "holds another number"),
        ([HEADER, chunk(10, "none such", b"0123456789")], "cannot be read"),
        ([HEADER, (6, struct.pack("<QQQI", 0, 0, 10, 0) + text("") + struct.pack("<Q", 2**62))], "cannot be read"),
        ([HEADER, (4, b"")], "cannot be read"),
        ([HEADER, (3, struct.pack("<H", 1) + struct.pack("<I", 2**32 - 1))], "cannot be read"),
        ([HEADER], "cannot be read"),
    ],
)
def test_what_a_file_declares_is_not_believed(tmp_path, records, reason):
    path = mcap(tmp_path / "a.mcap", records)
    tracemalloc.start()
    with pytest.raises(RecordingError, match=reason) as caught:
        read_recording(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20e6
    assert "\n" not in str(caught.value)


def test_a_bag_that_was_cut_off_in_its_first_chunk_says_so(tmp_path):
    file = next(bag(tmp_path / "bag", messages()).glob("*.mcap"))
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    with pytest.raises(RecordingError, match="cannot be read: it was cut off before the first chunk was written"):
        read_recording(file)


def test_a_record_longer_than_the_file_is_a_cut(tmp_path):
    path = tmp_path / "a.mcap"
    path.write_bytes(b"\x89MCAP0\r\n" + struct.pack("<BQ", 5, 2**60))
    with pytest.raises(RecordingError, match="cannot be read"):
        read_recording(path)


def ours_saying(path, told):
    """A recording of ours one of whose ticks says something else."""
    observation, command = next(sensed(1))
    with path.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start(profile="ros2")
        for name, kind, data in (
            ("/r/scan", codec.LASER_SCAN, codec.encode_scan(observation.scan)),
            ("/r/odom", codec.ODOMETRY, codec.encode_odometry(observation.odometry)),
            ("/r/cmd_vel", codec.TWIST, codec.encode_twist(command.twist)),
            ("/r/tick", codec.STRING, codec.encode_text(told)),
        ):
            schema = writer.register_schema(kind, "ros2msg", b"")
            writer.add_message(writer.register_channel(name, "cdr", schema), 0, data, 0)
        writer.finish()
    return path


TOLD = {"stamp": 0, "door": None, "link": {}, "ring": False, "answers": 0, "step": {}}


@pytest.mark.parametrize(
    ("told", "reason"),
    [
        ("[" * 100_000, "not JSON"),
        ("{", "not JSON"),
        ("[]", "must be"),
        ("{}", "is missing"),
        (json.dumps({**TOLD, "step": [1, 2]}), "`step`"),
        (json.dumps({**TOLD, "step": {"states": "abc"}}), "must be"),
        (json.dumps({**TOLD, "step": {"taken": [[[]]]}}), "must be"),
        (json.dumps({**TOLD, "step": {"x": json.loads("[" * 20 + "]" * 20)}}), "deeper than 8"),
        (json.dumps({**TOLD, "stamp": 2**70}), "stamp"),
        (json.dumps({**TOLD, "stamp": -1}), "stamp"),
        (json.dumps({**TOLD, "door": 7}), "door"),
        (json.dumps({**TOLD, "link": []}), "link"),
    ],
)
def test_a_tick_is_validated(tmp_path, told, reason):
    with pytest.raises(RecordingError, match=reason) as caught:
        read_recording(ours_saying(tmp_path / "a.mcap", told))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500


def test_a_valid_tick_is_read(tmp_path):
    assert len(read_recording(ours_saying(tmp_path / "a.mcap", json.dumps(TOLD))).ticks) == 1


TOPICS = "CREATE TABLE topics (id, name, type, serialization_format);INSERT INTO topics VALUES (1, 'a', 'b', 'cdr');"


def test_a_database_with_other_tables_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(reader, "STEPS", 100_000)
    for name, script in (
        ("empty", ""),
        ("other", "CREATE TABLE messages (id, topic_id, timestamp, data); CREATE TABLE topics (id);"),
        (
            "endless",
            TOPICS + "CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n) "
            "SELECT id, 1 AS topic_id, id AS timestamp, x'00' AS data FROM n;",
        ),
        (
            "numbers",
            TOPICS
            + "CREATE TABLE messages (id, topic_id, timestamp, data); INSERT INTO messages VALUES (1, 1, 'x', 5);",
        ),
    ):
        path = tmp_path / f"{name}.db3"
        with closing(sqlite3.connect(path)) as database:
            database.executescript(script + "CREATE TABLE filler (a);")
        with pytest.raises(RecordingError, match=r"not a rosbag2 database|has no"):
            read_recording(path)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "is empty"),
        (b"#ROSBAG V2.0\n", "ROS 1"),
        (zstandard.compress(zstandard.compress(b"#ROSBAG V2.0\n")), "compressed twice"),
        (zstandard.compress(b"#ROSBAG V2.0\n"), "ROS 1"),
        (b"\x28\xb5\x2f\xfd" + b"\xff" * 50, "cannot be decompressed"),
        (b"SQLite format 3\0" + bytes(200), "not a rosbag2 database"),
        (b"what is this", "neither an MCAP file nor"),
    ],
)
def test_other_files_are_refused(tmp_path, content, reason):
    (tmp_path / "a").write_bytes(content)
    with pytest.raises(RecordingError, match=reason):
        read_recording(tmp_path / "a")


def test_folders_and_devices_are_refused(tmp_path):
    with pytest.raises(RecordingError, match="folder without"):
        read_recording(tmp_path)
    with pytest.raises(RecordingError, match="not a regular file"):
        read_recording(Path("/dev/zero"))


def test_messages_in_another_encoding_are_named(tmp_path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("foxglove.LaserScan", "protobuf", b"")
        writer.add_message(writer.register_channel("/scan", "protobuf", schema), 0, b"1", 0)
        writer.finish()
    with pytest.raises(RecordingError, match=r"has no scan .* /scan \(protobuf"):
        read_recording(path)


def test_names_in_a_file_cannot_write_to_the_terminal(tmp_path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("evil\x1b[31m/msg/X\n", "ros2msg", b"")
        writer.add_message(writer.register_channel("/a\x1b]0;x\x07\nb", "cdr", schema), 0, b"1", 0)
        writer.finish()
    with pytest.raises(RecordingError, match="has no scan") as caught:
        read_recording(path)
    assert str(caught.value).isprintable()


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("written")
    return folder, record(folder / "run.mcap", 4).read_bytes()


@settings(max_examples=60, deadline=None)
@given(place=st.floats(0, 1), data=st.binary(min_size=1, max_size=12), cut=st.booleans())
def test_a_spoilt_file_is_read_or_refused(written, place, data, cut):
    folder, whole = written
    at = int(place * len(whole))
    corrupt = whole[:at] + data + (b"" if cut else whole[at + len(data) :])
    path = folder / "corrupt.mcap"
    path.write_bytes(corrupt)
    try:
        recording = read_recording(path)
    except RecordingError as error:
        refusal = str(error)
    else:
        assert len(recording.ticks) <= 4
        return
    assert refusal.startswith(str(path))
    assert "\n" not in refusal


def test_a_laser_that_hangs_upside_down_has_no_place_in_the_plane():
    upside_down = codec.Transform(0, "base_link", "laser", 0.0, 0.0, 0.0, 1.0)
    payload = bytearray(codec.encode_transforms(upside_down))
    # The quaternion's four numbers end the message; x = 1 and w = 0 is a half turn about the axis ahead.
    payload[-32:] = struct.pack("<4d", 1.0, 0.0, 0.0, 0.0)
    assert codec.decode_transforms(bytes(payload)) == ()
