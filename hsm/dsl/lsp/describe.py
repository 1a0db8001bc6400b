"""One line for each declaration of the registry: for lists, completion and hover texts."""

from __future__ import annotations

from collections.abc import Sequence

from hsm.model.registry import ActivityDeclaration, Parameter
from hsm.model.types import NUMBER, QUANTITY_NAMES, Quantity, Type
from hsm.model.unparse import shown_text


def signature(name: str, parameters: Sequence[Parameter], *, empty: str = "()") -> str:
    """A call with the types and defaults of its arguments; ``empty`` follows a name that takes none."""
    listed = [
        f"{one.name} : {one.type}" if one.required else f"{one.name} : {one.type} = {shown_text(one.default, one.type)}"
        for one in parameters
    ]
    return f"{name}({', '.join(listed)})" if listed else f"{name}{empty}"


def type_text(kind: Type) -> str:
    """A type, with its SI unit."""
    if isinstance(kind, Quantity) and kind != NUMBER and kind in QUANTITY_NAMES:
        return f"{kind} in {kind.si_unit}"
    return str(kind)


def outcomes_text(activity: ActivityDeclaration) -> str:
    """How an activity can end."""
    return ", ".join(activity.outcomes) or "does not end"


def holds_text(activity: ActivityDeclaration) -> str:
    """What an activity holds."""
    return f"uses {', '.join(activity.holds)}" if activity.holds else "uses no resource"


def first_line(doc: str) -> str:
    """The first line of a piece of documentation."""
    return doc.strip().partition("\n")[0]
