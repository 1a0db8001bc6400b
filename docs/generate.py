"""Write what repeats the code: the references of the command line and of robot profiles.

Run as ``python docs/generate.py``.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterator
from dataclasses import is_dataclass
from enum import Enum
from functools import cached_property
from pathlib import Path
from typing import Any, get_args

import typer.main

import hsm
import perception.signals
import skills.catalogue
from hsm.model.registry import ActionDeclaration, ActivityDeclaration, Parameter, SignalDeclaration
from maze_machine.catalogue.profile import Profile, profile_text
from maze_machine.cli import app
from maze_machine.drive.tick_json import tick_schema
from perception import Facts
from skills.settings import SkillSettings

ROOT = Path(__file__).parents[1]


def command_line() -> str:
    """The reference page of the command line."""
    command = typer.main.get_command(app)
    head = ["# The command line", "", f"`maze-machine COMMAND`: {command.help}", "", command.epilog or "", ""]
    return "\n".join([*head, *_subcommands(command, "maze-machine")]).rstrip() + "\n"


def _subcommands(group: Any, prefix: str) -> Iterator[str]:
    for name, command in group.commands.items():
        full = f"{prefix} {name}"
        yield from (f"## {full}", "", *(command.help or "").strip().splitlines(), "")
        if hasattr(command, "commands"):
            yield from _subcommands(command, full)
        else:
            yield from _parameters(command)


def _parameters(command: Any) -> Iterator[str]:
    shown = [one for one in command.params if not getattr(one, "hidden", False) and one.name != "help"]
    if shown:
        yield from ("| argument or option | default | what it says |", "|---|---|---|")
        yield from (
            f"| {_spelling(one)} | {_default(one)} | {(one.help or '').replace('|', chr(92) + '|')} |" for one in shown
        )
        yield ""


def _spelling(parameter: Any) -> str:
    if parameter.param_type_name == "argument":
        return f"`{parameter.name.upper()}{'...' if parameter.nargs == -1 else ''}`"
    return ", ".join(f"`{spelling}`" for spelling in (*parameter.opts, *parameter.secondary_opts))


def _default(parameter: Any) -> str:
    if parameter.required:
        return "required"
    default = parameter.default
    if default in (None, False, True, ()) or callable(default) or isinstance(default, list):
        return ""
    return f"`{default}`"


def default_profile() -> str:
    """The profile that spells out every default."""
    return "# Every setting of a robot profile with its default; any may be left out.\n" + profile_text(Profile())


def motion_skills() -> str:
    """The reference page of the skills: what a machine may do, and what it may remember."""
    library = skills.catalogue.library(SkillSettings())
    return "\n".join(
        [
            "# Skills",
            "",
            "What a machine may `do`, one at a time for each thing that it holds, and the actions and signals of the",
            "strategies that need a memory. Gains and distances are in the section `[skills]` of a robot profile.",
            "Every velocity that an activity asks for passes through the limits of the base and the guard against",
            "walls.",
            "",
            "## Activities",
            "",
            *(line for one in library.activities.values() for line in _activity(one)),
            "## Signals and actions",
            "",
            *(line for one in (*library.signals.values(), *library.actions.values()) for line in _named(one)),
        ]
    )


def _activity(declared: ActivityDeclaration) -> Iterator[str]:
    yield from _named(declared)
    yield f"Holds: {', '.join(declared.holds)}."
    yield ""


def _named(declared: ActionDeclaration | ActivityDeclaration | SignalDeclaration) -> Iterator[str]:
    kind = f": {declared.type}" if isinstance(declared, SignalDeclaration) else ""
    yield from (f"### `{declared.name}({', '.join(map(_written, declared.parameters))}){kind}`", "")
    yield from (declared.doc, "")


def _written(parameter: Parameter) -> str:
    default = "" if parameter.required else f" = {parameter.default}"
    return f"{parameter.name}: {parameter.type}{default}"


def perception_reference() -> str:
    """The reference page of perception: what a machine can ask, and what skills see in Python."""
    library = perception.signals.LIBRARY
    return "\n".join(
        [
            "# Perception",
            "",
            "What is seen, in the robot's frame unless said otherwise: x forward, y to the left, angles",
            "counter-clockwise from x; metres and radians. Thresholds and sizes are in the section `[perception]` of a",
            "robot profile. How it is found, how accurate it is and what it cannot see:",
            "[explanation](../explanation/perception.md).",
            "",
            "A signal that is not known has the neutral value that its description names; where that could be mistaken",
            "for a finding, a companion signal ending in `.known` is false.",
            "",
            "## Signals and actions",
            "",
            *(line for one in (*library.signals.values(), *library.actions.values()) for line in _named(one)),
            "## Facts",
            "",
            "Skills, and signals of one's own, get the same from the `Facts` of a tick; each is worked out when it is",
            "asked for, and once.",
            "",
            "| fact | what it is |",
            "|---|---|",
            *(f"| `{name}` | {text} |" for name, text in _facts()),
            "",
        ]
    )


def _facts() -> Iterator[tuple[str, str]]:
    for name, member in vars(Facts).items():
        if isinstance(member, property | cached_property) and not name.startswith("_"):
            yield name, " ".join((inspect.getdoc(member) or "").split())


PUBLIC = {
    "Load and run": ("load", "loads", "build", "Machine", "Supervisor"),
    "A step as a pure function": ("transition", "Inputs"),
    "Events that carry data": ("Occurrence",),
    "What a step did": ("Macrostep", "Microstep", "Considered", "Verdict"),
    "What a machine may name": ("Library", "Activity", "Stoppable", "Outcome", "RegistryError"),
    "Types and units": ("Length", "Duration", "Angle", "Speed", "TurnRate", "Unit", "UNITS"),
    "What goes wrong": ("MachineError", "Diagnostic", "Place", "Severity", "MachineFault", "Spin", "SnapshotError"),
    "The declaration, other engines and formats": ("Model", "to_transitions", "scxml"),
}
"""The public names of ``hsm``, in the order of its page."""


def python_interface() -> str:
    """The reference page of what Python programs import from ``hsm``."""
    head = [
        "# The Python interface",
        "",
        "All of it is imported from `hsm`. Libraries, machines and runs are generic over the facts of a step and the",
        "effects of activities: a `hsm.Library[Facts, Command]` gives a `hsm.Machine[Facts, Command]`, whose runs take",
        "`Facts` and give `Command`s. [The engine](engine.md) shows them at work; a program that passes a strict type",
        "checker is `tests/hsm/typed/lamp.py`. Values are in SI units, times in seconds, angles in radians.",
        "",
    ]
    return (
        "\n".join([*head, *(line for title, names in PUBLIC.items() for line in _public(title, names))]).rstrip() + "\n"
    )


def _public(title: str, names: tuple[str, ...]) -> Iterator[str]:
    yield from (f"## {title}", "")
    for name in names:
        one = getattr(hsm, name)
        if inspect.isfunction(one):
            yield from (f"### `hsm.{name}{_signature(one)}`", "", *_documented(one), "")
        elif inspect.isclass(one):
            yield from _class(name, one)
        elif inspect.ismodule(one):
            yield from (f"### `hsm.{name}`", "", *(line for line in _documented(one)), "")
            for inner in one.__all__:
                function = getattr(one, inner)
                yield from (f"#### `hsm.{name}.{inner}{_signature(function)}`", "", *_documented(function), "")
        elif name == "UNITS":
            yield from (
                f"### `hsm.{name}`",
                "",
                f"The units of the language, by name: {', '.join(f'`{unit}`' for unit in one)}.",
                "",
            )
        else:
            unit = get_args(one)[1]
            text = f"A number with the unit `{unit.name}`: in a declaration, an argument or a value of that quantity."
            yield from (f"### `hsm.{name}`", "", text, "")


def _class(name: str, one: type) -> Iterator[str]:
    shown = "" if issubclass(one, Exception | Enum) or not is_dataclass(one) else _signature(one)
    yield from (f"### `hsm.{name}{shown}`", "", *_documented(one), "")
    if issubclass(one, Enum):
        yield from (f"- `{member.name}`: {member.value}" for member in one if isinstance(member.value, str))
        yield ""
    for inner, member in vars(one).items():
        if inner.startswith("_") or not (getattr(member, "__doc__", None) or "").strip():
            continue
        if isinstance(member, property):
            yield from (f"#### `{name}.{inner}`", "", *_documented(member), "")
        elif inspect.isfunction(member) and _ours(member):
            yield from (f"#### `{name}.{inner}{_signature(member)}`", "", *_documented(member), "")


def _ours(function: Any) -> bool:
    return bool(function.__module__.startswith("hsm."))


def _signature(one: Any) -> str:
    signature = inspect.signature(one)
    listed = [_parameter(parameter) for name, parameter in signature.parameters.items() if name != "self"]
    if any(parameter.kind is parameter.POSITIONAL_ONLY for parameter in signature.parameters.values()):
        listed.append("/")
    gives = signature.return_annotation if inspect.isfunction(one) else signature.empty
    return f"({', '.join(listed)})" + ("" if gives in (signature.empty, "None") else f" -> {gives}")


def _parameter(parameter: inspect.Parameter) -> str:
    default = "" if parameter.default is parameter.empty else f" = {parameter.default!r}"
    kind = "" if parameter.annotation is parameter.empty else f": {parameter.annotation}"
    return f"{parameter.name}{kind}{default}".replace("<factory>", "...")


def _documented(one: Any) -> Iterator[str]:
    """A docstring with its sections as lists."""
    section = False
    for line in (inspect.getdoc(one) or "").splitlines():
        words = line.strip()
        if words in ("Args:", "Attributes:", "Returns:", "Raises:"):
            section = True
            yield from (f"{words.replace('Args', 'Arguments')}", "")
        elif not section or not words:
            section = section and bool(words)
            yield line.replace("``", "`")
        elif line.startswith("     "):
            yield f"  {words}".replace("``", "`")
        else:
            name, colon, text = words.partition(": ")
            item = f"`{name}`: {text}" if colon and " " not in name else words
            yield f"- {item}".replace("``", "`")


def tick_json() -> str:
    """The JSON Schema of a tick."""
    return json.dumps(tick_schema(), indent=2) + "\n"


GENERATED = {
    ROOT / "docs" / "reference" / "tick.schema.json": tick_json,
    ROOT / "docs" / "reference" / "python.md": python_interface,
    ROOT / "docs" / "reference" / "command-line.md": command_line,
    ROOT / "docs" / "reference" / "profile.toml": default_profile,
    ROOT / "docs" / "reference" / "skills.md": motion_skills,
    ROOT / "docs" / "reference" / "perception.md": perception_reference,
}


if __name__ == "__main__":
    for path, text in GENERATED.items():
        path.write_text(text(), encoding="utf-8")
