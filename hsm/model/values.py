"""Dataclasses that are cheap to define: comparison, hash and text are written when they are first used.

The standard decorator writes and compiles some seven functions for each class, which is a quarter of what a short
command takes to start, and most classes need two of them. This one leaves three of the functions to the standard
decorator, and makes the others, with its help, when somebody compares, hashes or prints a value.
"""

from __future__ import annotations

from dataclasses import field, fields, make_dataclass
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


_ALONE: dict[str, dict[str, Any]] = {
    "__repr__": {"repr": True, "eq": False},
    "__eq__": {"repr": False, "eq": True},
    "__hash__": {"repr": False, "eq": False, "unsafe_hash": True},
}
"""The options with which the standard decorator writes one function."""


def _at_first_use(owner: type, name: str) -> Any:
    """A method that replaces itself by the one that the standard decorator writes."""

    def method(self: object, *others: object) -> object:
        parts = [(one.name, object, field(repr=one.repr, compare=one.compare, hash=one.hash)) for one in fields(owner)]
        twin = make_dataclass(owner.__name__, parts, init=False, namespace={"__doc__": owner.__doc__}, **_ALONE[name])
        written = vars(twin)[name]
        setattr(owner, name, written)
        return written(self, *others)

    method.__name__, method.__qualname__ = name, f"{owner.__qualname__}.{name}"
    return method
