"""Dataclasses that are cheap to define: comparison, hash and text are written when they are first used.

The standard decorator writes and compiles some seven functions for each class, which is a quarter of what a short
command takes to start, and most classes need two of them. This one leaves three of the functions to the standard
decorator, and makes the others, with its help, when somebody compares, hashes or prints a value.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass  # noqa: PLC0414 - type checkers see the standard one
else:
    from dataclasses import dataclass as _dataclass

    def dataclass(cls=None, /, **options):
        """``dataclasses.dataclass``: the same options, the same classes."""

        def declared(cls: type) -> type:
            return _declared(cls, options)

        return declared if cls is None else declared(cls)

    def _declared(cls: type, options: dict[str, Any]) -> type:
        if options.get("order") or options.get("unsafe_hash"):
            return _dataclass(cls, **options)
        own, compared = vars(cls), options.get("eq", True)
        hashed = own.get("__hash__") is not None or ("__hash__" in own and "__eq__" not in own)
        later = ["__repr__"] if options.get("repr", True) and "__repr__" not in own else []
        if compared and "__eq__" not in own:
            later.append("__eq__")
        if compared and options.get("frozen") and not hashed:
            later.append("__hash__")
        made = _dataclass(cls, **{**options, "repr": False, "eq": False})
        if compared and not options.get("frozen") and not hashed:
            made.__hash__ = None
        for name in later:
            setattr(made, name, _at_first_use(made, name))
        return made


def _repr(owner: type) -> str:
    shown = ", ".join(f"{one.name}={{self.{one.name}!r}}" for one in fields(owner) if one.repr)
    return f"def __repr__(self):\n    return f'{{self.__class__.__qualname__}}({shown})'"


def _eq(owner: type) -> str:
    mine, others = (_parts(name, [one.name for one in fields(owner) if one.compare]) for name in ("self", "other"))
    same = "other.__class__ is self.__class__"
    return f"def __eq__(self, other):\n    return {mine} == {others} if {same} else NotImplemented"


def _hash(owner: type) -> str:
    counted = [one.name for one in fields(owner) if (one.compare if one.hash is None else one.hash)]
    return f"def __hash__(self):\n    return hash({_parts('self', counted)})"


def _parts(name: str, parts: Sequence[str]) -> str:
    return f"({''.join(f'{name}.{part}, ' for part in parts)})"


_TEXTS: dict[str, Callable[[type], str]] = {"__repr__": _repr, "__eq__": _eq, "__hash__": _hash}
"""What the standard decorator would write, for each function."""


def _at_first_use(owner: type, name: str) -> Callable[..., Any]:
    """A method that replaces itself by the one that the standard decorator would have written."""

    def method(self: object, *others: object) -> object:
        made: dict[str, Any] = {}
        exec(_TEXTS[name](owner), made)
        written = made[name] if name != "__repr__" else recursive_repr()(made[name])
        setattr(owner, name, written)
        return written(self, *others)

    method.__name__, method.__qualname__ = name, f"{owner.__qualname__}.{name}"
    return method
