"""Write the pages that repeat the code: the references of the command line, profiles, skills, perception, the grammar.

Run as ``python scripts/generate.py``.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import typer.main

import perception.signals
import skills.catalogue
from hsm.model.registry import ActionDeclaration, ActivityDeclaration, Parameter, SignalDeclaration
from maze_machine.catalogue.profile import Profile, profile_text
from maze_machine.cli import app
from maze_machine.drive.tick_json import tick_schema
from maze_machine.remote.described import machine_schema
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
        yield from ("| argument or option | default | meaning |", "|---|---|---|")
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
    """The reference page of the skills: activities, and the signals and actions with a memory."""
    library = skills.catalogue.library(SkillSettings())
    return "\n".join(
        [
            "# Skills",
            "",
            "This page lists the activities of the maze robots, which a state runs with `do`, and the signals and",
            "actions with a memory. Two active activities cannot use the same resource. Gains and distances are in",
            "the section `[skills]` of a robot profile. Every velocity that an activity requests is limited by the",
            "base, and checked by the guard against walls.",
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
    yield f"Resources: {', '.join(declared.holds)}."
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
            "This page lists the signals of the maze robots. Values are in the robot's frame unless the text says",
            "otherwise: x forward, y to the left, angles counter-clockwise from x; metres and radians. Thresholds",
            "and sizes are in the section `[perception]` of a robot profile. [The",
            "explanation](../explanation/perception.md) describes the methods, their accuracy and their limits.",
            "",
            "An unknown signal has the neutral value that its description names; if that could be mistaken for a",
            "measurement, a companion signal whose name ends in `.known` is false.",
            "",
            "## Signals and actions",
            "",
            *(line for one in (*library.signals.values(), *library.actions.values()) for line in _named(one)),
            "## Facts",
            "",
            "Skills, and signals of your own, read these values from the `Facts` of a tick. Each is computed at its",
            "first use, and only once.",
            "",
            "| fact | meaning |",
            "|---|---|",
            *(f"| `{name}` | {text} |" for name, text in _facts()),
            "",
        ]
    )


def _facts() -> Iterator[tuple[str, str]]:
    for name, member in vars(Facts).items():
        if isinstance(member, property | cached_property) and not name.startswith("_"):
            yield name, " ".join((inspect.getdoc(member) or "").split())


def grammar() -> str:
    """The reference page of the grammar."""
    text = (ROOT / "hsm" / "dsl" / "syntax" / "grammar.lark").read_text(encoding="utf-8")
    return f"# The grammar\n\nThe grammar in lark's notation: `hsm/dsl/syntax/grammar.lark`.\n\n```text\n{text}```\n"


FENCES = {".maze-machine": "maze-machine", ".maze-test": "maze-test", ".py": "python", ".scxml": "xml", ".toml": "toml"}


def examples() -> str:
    """The page of the examples, with all files of each."""
    head = [
        "# Examples",
        "",
        "The folder `examples/` contains these programs, from the smallest machine to two robots. A test runs every",
        "command in them; run it in the example's folder. A line `>` is part of what the command prints.",
        "",
    ]
    folders = sorted(path for path in (ROOT / "examples").iterdir() if path.is_dir() and path.name[:2].isdigit())
    return "\n".join([*head, *(line for folder in folders for line in _example(folder))]).rstrip() + "\n"


def _example(folder: Path) -> Iterator[str]:
    yield from (f"## {folder.name[:2]} {folder.name[3:].replace('_', ' ').capitalize()}", "")
    for path in sorted(folder.iterdir(), key=lambda path: (path.suffix == ".maze-test", path.name)):
        if path.is_file():
            yield from (f"`{path.relative_to(ROOT)}`", "", f"```{FENCES.get(path.suffix, 'sh')}")
            yield from (*path.read_text(encoding="utf-8").rstrip().splitlines(), "```", "")


def tick_json() -> str:
    """The JSON Schema of a tick."""
    return json.dumps(tick_schema(), indent=2) + "\n"


def machine_json() -> str:
    """The JSON Schema of a running machine's description of itself."""
    return json.dumps(machine_schema(), indent=2) + "\n"


GENERATED = {
    ROOT / "docs" / "examples.md": examples,
    ROOT / "docs" / "reference" / "grammar.md": grammar,
    ROOT / "docs" / "reference" / "machine.schema.json": machine_json,
    ROOT / "docs" / "reference" / "tick.schema.json": tick_json,
    ROOT / "docs" / "reference" / "command-line.md": command_line,
    ROOT / "docs" / "reference" / "profile.toml": default_profile,
    ROOT / "docs" / "reference" / "skills.md": motion_skills,
    ROOT / "docs" / "reference" / "perception.md": perception_reference,
}


if __name__ == "__main__":
    for path, text in GENERATED.items():
        path.write_text(text(), encoding="utf-8")
