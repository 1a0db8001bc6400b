"""The types of the protocol, each completed when it is first used.

`lsprotocol` declares more than 500 classes with attrs, which writes the functions of each when it is declared. That is
half of what a language server takes to answer its first request, and a session uses a fifth of the classes. Here
attrs completes a class when somebody makes a value of it or asks for its fields. If a later version of lsprotocol
declares its classes in another way, attrs completes them at once, as usual.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import suppress
from threading import RLock
from typing import Any

import attrs

_MODULE = "lsprotocol.types"
_FIELDS = "__attrs_attrs__"
_completing = RLock()


def defer_types() -> None:
    """Import the protocol's types in this way; nothing happens where they are imported already."""
    if _MODULE in sys.modules:
        return
    define = attrs.define

    def deferring(declared: type | None = None, **options: Any) -> Any:
        if declared is None or options or declared.__bases__ != (object,) or declared.__module__ != _MODULE:
            return define(declared, **options)
        return _deferred(declared, define)

    attrs.define = deferring  # type: ignore[assignment]
    try:
        import lsprotocol.types  # noqa: F401, PLC0415
    finally:
        attrs.define = define
    # Otherwise it resolves the names in the annotations of all classes at once.
    with suppress(ImportError):
        from lsprotocol import _hooks  # noqa: PLC0415

        if hasattr(_hooks, "_resolved_forward_references"):
            _hooks._resolved_forward_references = True


def _deferred(declared: type, define: Callable[..., Any]) -> type:
    """A class whose functions and fields are completed at first use."""

    def complete() -> None:
        with _completing:
            if vars(declared).get("__init__") is not made:
                return  # another thread was faster
            del declared.__init__, declared.__attrs_attrs__  # type: ignore[attr-defined, misc]
            define(declared, slots=False)  # with slots it would be another class
            attrs.resolve_types(declared, sys.modules[_MODULE].ALL_TYPES_MAP, {})

    def made(self: object, *values: object, **named: object) -> None:
        complete()
        declared.__init__(self, *values, **named)  # type: ignore[misc]

    declared.__init__ = made  # type: ignore[misc]
    declared.__attrs_attrs__ = _FieldsAtFirstUse(complete)  # type: ignore[attr-defined]
    return declared


class _FieldsAtFirstUse:
    """The attribute that attrs keeps the fields of a class in."""

    def __init__(self, complete: Callable[[], None]) -> None:
        self._complete = complete

    def __get__(self, value: object, owner: type) -> Any:
        self._complete()
        return getattr(owner, _FIELDS)
