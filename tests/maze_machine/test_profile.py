"""Profiles: what ships, what overrides what, and what is said about mistakes."""

import math
import re
import tomllib

import pytest

from maze_machine.catalogue.profile import Profile, ProfileError, load_profile, profile_text, shipped_profiles
from maze_machine.errors import ExitStatus, UsageError
from transport.description import Laser


def test_the_shipped_pico_is_the_default():
    assert load_profile("pico") == Profile()


def test_every_shipped_profile_is_valid_and_the_hardware_has_other_gains():
    profiles = {name: load_profile(name) for name in shipped_profiles()}
    assert profiles["pico-hardware"].skills.motion.heading_gain < profiles["pico"].skills.motion.heading_gain


def test_the_text_of_a_profile_is_read_back_as_the_same_profile():
    profile = load_profile("pico-hardware", ["robot.name=pico2", "machines.pledge.cruise='0.3 m/s'"])
    assert Profile.model_validate(tomllib.loads(profile_text(profile))) == profile


def test_the_command_line_wins_over_the_file(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("[skills.motion]\nheading_gain = 1.0\nslow_gain = 0.5\n")
    profile = load_profile(str(file), ["skills.motion.heading_gain=3", "robot.laser.beams = 180", "robot.name=pico7"])
    assert profile.skills.motion.heading_gain == 3.0
    assert profile.skills.motion.slow_gain == 0.5
    assert profile.robot.laser.beams == 180
    assert profile.robot.name == "pico7"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[skills.motion]\nheading_gian = 1", "unknown key `skills.motion.heading_gian`; did you mean `heading_gain`?"),
        ("[robt]\nname = 'x'", "unknown key `robt`; did you mean `robot`?"),
        ("[robot.limits]\nspeed = -1", "`robot.limits.speed` must be at least 0.001, not -1"),
        ("[robot.limits]\nspeed = 'fast'", "`robot.limits.speed` must be a number, not 'fast'"),
        ("[robot]\nbase = 'tracks'", "`robot.base` must have `kind`, one of 'holonomic', 'differential'"),
        ("[robot.base]\ntrack = 0.3", "`robot.base` must have `kind`, one of 'holonomic', 'differential'"),
        ("[robot.base]\nkind = 'differential'\ntrack = -1", "`robot.base.track` must be more than 0, not -1"),
        ("[robot.base]\nkind = 'differential'\ntrak = 1", "unknown key `robot.base.trak`"),
        ("[robot\n", "line 1"),
    ],
)
def test_a_mistake_in_a_file_is_told_with_file_key_reason_and_way_out(tmp_path, text, told):
    file = tmp_path / "mine.toml"
    file.write_text(text)
    with pytest.raises(ProfileError) as caught:
        load_profile(str(file))
    message = f"{caught.value}; {caught.value.way_out}"
    assert message.startswith(str(file))
    assert told in message
    assert caught.value.status == ExitStatus.BAD_FILE


@pytest.mark.parametrize(
    "override", ["skills.motion.heading_gain", "=3", "skills.motion.nothing=3", "robot.name.x=3", "robot.period=0"]
)
def test_a_mistake_in_an_override_is_a_usage_error(override):
    with pytest.raises(UsageError, match="--set"):
        load_profile("pico", [override])


def test_an_unknown_profile_is_told_with_those_that_ship(tmp_path):
    with pytest.raises(ProfileError) as caught:
        load_profile(str(tmp_path / "nothing"))
    assert "pico-hardware" in caught.value.way_out


@pytest.mark.parametrize(
    "overrides", [["link.keys=rmw_zenoh", "link.gate=false"], ["robot.laser.angle_min=2", "robot.laser.angle_max=-2"]]
)
def test_overrides_are_judged_as_a_whole_whatever_their_order(overrides):
    assert load_profile("pico", overrides) == load_profile("pico", overrides[::-1])


@pytest.mark.parametrize(
    ("overrides", "told"),
    [
        (["robot.period=0", "robot.name=x"], "--set robot.period=0: `robot.period` must be at least 0.001"),
        (["robot.name=x", "robot.nam=y"], "--set robot.nam=y: unknown key `robot.nam`"),
        (
            ["link.keys=rmw_zenoh", "robot.name=x", "link.gate=true"],
            "--set link.gate=true: `link` must have `gate = false`",
        ),
    ],
)
def test_of_several_overrides_the_one_at_fault_is_named(overrides, told):
    with pytest.raises(UsageError, match=re.escape(told)):
        load_profile("pico", overrides)


@pytest.mark.parametrize(
    ("laser", "told"),
    [
        ("angle_min = 1.0\nangle_max = 1.0", "must have `angle_min` (1) below `angle_max` (1)"),
        ("angle_min = -200.0\nangle_max = 200.0", "has its angles in radians: 200 degrees are 3.4907 rad"),
        ("angle_min = -4.0\nangle_max = 4.0", "cannot span more than a full turn: it is 6.2832 rad, not 8"),
        ("range_min = 5.0\nrange_max = 5.0", "must have `range_min` (5) below `range_max` (5)"),
        ("angle_min = nan", "must be a finite number, not nan"),
        ("mount_heading = inf", "must be a finite number, not inf"),
        ("beams = 1", "`robot.laser.beams` must be at least 2, not 1"),
    ],
)
def test_an_impossible_laser_is_refused_when_the_profile_is_read(tmp_path, laser, told):
    file = tmp_path / "mine.toml"
    file.write_text(f"[robot.laser]\n{laser}\n")
    with pytest.raises(ProfileError, match=re.escape(told)):
        load_profile(str(file))


def test_a_laser_that_turns_clockwise_is_the_same_fan(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("[robot.laser]\nangle_min = 3.1\nangle_max = -3.1\n")
    laser = load_profile(str(file)).robot.laser
    assert (laser.angle_min, laser.angle_max) == (-3.1, 3.1)


@pytest.mark.parametrize("ends", [(0.0, math.tau), (-math.pi, math.pi), (0.0, 6.26573), (-2.0, 2.0)])
def test_lasers_as_they_are_sold_are_possible(ends):
    Laser(beams=360, angle_min=ends[0], angle_max=ends[1])


@pytest.mark.parametrize(
    "footprint", ["[[0,0],[1,0],[2,0]]", "[]", "[[0,0]]", "[[0,0],[1,1]]", "[[nan,0],[1,0],[0,1]]"]
)
def test_a_footprint_without_an_area_is_refused(footprint):
    with pytest.raises(UsageError, match=r"with an area|3 to 100 corners|finite number"):
        load_profile("pico", [f"robot.footprint={footprint}"])


def test_the_corners_of_a_footprint_may_be_given_clockwise():
    robot = load_profile("pico", ["robot.footprint=[[-0.1,-0.1],[-0.1,0.1],[0.1,0.1],[0.1,-0.1]]"]).robot
    assert robot.footprint == ((0.1, -0.1), (0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1))


@pytest.mark.parametrize(
    "laser",
    [
        "angle_min = -0.3\nangle_max = 0.3",
        "angle_min = 0.0",
        "mount_heading = 3.14",
        "angle_max = 0.4",
        "mount_heading = 1.6",
    ],
)
def test_a_laser_that_does_not_see_the_lane_is_refused(tmp_path, laser):
    file = tmp_path / "mine.toml"
    file.write_text(f"[robot.laser]\n{laser}\n")
    with pytest.raises(
        ProfileError, match=r"must have a laser that sees its lane: 0\.2 m to either side, 0\.357 m ahead"
    ):
        load_profile(str(file))


@pytest.mark.parametrize(
    "ends", [(-0.6, 0.6), (0.0, math.tau * 359 / 360), (1.0, 1.0 + math.tau * 179 / 180), (-math.pi, 1)]
)
def test_a_laser_that_sees_the_lane_may_begin_anywhere(ends):
    first, last = (f"robot.laser.angle_{end}={value}" for end, value in zip(("min", "max"), ends, strict=True))
    assert load_profile("pico", [first, last, "robot.laser.beams=180"]).robot.laser.angle_min == ends[0]


@pytest.mark.parametrize("key", ["dead_man", "answer_age", "stale"])
def test_a_robot_drives_on_blind_for_two_seconds_at_most(key):
    with pytest.raises(
        UsageError, match=f"must have `{key}` of at most 2 s, not 60: for that time the robot drives on"
    ):
        load_profile("pico", [f"link.{key}=60"])
    assert getattr(load_profile("pico", [f"link.{key}=2"]).link, key) == 2.0
