"""Robot profiles: everything tunable of a robot in one TOML file, validated, overridable from the command line."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, Field, ValidationError

from maze_machine.catalogue.project import default_robot
from maze_machine.catalogue.shipped import find_file
from maze_machine.errors import CommandError, FileError, UsageError
from perception.settings import PerceptionSettings
from skills.settings import SkillSettings
from transport.arithmetic import atan2
from transport.description import RobotDescription, fitted
from transport.section import Grows, Settings
from transport.settings import LinkSettings
from transport.toml import TomlError, read_toml, toml_value
from transport.wording import in_words, key_of, shortened

Location = tuple[int | str, ...]
"""The place of a value in a profile: sections and key."""

SHIPPED = Path(__file__).parent / "profiles"


class ProfileError(FileError):
    """A profile that cannot be used; the message names the file, the key, the reason and a suggestion."""


LONGEST_BLIND = 2.0
"""A robot may drive on without a new look or a new command for this long at most, s."""


def _stops_soon(link: LinkSettings) -> LinkSettings:
    """Refuse a link whose robot drives on for long after it has lost its eyes or its controller."""
    for key in ("dead_man", "answer_age", "stale"):
        value = getattr(link, key)
        if value > LONGEST_BLIND:
            raise ValueError(
                f"must have `{key}` of at most {LONGEST_BLIND:g} s, not {value:g}: for that time the robot drives on "
                "without seeing anything new, or without a command"
            )
    return link


def _sees_its_lane(robot: RobotDescription) -> RobotDescription:
    """Refuse a laser that does not see the robot's whole lane where it must begin to brake."""
    laser, needed = robot.laser, robot.radius + robot.stopping_distance
    ahead, span = needed - laser.mount_x, laser.angle_max - laser.angle_min + abs(laser.angle_increment)
    for edge in (robot.half_width, -robot.half_width):
        direction = atan2(edge - laser.mount_y, ahead)
        if (direction - laser.angle_min - laser.mount_heading) % math.tau > span:
            raise ValueError(
                f"must have a laser that sees its lane: {robot.half_width:.3g} m to either side, {needed:.3g} m ahead, "
                f"where it must begin to brake; nothing is seen in the direction of {direction:.2f} rad. Correct "
                "`laser.angle_min`, `laser.angle_max` or `laser.mount_heading`"
            )
    return robot


class Profile(Settings):
    """The settings of a robot; the sections of a profile file."""

    robot: Annotated[RobotDescription, AfterValidator(_sees_its_lane)] = RobotDescription()
    """The robot's body: shape, limits, laser, period."""
    link: Annotated[LinkSettings, AfterValidator(_stops_soon)] = LinkSettings()
    """How to reach the robot, and the timeouts of both sides."""
    perception: PerceptionSettings = PerceptionSettings()
    """Thresholds and sizes of perception; those left out grow with the robot."""
    skills: SkillSettings = SkillSettings()
    """Gains and limits of the motion skills; those left out grow with the robot."""
    machines: dict[str, dict[str, bool | int | float | str]] = Field(default_factory=dict)
    """Parameters of machines, by the machine's name: ``[machines.pledge]``, ``cruise = "0.4 m/s"``."""


def shipped_profiles() -> dict[str, Path]:
    """The profiles that come with the project, by name."""
    return {path.stem: path for path in sorted(SHIPPED.glob("*.toml"))}


def load_profile(name: str = "pico", overrides: Iterable[str] = ()) -> Profile:
    """Read a profile.

    Args:
        name: a TOML file, or the name of a shipped profile.
        overrides: settings that replace the file's, each ``section.key=value`` with a TOML value; they are validated
            together, independent of their order.

    Raises:
        ProfileError: the file cannot be read, or a key or value in it is invalid.
        UsageError: an override is invalid.
    """
    path = find_file("profile", name, shipped_profiles(), ProfileError)
    try:
        table = read_toml(path)
    except (OSError, TomlError) as error:
        raise ProfileError(f"{path}: {error}") from None
    profile, settings = _validated(table, lambda _: str(path), ProfileError), list(overrides)
    for override in settings:
        _set(table, override)
    return _validated(table, lambda place: _override_of(place, settings), UsageError) if settings else profile


def chosen_profile(named: str | None, machine: str | None = None, overrides: Iterable[str] = ()) -> Profile:
    """The profile that is named, else that of a machine's project, else PICO's.

    Args:
        named: a TOML file or the name of a shipped profile; or None.
        machine: a machine; where it is a file, its project counts, else that around the present folder.
        overrides: as for ``load_profile``.

    Raises:
        ProfileError: the file cannot be used.
        FileError: the project's settings are wrong.
        UsageError: an override cannot be used.
    """
    return load_profile(default_robot(named, machine), overrides)


def _override_of(place: Location, overrides: Sequence[str]) -> str:
    """The override that caused an error at a place of the profile: the last one there, or all if there is none."""
    fault = [str(part) for part in place]
    for override in reversed(overrides):
        key = [part.strip() for part in override.partition("=")[0].split(".")]
        if all(one == other for one, other in zip(fault, key, strict=False)):
            return f"--set {shortened(override)}"
    return " ".join(f"--set {shortened(override)}" for override in overrides)


def _set(table: dict[str, Any], override: str) -> None:
    """Put ``section.key=value`` into a table of tables."""
    key, equals, text = override.partition("=")
    if not equals or not key.strip():
        raise UsageError(f"--set {override}: no value", "write section.key=value")
    *sections, last = (part.strip() for part in key.split("."))
    for section in sections:
        table = table.setdefault(section, {})
        if not isinstance(table, dict):
            raise UsageError(f"--set {override}: `{section}` is a value, not a section")
    try:
        table[last] = toml_value(text.strip())
    except TomlError as error:
        raise UsageError(f"--set {key}: the value cannot be read: {error}") from None


def _validated(table: Mapping[str, Any], source: Callable[[Location], str], kind: type[CommandError]) -> Profile:
    try:
        profile = Profile.model_validate(table)
    except ValidationError as error:
        first = error.errors()[0]
        where = source(first["loc"])
        if first["type"] == "extra_forbidden":
            raise kind(f"{where}: unknown key `{key_of(first['loc'])}`", _nearest_key(first["loc"])) from None
        raise kind(f"{where}: {in_words(first)}") from None
    robot, perception, skills = profile.robot, profile.perception, profile.skills
    return profile.model_copy(update={"perception": fitted(perception, robot), "skills": fitted(skills, robot)})


def _nearest_key(location: Location) -> str:
    """A suggestion for an unknown key."""
    section: type[BaseModel] = Profile
    for part in location[:-1]:
        annotation = section.model_fields[str(part)].annotation
        if not (isinstance(annotation, type) and issubclass(annotation, BaseModel)):
            return ""
        section = annotation
    known = list(section.model_fields)
    close = get_close_matches(str(location[-1]), known, n=1)
    return f"did you mean `{close[0]}`?" if close else f"known here: {', '.join(known)}"


def profile_text(profile: Profile) -> str:
    """A profile as a commented TOML file: every key with its value and meaning."""
    return "\n".join(_section(profile, ())).lstrip("\n") + "\n"


def _section(section: BaseModel, path: tuple[str, ...]) -> Iterator[str]:
    """The lines of a section: its values first, then its subsections."""
    fields = type(section).model_fields
    values = {name: getattr(section, name) for name in fields}
    plain = [name for name, value in values.items() if not isinstance(value, BaseModel | dict)]
    if plain:
        yield from ("", f"[{'.'.join(path)}]")
    for name in plain:
        yield from (f"# {line}" for line in (fields[name].description or "").splitlines())
        grows = next((mark for mark in fields[name].metadata if isinstance(mark, Grows)), None)
        if grows is not None:
            yield f"# Left out, it grows with the robot's {'size' if grows.size else 'speed'}."
        yield f"{name} = {_toml(values[name])}"
    for name, value in values.items():
        if isinstance(value, BaseModel):
            yield from _section(value, (*path, name))
        elif isinstance(value, dict):
            for key, table in value.items():
                yield from ("", f"[{'.'.join((*path, name, key))}]")
                yield from (f"{one} = {_toml(setting)}" for one, setting in table.items())


def _toml(value: object) -> str:
    """A value in TOML notation, which equals JSON's for all values of a profile."""
    return json.dumps(value, ensure_ascii=False)
