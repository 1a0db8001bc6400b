"""Settings of the embedded simulator from the command line: single keys, faults, speed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from pydantic import ValidationError

from maze_machine.errors import UsageError
from sim.faults import parse_fault
from sim.settings import SimulatorSettings
from transport.clock import MonotonicClock, Pace
from transport.toml import TomlError, toml_value
from transport.wording import in_words


def simulator_settings(overrides: Iterable[str] = (), faults: Iterable[str] = ()) -> SimulatorSettings:
    """The simulator's settings.

    Args:
        overrides: what differs from the defaults, each ``section.key=value`` with a TOML value.
        faults: each as `sim.faults.parse_fault` reads it.

    Raises:
        UsageError: there is no such setting or fault.
    """
    try:
        ordered = tuple(parse_fault(fault) for fault in faults)
    except ValueError as error:
        raise UsageError(f"--fault {error}") from None
    settings = SimulatorSettings(faults=ordered)
    for override in overrides:
        settings = _overridden(settings, override)
    return settings


def _overridden(settings: SimulatorSettings, override: str) -> SimulatorSettings:
    key, equals, text = override.partition("=")
    if not equals:
        raise UsageError(f"--simulate {override}: no value", "write section.key=value")
    table: dict[str, Any] = settings.model_dump()
    section = table
    *sections, last = key.strip().split(".")
    for name in sections:
        if not isinstance(section.get(name), dict):
            raise UsageError(f"--simulate {override}: unknown section `{name}`", _known(section))
        section = section[name]
    if last not in section or last == "faults":
        raise UsageError(f"--simulate {override}: unknown key `{last}`", _known(section))
    try:
        section[last] = toml_value(text.strip())
    except TomlError as error:
        raise UsageError(f"--simulate {key}: the value cannot be read: {error}") from None
    try:
        return SimulatorSettings.model_validate(table)
    except ValidationError as error:
        raise UsageError(f"--simulate {override}: {in_words(error.errors()[0])}") from None


def _known(table: dict[str, Any]) -> str:
    return "known: " + ", ".join(name for name in table if name != "faults")


def pace(period: float, speed: float | None) -> Pace | None:
    """The clock of a simulation that runs at a multiple of real time; None to run as fast as it can.

    Args:
        period: simulated time from one command to the next, s.
        speed: the multiple.
    """
    return None if speed is None else Pace(period / speed, MonotonicClock())
