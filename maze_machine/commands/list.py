"""``maze-machine list``: what there is to name in a machine."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from maze_machine.arguments.options import JsonOption, LibraryOption

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hsm.model.registry import Library


class Subject(StrEnum):
    """What can be listed; one of them may be named for all, such as ``signal``."""

    MACHINES = "machines"
    MAZES = "mazes"
    SIGNALS = "signals"
    ACTIVITIES = "activities"
    ACTIONS = "actions"
    EVENTS = "events"
    CONSTANTS = "constants"
    TYPES = "types"
    UNITS = "units"
    CODES = "codes"

    @classmethod
    def _missing_(cls, value: object) -> Subject | None:
        plural = f"{value}s" if value != "activity" else "activities"
        return next((one for one in cls if one.value == plural), None)


def listing(
    subject: Annotated[Subject, typer.Argument(help="What to list.")],
    json: JsonOption = False,
    library: LibraryOption = None,
) -> None:
    """List the names that a machine may use, with types, units and documentation; or machines, mazes and codes.

    Example: `maze-machine list signals`

    Example: `maze-machine list activities --json`
    """
    from json import dumps

    rows = list(_rows(subject, library))
    if json:
        print(dumps(rows, indent=2, ensure_ascii=False))
        return
    columns = list(rows[0]) if rows else []
    widths = [max(len(row[column]) for row in rows) for column in columns]
    for row in rows:
        cells = (row[column].ljust(width) for column, width in zip(columns, widths, strict=True))
        print("  ".join(cells).rstrip())


def _rows(subject: Subject, library: str | None) -> Iterable[dict[str, str]]:
    from hsm.model.codes import CODES
    from hsm.model.types import UNITS
    from maze_machine.catalogue.library import chosen_library

    match subject:
        case Subject.MACHINES:
            return _machines()
        case Subject.MAZES:
            return _mazes()
        case Subject.UNITS:
            return (
                {"name": one.name, "type": str(one.quantity), "SI": f"{one.factor:.6g} {one.quantity.si_unit}"}
                for one in UNITS.values()
            )
        case Subject.CODES:
            return (
                {"name": one.name, "severity": one.severity.name.lower(), "about": one.title} for one in CODES.values()
            )
        case _:
            return _declared(subject, chosen_library(library))


def _declared(subject: Subject, library: Library) -> Iterable[dict[str, str]]:
    """What the registry declares."""
    from hsm.dsl.lsp.describe import first_line, holds_text, outcomes_text, signature, type_text
    from hsm.model.registry import Parameter
    from hsm.model.unparse import shown_text

    match subject:
        case Subject.SIGNALS:
            for signal in library.signals.values():
                call = signature(signal.name, signal.parameters, empty="")
                yield {"name": call, "type": type_text(signal.type), "about": first_line(signal.doc)}
        case Subject.ACTIVITIES:
            for activity in library.activities.values():
                row = {"name": signature(activity.name, activity.parameters), "outcomes": outcomes_text(activity)}
                yield {**row, "holds": holds_text(activity), "about": first_line(activity.doc)}
        case Subject.ACTIONS:
            for action in library.actions.values():
                yield {"name": signature(action.name, action.parameters), "about": first_line(action.doc)}
        case Subject.EVENTS:
            for event in library.events.values():
                fields = [Parameter(one.name, one.type) for one in event.fields]
                yield {"name": signature(event.name, fields, empty=""), "about": first_line(event.doc)}
        case Subject.CONSTANTS:
            for constant in library.constants.values():
                row = {"name": constant.name, "type": type_text(constant.type)}
                yield {**row, "value": shown_text(constant.value, constant.type), "about": first_line(constant.doc)}
        case _:
            yield from _types(library)


def _types(library: Library) -> Iterable[dict[str, str]]:
    from hsm.dsl.lsp.describe import first_line
    from hsm.model.types import QUANTITY_NAMES

    yield {"name": "bool", "values": "true, false", "about": ""}
    yield {"name": "int", "values": "whole numbers", "about": ""}
    for quantity, name in QUANTITY_NAMES.items():
        unit = "" if quantity.si_unit == "1" else f" in {quantity.si_unit}"
        yield {"name": name, "values": f"numbers{unit}", "about": ""}
    for name, enumeration in library.enumerations.items():
        values = ", ".join(member.value for member in enumeration)
        yield {"name": name, "values": values, "about": first_line(enumeration.__doc__ or "")}


def _mazes() -> Iterable[dict[str, str]]:
    from sim.shipped import shipped_mazes

    return ({"name": name, "file": path.name} for name, path in shipped_mazes().items())


def _machines() -> Iterable[dict[str, str]]:
    from hsm.dsl.lsp.describe import first_line
    from hsm.dsl.syntax.ast import MachineLine
    from hsm.dsl.syntax.parser import parse
    from hsm.dsl.syntax.sources import read_text
    from maze_machine.catalogue.machines import shipped_machines

    for name, path in shipped_machines().items():
        tree, _ = parse(read_text(path), str(path))
        head = next((item for item in tree.items if isinstance(item, MachineLine)), None)
        doc = tree.comment_above(head.name.line) if head is not None else ""
        yield {"name": name, "about": first_line(doc)}
