"""Recorded runs: the data of a mission in a recording, and replays with the same sensor data."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from pydantic import TypeAdapter, ValidationError

from hsm import Machine
from hsm.engine.explanation import Verdict
from hsm.engine.occurrences import event_text
from hsm.model.chart import Model
from hsm.model.unparse import value_text
from maze_machine.catalogue.library import RobotLibrary, chosen_library, robot_library
from maze_machine.catalogue.machines import find_machine, shipped_machines
from maze_machine.catalogue.profile import Profile
from maze_machine.drive.mission import Ending, Mission, TickWatcher, drive, prepare
from maze_machine.drive.operation import Recorded
from maze_machine.drive.tick import Tick
from maze_machine.drive.tick_json import line_of
from maze_machine.errors import FileError
from transport.recording import Recorder, Recording, ReplayRobot
from transport.wording import in_words

MACHINES = (".maze-machine", ".scxml")
"""The suffixes of files that a recording may name as its machine."""
LONGEST = 2_000
"""The largest part of a recorded value that is shown, characters."""
_PARAMETERS = TypeAdapter(dict[str, bool | int | float | str])


def described(mission: Mission, machine: str, more: Mapping[str, str] | None = None) -> dict[str, str]:
    """The entries of a recording that a replay needs besides the sensor data and the machine's file.

    Args:
        mission: the run.
        machine: the machine's file, or its name.
        more: further entries.
    """
    return {
        **(more or {}),
        "machine": _recorded_name(machine),
        "parameters": json.dumps(dict(mission.parameters)),
        "profile": mission.profile.model_dump_json(),
    }


def _recorded_name(machine: str) -> str:
    """The name of a shipped machine, which is the same on another computer; the path of any other."""
    path = find_machine(machine)
    return machine if shipped_machines().get(machine) == path else str(path.resolve())


class Keeper:
    """A watcher that records ticks and the end of the run.

    Args:
        recorder: where to.
    """

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder

    def __call__(self, tick: Tick) -> None:
        """Record a tick."""
        self._recorder.record(tick.observation, tick.command, lambda: tick.json, pose=tick.truth)

    def end(self, ending: Ending) -> None:
        """Record the end."""
        self._recorder.conclude(
            {
                "outcome": ending.outcome or "",
                "reason": ending.reason,
                "report": json.dumps(dict(ending.report)),
                "violations": json.dumps(list(ending.violations)),
                "broken": json.dumps(list(ending.broken)),
            }
        )


def fired(tick: Tick) -> list[str]:
    """Each transition that fired in a tick, as text: its states, and the values of its conditions."""
    taken = (one for one in tick.report.step.considered if one.verdict is Verdict.TAKEN)
    seen = (", ".join(f"{text} = {value_text(value)}" for text, value in one.values) for one in taken)
    lines = zip(tick.report.taken, [*seen, *[""] * len(tick.report.taken)], strict=False)
    return [f"{transition}{': ' if values else ''}{values}" for transition, values in lines]


def recorded_profile(recording: Recording, chosen: Profile | None = None) -> Profile:
    """The profile of the robot of a recorded run.

    Args:
        recording: the run.
        chosen: a profile to take instead; its laser is the recorded one.

    Raises:
        FileError: the recording does not say, or says it as another version of this program did.
    """
    if chosen is not None:
        return _with_laser(chosen, recording)
    if "profile" not in recording.run:
        raise FileError("the recording does not name its robot", "name its profile with --robot")
    try:
        return Profile.model_validate_json(recording.run["profile"])
    except ValidationError as error:
        words = in_words(error.errors()[0])
        raise FileError(f"the recorded profile cannot be used: {words}", "name one with --robot") from None
    except (ValueError, RecursionError) as error:
        raise FileError(f"the recording does not name its robot: {type(error).__name__}") from None


def _with_laser(profile: Profile, recording: Recording) -> Profile:
    """A profile with the laser's beams, and its mounting if known, from a recording."""
    laser, beams, mount = profile.robot.laser, recording.laser, recording.mount
    if beams is None:
        return profile
    said = {
        "beams": beams.beams,
        "angle_min": beams.angle_min,
        "angle_max": beams.angle_max,
        "range_min": beams.range_min,
        "range_max": beams.range_max,
    }
    if mount is not None:
        said |= {"mount_x": mount.x, "mount_y": mount.y, "mount_heading": mount.heading}
    try:
        seen = type(laser).model_validate({**laser.model_dump(), **said})
    except ValidationError as error:
        raise FileError(f"the recorded laser cannot be used: {in_words(error.errors()[0])}") from None
    return profile.model_copy(update={"robot": profile.robot.model_copy(update={"laser": seen})})


def recorded_mission(
    recording: Recording, machine: str | None = None, robot: Profile | None = None, library: str | None = None
) -> Mission:
    """The mission of a recorded run.

    Args:
        recording: the run.
        machine: another machine to use instead, with its default parameters; None for the same one, of which the
            recorded text is used where its file does not exist any more.
        robot: another profile; None for the recorded one.
        library: what the machine may name, as ``MODULE:NAME``; by default that of its project.

    Raises:
        FileError: the recording does not name its machine, or that does not exist any more and its text is not kept.
        MachineError: the machine has faults.
    """
    profile = recorded_profile(recording, robot)
    if machine is not None:
        return prepare(machine, profile, library=library)
    if not {"machine", "parameters"} <= set(recording.run):
        raise FileError("the recording does not name its machine", "give a machine before the recording")
    try:
        parameters = _PARAMETERS.validate_json(recording.run["parameters"])
    except (ValueError, RecursionError):
        raise FileError("the recording has invalid parameters of its machine") from None
    written = [(name, str(value)) for name, value in parameters.items()]
    with TemporaryDirectory() as folder:
        file = named_machine(recording)
        kept = None if Path(file).is_file() else recorded_text(recording, Path(folder))
        return prepare(file if kept is None else str(kept), profile, written, library=library)


def recorded_text(recording: Recording, folder: Path) -> Path | None:
    """Write the text of the recorded machine into a folder.

    Args:
        recording: the run.
        folder: an empty folder.

    Returns:
        The machine's own file; None where the recording has no text.
    """
    try:
        texts = json.loads(recording.run.get("sources", "{}"))
    except (ValueError, RecursionError):
        return None
    files: list[Path] = []
    for name, text in texts.items() if isinstance(texts, dict) else ():
        if Path(name).name == name and Path(name).suffix in MACHINES:
            files.append(folder / name)
            files[-1].write_text(str(text), encoding="utf-8")
    return files[0] if files else None


def recorded_library(recording: Recording, profile: Profile, named: str | None = None) -> RobotLibrary:
    """The library of a recorded run's machine; nobody is asked to trust anything.

    Args:
        recording: the run.
        profile: the robot's.
        named: the library as ``MODULE:NAME``; None for that of the machine's project, or of the present folder's where
            the machine's file is not here.

    Raises:
        UsageError: there is no such library, or its project is not trusted.
        FileError: the project's settings are wrong.
    """
    said = recording.run.get("machine", "")
    file = shipped_machines().get(said, Path(said))
    whole = partial(robot_library, profile.skills, profile.robot)
    return chosen_library(named, file if file.is_file() else None, whole, lambda _question: False)


def named_machine(recording: Recording) -> str:
    """The file of the machine that a recording names; a name without a folder is that of a shipped one.

    Raises:
        FileError: it names another kind of file, which is not opened.
    """
    named = recording.run["machine"]
    if named in shipped_machines():
        return str(shipped_machines()[named])
    if Path(named).suffix in MACHINES:
        return named
    raise FileError(
        f"the recording names {named[:200]!r} as its machine, which is not a machine's file", "name one yourself"
    )


@dataclass(frozen=True, slots=True)
class Difference:
    """The first tick in which a replay differs from its recording.

    Attributes:
        tick: its number.
        recorded: the differing values in the recording, by name; empty if it had ended.
        replayed: the same for the replay.
    """

    tick: int
    recorded: Mapping[str, Any]
    replayed: Mapping[str, Any]

    def lines(self) -> list[str]:
        """The difference for a person."""
        told = [f"differs from tick {self.tick} on"]
        for name in {**self.recorded, **self.replayed}:
            shown = name if name.isidentifier() else repr(name)
            told.append(f"  {shown[:40]:<8} recorded  {_shown(self.recorded.get(name, 'nothing'))}")
            told.append(f"  {'':<8} replayed  {_shown(self.replayed.get(name, 'nothing'))}")
        return told


def _shown(value: object) -> str:
    """A value from a file for a terminal: on one line, and cut."""
    text = str(value) if not isinstance(value, str) or value.isprintable() else repr(value)
    return text if len(text) <= LONGEST else f"{text[:LONGEST]} ..."


def replay(
    recording: Recording, mission: Mission, watchers: Sequence[TickWatcher] = ()
) -> tuple[Ending, Difference | None]:
    """Feed a machine the recorded sensor data, independent of its commands.

    Returns:
        How it ended, and the first difference from the recorded run; None also if no steps were recorded.

    Raises:
        MachineFault: the machine failed.
    """
    lines: list[dict[str, Any]] = []
    robot = ReplayRobot(recording)
    operator = recorded_operator(recording, mission.machine)
    watching = [lambda tick: lines.append(dict(tick.line)), *watchers]
    ending = drive(mission, robot, robot, watching, operator=operator)
    return ending, first_difference([line_of(tick.step) for tick in recording.ticks], lines) if recording.own else None


def recorded_operator(recording: Recording, machine: Machine) -> Recorded:
    """The operator of a recorded run: sends the recorded events that the machine declares."""
    return Recorded([known_events(machine.model, tick.step) for tick in recording.ticks])


def recorded_events(step: Mapping[str, Any]) -> list[str]:
    """The external events of a recorded tick; other entries are ignored."""
    events = step.get("events", ())
    return [one for one in events if isinstance(one, str)] if isinstance(events, list) else []


def known_events(model: Model, step: Mapping[str, Any]) -> list[str]:
    """The recorded events of a tick that a machine accepts, without those that a changed machine lacks."""
    found = []
    for one in recorded_events(step):
        try:
            found.append(event_text(model, one))
        except (TypeError, ValueError):
            continue
    return found


def first_difference(recorded: Iterable[Mapping[str, Any]], replayed: Iterable[Mapping[str, Any]]) -> Difference | None:
    """The first tick that two traces show differently; None if they are the same."""
    nothing: Mapping[str, Any] = {}
    for index, (one, other) in enumerate(zip_longest(recorded, replayed, fillvalue=nothing)):
        if one != other:
            names = [name for name in {**one, **other} if one.get(name) != other.get(name)]
            return Difference(
                index,
                {name: one[name] for name in names if name in one},
                {name: other[name] for name in names if name in other},
            )
    return None
