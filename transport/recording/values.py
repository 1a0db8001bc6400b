"""The contents of a recording."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from transport.messages import Command, Observation, Pose, ScanGeometry


class RecordingError(Exception):
    """A file that is not a recording, or that cannot be written."""


@dataclass(frozen=True, slots=True)
class RecordedTick:
    """One tick of a run.

    Attributes:
        observation: what the robot sensed.
        command: what it was commanded.
        step: what the supervisor did, of JSON values; empty where there was none.
    """

    observation: Observation
    command: Command
    step: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Topics:
    """Which topics of a recording are what; None for one that is to be found, or that is not there.

    Attributes:
        scan: the laser's scans.
        odometry: the odometry.
        command: the velocity commands.
    """

    scan: str | None = None
    odometry: str | None = None
    command: str | None = None


@dataclass(frozen=True, slots=True)
class Recording:
    """A recorded run.

    Attributes:
        robot: the robot's name.
        run: what was written about the run: machine, seed and the like; empty where nothing was.
        ticks: the ticks in order.
        complete: whether the file was closed properly; one that a crash cut off ends with its last whole chunk.
        own: whether this program wrote it, so that its ticks are those of the run, with their steps.
        topics: what was read as what.
        laser: the beams of its first scan.
        mount: where the laser sits on the robot by the recorded static transforms; None where they do not say.
        skipped: how many messages could not be decoded.
        heard: all topics with their types.
        ending: how the run ended; empty where it does not say.
    """

    robot: str
    run: Mapping[str, str]
    ticks: Sequence[RecordedTick]
    complete: bool
    own: bool = True
    topics: Topics = Topics()
    laser: ScanGeometry | None = None
    mount: Pose | None = None
    skipped: int = 0
    heard: Mapping[str, str] = field(default_factory=dict)
    ending: Mapping[str, str] = field(default_factory=dict)
