"""Recorded runs: what a recording keeps of a mission, and what a machine makes of the same sensors again."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

from hsm import Machine
from maze_machine.catalogue.machines import shipped_machines
from maze_machine.catalogue.profile import Profile
from maze_machine.drive.loop import Tick
from maze_machine.drive.mission import Ending, Mission, TickWatcher, drive, prepare
from maze_machine.drive.operation import Recorded
from maze_machine.drive.trace import trace_line
from maze_machine.errors import FileError
from transport.recording import Recorder, Recording, ReplayRobot

REASONS = "reasons"
"""Where a recorded step says of each transition that was looked at why it fired or did not."""


def described(mission: Mission, machine: str) -> dict[str, str]:
    """What a recording says of its run: all that a replay needs beside the sensors and the machine's file.

    Args:
        mission: the run.
        machine: the machine's file, or the name of a shipped one.
    """
    return {
        "machine": machine if machine in shipped_machines() else str(Path(machine).resolve()),
        "parameters": json.dumps(dict(mission.parameters)),
        "profile": mission.profile.model_dump_json(),
    }


def keeper(recorder: Recorder, mission: Mission) -> TickWatcher:
    """A watcher of ticks that records them, with what the machine did in each and, where something fired, why."""

    def keep(tick: Tick) -> None:
        recorder.record(tick.observation, tick.command, reasoned(mission.machine, tick))

    return keep


def reasoned(machine: Machine, tick: Tick) -> dict[str, Any]:
    """What a trace says of a tick and, where something fired, what became of each transition that was looked at."""
    reasons = [str(considered) for considered in tick.step.considered] if tick.step else []
    return trace_line(machine, tick) | ({REASONS: reasons} if reasons else {})


def recorded_profile(recording: Recording) -> Profile:
    """The profile of the robot of a recorded run.

    Raises:
        FileError: the recording does not say, or says it as another version of this program did.
    """
    try:
        return Profile.model_validate_json(recording.run["profile"])
    except (KeyError, ValueError) as error:
        raise FileError(f"the recording does not say which robot ran: {error}") from None


def recorded_mission(recording: Recording, machine: str | None = None) -> Mission:
    """The mission of a recorded run.

    Args:
        recording: the run.
        machine: another machine to put in its place, with its default parameters; None for the same one.

    Raises:
        FileError: the recording does not say what was run, or the machine is not there any more.
        MachineError: the machine has faults.
    """
    profile = recorded_profile(recording)
    if machine is not None:
        return prepare(machine, profile)
    try:
        parameters = json.loads(recording.run["parameters"])
        recorded = recording.run["machine"]
    except (KeyError, ValueError) as error:
        raise FileError(f"the recording does not say what was run: {error}") from None
    return prepare(recorded, profile, [(name, str(value)) for name, value in parameters.items()])


@dataclass(frozen=True, slots=True)
class Difference:
    """The first tick in which a replay and its recording part.

    Attributes:
        tick: its number.
        recorded: what the recording says of it, by name, where the replay says something else; empty if it had ended.
        replayed: the same for the replay.
    """

    tick: int
    recorded: Mapping[str, Any]
    replayed: Mapping[str, Any]

    def lines(self) -> list[str]:
        """The difference for a person."""
        told = [f"differs from tick {self.tick} on"]
        for name in {**self.recorded, **self.replayed}:
            told.append(f"  {name:<8} recorded  {self.recorded.get(name, 'nothing')}")
            told.append(f"  {'':<8} replayed  {self.replayed.get(name, 'nothing')}")
        return told


def replay(
    recording: Recording, mission: Mission, watchers: Sequence[TickWatcher] = ()
) -> tuple[Ending, Difference | None]:
    """Show a machine the recorded sensors, whatever it does about them.

    Returns:
        How it ended, and the first difference from the recorded run.

    Raises:
        MachineFault: the machine failed.
    """
    lines: list[dict[str, Any]] = []
    robot = ReplayRobot(recording)
    known = mission.machine.model.events
    operator = Recorded(
        [[one for one in recorded_events(tick.step) if known is None or one in known] for tick in recording.ticks]
    )
    watching = [lambda tick: lines.append(trace_line(mission.machine, tick)), *watchers]
    ending = drive(mission, robot, robot, watching, operator=operator)
    recorded = [{name: value for name, value in tick.step.items() if name != REASONS} for tick in recording.ticks]
    return ending, first_difference(recorded, lines)


def recorded_events(step: Mapping[str, Any]) -> list[str]:
    """The events that somebody outside sent for a recorded tick; what is no name is none."""
    events = step.get("events", ())
    return [one for one in events if isinstance(one, str)] if isinstance(events, list) else []


def first_difference(recorded: Iterable[Mapping[str, Any]], replayed: Iterable[Mapping[str, Any]]) -> Difference | None:
    """The first tick that two traces tell differently; None if they are the same."""
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
