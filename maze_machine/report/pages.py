"""A run on a page: what the page receives before, during and after it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import hsm
from hsm import MachineError, Model
from hsm.interchange.reports import model_json
from maze_machine.catalogue.library import RobotLibrary
from maze_machine.catalogue.profile import Profile
from maze_machine.drive.mission import Ending, Mission
from maze_machine.drive.replay import recorded_library, recorded_text
from maze_machine.drive.sights import sights
from maze_machine.drive.tick import Tick, shown_ranges
from maze_machine.errors import CommandError
from maze_machine.simulated.world import SimulatedWorld
from maze_machine.view.drawings import Drawings, cleaned, drawable
from maze_machine.view.page import Frame, head
from perception import Perception
from perception.facts import Facts
from transport.messages import Command, Observation, Pose
from transport.recording import Recording

LOOKED_AT = 5
"""Every how many ticks the results of perception are shown."""
LONGEST = 400_000
"""The longest file that is shown, characters."""


def scene_of(world: SimulatedWorld) -> dict[str, Any]:
    """The maze as the page draws it: segments in m."""
    maze = world.maze
    doors = [[*one, *other] for one, other in (door.leaf for door in maze.doors)]
    return {"walls": maze.barriers.tolist(), "exits": maze.exits.tolist(), "doors": np.asarray(doors).tolist()}


def sources_of(model: Model) -> dict[str, str]:
    """The text of a machine's files by their names, as far as they can be read."""
    found: dict[str, str] = {}
    for file in model.files:
        try:
            found[Path(file).name] = Path(file).read_text(encoding="utf-8")[:LONGEST]
        except (OSError, UnicodeDecodeError):
            continue
    return found


def said_of(mission: Mission, world: SimulatedWorld | None) -> dict[str, str]:
    """The entries of a recording for the page, each as JSON: the machine, its text, the maze."""
    model = mission.machine.model
    said = {"model": model_json(model, mission.parameters), "sources": sources_of(model)}
    if world is not None:
        said["scene"] = scene_of(world)
    return {name: json.dumps(value) for name, value in said.items()}


def run_head(mission: Mission, world: SimulatedWorld | None) -> dict[str, Any]:
    """The constant data of a run for the page."""
    machine = mission.machine
    return head(
        machine.model.name,
        mission.profile.robot,
        None if world is None else scene_of(world),
        model_json(machine.model, mission.parameters),
        sources_of(machine.model),
    )


def network_head(told: Mapping[str, Any], drawings: Drawings) -> dict[str, Any]:
    """The same for the network: the machine, and as ``page`` the further data for a remote page."""
    undrawn = drawable(drawings)
    drawn = {"undrawn": undrawn, "drawings": {} if undrawn else drawings.all()}
    page = {name: one for name, one in told.items() if name not in ("model", "operable", "trial")}
    return {**told["model"], "page": {**page, **drawn}}


def remote_head(answer: Mapping[str, Any]) -> dict[str, Any]:
    """The page's data about a remote machine that says what a page needs; only shapes are kept from its pictures."""
    told = answer["page"]
    drawn = {name: cleaned(one) for name, one in told["drawings"].items()}
    model = {name: one for name, one in answer.items() if name != "page"}
    return {**told, "drawings": drawn, "model": model, "trial": None}


class ShownRun:
    """Shows each tick of a run on a page, and finally how it ended; a watcher of ticks.

    Args:
        publish: receives a function that makes a frame, called in the page's thread.
        end: receives the verdict.
    """

    def __init__(self, publish: Callable[[Callable[[], Frame]], None], end: Callable[[Frame], None]) -> None:
        self._publish, self._end = publish, end
        self._seen: dict[str, Any] | None = None

    def __call__(self, tick: Tick) -> None:
        """Take in a tick."""
        self._publish(lambda: self._frame(tick))

    def end(self, ending: Ending) -> None:
        """Show how it ended."""
        self._end(ending.as_json())

    def _frame(self, tick: Tick) -> Frame:
        if tick.index % LOOKED_AT == 0 and tick.facts is not None:
            self._seen = _seen(tick.facts, tick.truth or tick.pose)
        return _with_sights({**tick.json, "ranges": shown_ranges(tick.observation.scan)}, self._seen)


def recorded_head(recording: Recording, profile: Profile, library: str | None = None) -> dict[str, Any]:
    """The constant data of a recorded run for the page.

    Args:
        recording: the run.
        profile: the robot's.
        library: what the machine may name, as ``MODULE:NAME``; None for that of its project.

    Raises:
        CommandError: there is no library of that name.
    """
    said = recording.run
    title = f"{Path(said.get('machine', recording.robot)).stem}, {len(recording.ticks)} ticks"
    kept = {name: _kept(said.get(name)) for name in ("scene", "model", "sources")}
    try:
        names = recorded_library(recording, profile, library)
    except CommandError as error:
        if library is not None:
            raise
        drawn = {"undrawn": f"{error}: no picture of the machine", "drawings": {}}
    else:
        drawn = _recorded_drawings(recording, kept["model"], names)
    return {**head(title, profile.robot, kept["scene"], kept["model"], kept["sources"]), **drawn}


def _recorded_drawings(recording: Recording, model: Any, library: RobotLibrary) -> dict[str, Any]:
    """The pictures of a recorded machine, made from its recorded text; or why there are none."""
    with TemporaryDirectory() as folder:
        file = recorded_text(recording, Path(folder))
        try:
            machine = hsm.load(file or Path(folder), library)
        except (MachineError, OSError, ValueError):
            return {"undrawn": "the recorded machine cannot be read here: no picture of it", "drawings": {}}
    if not isinstance(model, dict) or model.get("states") != model_json(machine.model, {})["states"]:
        return {"undrawn": "the recorded text is not the machine that ran: no picture of it", "drawings": {}}
    drawings = Drawings(machine)
    undrawn = drawable(drawings)
    return {"undrawn": undrawn, "drawings": {} if undrawn else drawings.all()}


def recorded_verdict(recording: Recording) -> dict[str, Any] | None:
    """How a recorded run ended; None where the recording does not say."""
    said = recording.ending
    if not said:
        return None
    report = _kept(said.get("report")) or {}
    violations, broken = (tuple(map(str, _kept(said.get(what)) or [])) for what in ("violations", "broken"))
    outcome, reason = said.get("outcome") or None, said.get("reason", "")
    return Ending(outcome, reason, 0, 0.0, 0.0, 0.0, report, violations=violations, broken=broken).as_json()


def _kept(text: str | None) -> Any:
    """A JSON value that a recording keeps; None where there is none."""
    try:
        return None if text is None else json.loads(text)
    except (ValueError, RecursionError):
        return None


def recorded_frames(recording: Recording, perception: Perception | None) -> Iterator[Frame]:
    """The frames of a recorded run.

    Args:
        recording: the run.
        perception: repeats the perception of the run; None to leave it out.
    """
    seen = None
    for index, tick in enumerate(recording.ticks):
        frame = {**_sensed(index, tick.observation, tick.command), **tick.step}
        if perception is not None:
            facts = perception.facts(tick.observation)
            if "place" in tick.step:  # the machine has begun a map
                facts.world.begin_map(facts.sweep)
            if index % LOOKED_AT == 0:
                truth = frame.get("truth")
                seen = _seen(facts, Pose(*truth) if truth else tick.observation.odometry.pose)
        yield _with_sights({**frame, "ranges": shown_ranges(tick.observation.scan)}, seen)


def _sensed(index: int, observation: Observation, command: Command) -> dict[str, Any]:
    """The fields of a tick from any recorder."""
    pose, twist = observation.odometry.pose, command.twist
    return {
        "tick": index,
        "stamp": observation.stamp,
        "pose": [pose.x, pose.y, pose.heading],
        "twist": [twist.forward, twist.left, twist.turn],
        "ring": command.ring,
    }


def _seen(facts: Facts, shown: Pose) -> dict[str, Any]:
    return {**sights(facts), "at": [shown.x, shown.y, shown.heading]}


def _with_sights(frame: Mapping[str, Any], seen: Mapping[str, Any] | None) -> Frame:
    return frame if seen is None else {**frame, "sights": seen}
