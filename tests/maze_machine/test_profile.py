"""Profiles: what ships, what overrides what, and what is said about mistakes."""

import tomllib

import pytest

from maze_machine.catalogue.profile import Profile, ProfileError, load_profile, profile_text, shipped_profiles
from maze_machine.errors import ExitStatus, UsageError


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
        ("[robot.limits]\nspeed = -1", "`robot.limits.speed` must be more than 0, not -1"),
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
