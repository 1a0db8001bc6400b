"""The names of the shipped library without its code, so that checking a machine imports no perception and no skills.

``names.json`` holds what ``robot_library`` declares: names, types, defaults, documentation, and the Python object of
each. ``python -m maze_machine.catalogue`` writes it again; a test holds it to the library. The objects are imported on
first use.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from hsm.model.registry import (
    ActionDeclaration,
    ActivityDeclaration,
    ConstantDeclaration,
    EventDeclaration,
    EventField,
    Library,
    Parameter,
    SignalDeclaration,
)
from hsm.model.types import BOOLEAN, INTEGER, QUANTITY_NAMES, Enumeration, Type

FILE = "names.json"
_SIMPLE: dict[str, Type] = {"bool": BOOLEAN, "int": INTEGER}
_SIMPLE.update((name, quantity) for quantity, name in QUANTITY_NAMES.items())


@dataclass(frozen=True, slots=True)
class ImportedName:
    """A function or class in Python that is imported when it is needed.

    Attributes:
        module: where it lies.
        name: its name there.
    """

    module: str
    name: str

    @property
    def __wrapped__(self) -> Any:
        """The object itself, which an editor shows."""
        found: Any = import_module(self.module)
        for part in self.name.split("."):
            found = getattr(found, part)
        return found

    def __call__(self, *arguments: object) -> Any:
        """Call it."""
        return self.__wrapped__(*arguments)


@cache
def shipped_names(folder: Path) -> Library[Any, Any]:
    """The shipped library as it is declared: for checks, editors and tests, not for driving.

    Args:
        folder: where the shipped machines lie.
    """
    text = Path(__file__).with_name(FILE).read_text(encoding="utf-8")
    return library_of(json.loads(text), folder)


def manifest_of(library: Library[Any, Any]) -> dict[str, Any]:
    """The declarations of a library, as JSON values."""
    return {
        "name": library.name,
        "enumerations": {
            name: {"doc": kind.__doc__ or "", "members": {member.name: member.value for member in kind}}
            for name, kind in sorted(library.enumerations.items())
        },
        "signals": {
            one.name: {"type": str(one.type), **_callable(one.function, one.parameters, one.doc)}
            for one in library.signals.values()
        },
        "activities": {
            one.name: {
                "outcomes": list(one.outcomes),
                "holds": list(one.holds),
                **_callable(one.factory, one.parameters, one.doc),
            }
            for one in library.activities.values()
        },
        "actions": {one.name: _callable(one.function, one.parameters, one.doc) for one in library.actions.values()},
        "events": {one.name: _event(one) for one in library.events.values()},
        "constants": {
            one.name: {"type": str(one.type), "value": one.value, "doc": one.doc} for one in library.constants.values()
        },
    }


def library_of(manifest: Mapping[str, Any], folder: Path) -> Library[Any, Any]:
    """The library that a manifest describes.

    Args:
        manifest: as ``manifest_of`` makes it.
        folder: where machines lie that any machine may import by name.
    """
    library: Library[Any, Any] = Library(manifest["name"], folders=[folder])
    for name, entry in manifest["enumerations"].items():
        kind: type[StrEnum] = StrEnum(str(name), entry["members"])  # type: ignore[misc]  # the names are data
        kind.__doc__ = entry["doc"]
        library.enumerations[name] = kind
    kinds = library.enumerations
    for name, entry in manifest["signals"].items():
        parameters = _parameters(entry["parameters"], kinds)
        library.signals[name] = SignalDeclaration(
            name, _type(entry["type"], kinds), _source(entry), parameters, entry["doc"]
        )
    for name, entry in manifest["activities"].items():
        library.activities[name] = ActivityDeclaration(
            name,
            _source(entry),
            tuple(entry["outcomes"]),
            tuple(entry["holds"]),
            _parameters(entry["parameters"], kinds),
            entry["doc"],
        )
    for name, entry in manifest["actions"].items():
        parameters = _parameters(entry["parameters"], kinds)
        library.actions[name] = ActionDeclaration(name, _source(entry), parameters, entry["doc"])
    for name, entry in manifest["events"].items():
        doc, data = (entry, {}) if isinstance(entry, str) else (entry["doc"], entry["data"])
        types = {part: _type(kind, kinds) for part, kind in data.items()}
        fields = tuple(EventField(part, kind, kinds.get(str(kind))) for part, kind in types.items())
        library.events[name] = EventDeclaration(name, doc, fields)
    for name, entry in manifest["constants"].items():
        kind_of_value = _type(entry["type"], kinds)
        library.constants[name] = ConstantDeclaration(name, kind_of_value, entry["value"], entry["doc"])
    return library


def text_of(manifest: Mapping[str, Any]) -> str:
    """The text of a manifest: one declaration per line."""
    sections = []
    for section, entries in manifest.items():
        if not isinstance(entries, dict):
            sections.append(f"{json.dumps(section)}: {json.dumps(entries)}")
            continue
        lines = [f"  {json.dumps(name)}: {json.dumps(entry)}" for name, entry in entries.items()]
        sections.append(f"{json.dumps(section)}: {{\n" + ",\n".join(lines) + "\n}")
    return "{\n" + ",\n".join(sections) + "\n}\n"


def _event(declared: EventDeclaration) -> str | dict[str, Any]:
    """The entry of an event; for one without data only its documentation."""
    data = {one.name: str(one.type) for one in declared.fields}
    return {"doc": declared.doc, "data": data} if data else declared.doc


def _callable(function: Any, parameters: Sequence[Parameter], doc: str) -> dict[str, Any]:
    # An activity with a robot's gains is made from the class that ticks.
    classes = function.__mro__ if isinstance(function, type) else ()
    source = next((one for one in classes if "tick" in vars(one)), function)
    listed = [
        {"name": one.name, "type": str(one.type), **({} if one.required else {"default": one.default})}
        for one in parameters
    ]
    return {"source": f"{source.__module__}:{source.__qualname__}", "parameters": listed, "doc": doc}


def _source(entry: Mapping[str, Any]) -> ImportedName:
    module, _, name = entry["source"].partition(":")
    return ImportedName(module, name)


def _parameters(entries: Sequence[Mapping[str, Any]], kinds: Mapping[str, type[StrEnum]]) -> tuple[Parameter, ...]:
    made: list[Parameter] = []
    for entry in entries:
        kind = _type(entry["type"], kinds)
        if "default" not in entry:
            made.append(Parameter(entry["name"], kind))
            continue
        default = entry["default"]
        made.append(
            Parameter(entry["name"], kind, kinds[kind.name](default) if isinstance(kind, Enumeration) else default)
        )
    return tuple(made)


def _type(name: str, kinds: Mapping[str, type[StrEnum]]) -> Type:
    simple = _SIMPLE.get(name)
    return Enumeration(name, tuple(member.value for member in kinds[name])) if simple is None else simple
