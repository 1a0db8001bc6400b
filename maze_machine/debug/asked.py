"""The arguments of an editor's launch request."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from maze_machine.errors import UsageError


@dataclass(frozen=True, slots=True)
class Asked:
    """The arguments of `launch` and `attach`.

    Attributes:
        program: a machine's file or name; may be left out for a recording.
        parameters: the machine's parameters, as a person writes them.
        library: what the machine may name, as ``MODULE:NAME``; None for that of its project.
        robot: the robot's profile.
        maze: drive it in the embedded simulator, in this maze; None to try it without a robot.
        seed: of the simulator.
        recording: feed it the sensor data of this recording.
        connect: where a machine runs that is open to viewers.
        identity: a certificate for that, as FOLDER/NAME.
        stop: pause at the beginning.
    """

    program: str | None = None
    parameters: Mapping[str, str] | None = None
    library: str | None = None
    robot: str | None = None
    maze: str | None = None
    seed: int = 0
    recording: str | None = None
    connect: str | None = None
    identity: str | None = None
    stop: bool = True


_KINDS: dict[str, tuple[str, type]] = {
    "program": ("program", str),
    "library": ("library", str),
    "robot": ("robot", str),
    "maze": ("maze", str),
    "seed": ("seed", int),
    "recording": ("recording", str),
    "connect": ("connect", str),
    "identity": ("identity", str),
    "stopOnEntry": ("stop", bool),
}


def read_arguments(given: Mapping[str, Any], library: str | None = None) -> Asked:
    """What a request's arguments ask for.

    Args:
        given: the arguments; what an editor adds for itself is skipped.
        library: the library that the adapter was started with, for requests that name none.

    Raises:
        UsageError: one of them has the wrong type, or two exclude each other.
    """
    found: dict[str, Any] = {}
    for name, (field, kind) in _KINDS.items():
        value = given.get(name)
        if value is None:
            continue
        if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
            raise UsageError(f"`{name}` is {'a whole number' if kind is int else kind.__name__}, not {value!r:.100}")
        found[field] = value
    parameters = given.get("parameters") or {}
    if not isinstance(parameters, dict) or not all(isinstance(one, str | int | float) for one in parameters.values()):
        raise UsageError("`parameters` must be an object of names and values", 'such as {"cruise": "0.3 m/s"}')
    found["parameters"] = {name: _written(value) for name, value in parameters.items()}
    found.setdefault("library", library)
    asked = Asked(**found)
    ways = [name for name in ("maze", "recording", "connect") if getattr(asked, name) is not None]
    if len(ways) > 1:
        raise UsageError(f"`{ways[0]}` and `{ways[1]}` exclude each other", "give one of them")
    if asked.program is None and asked.recording is None:
        raise UsageError("there is nothing to debug", "`program` is the file or the name of a machine")
    return asked


def _written(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
