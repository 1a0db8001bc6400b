"""Dataclasses that are cheap to define: their functions are written when they are first used.

The standard decorator writes and compiles some seven functions for each class, which is a third of what a short command
takes to start, and most classes need two of them or none. This one leaves the fields and the slots to the standard
decorator. It writes how a value is made, compared, hashed and printed when somebody does that, and all frozen classes
share two functions that refuse assignments.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import MISSING, Field, FrozenInstanceError, fields, is_dataclass
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass  # noqa: PLC0414 - type checkers see the standard one
    from inspect import Signature
else:
    from dataclasses import dataclass as _dataclass

    def dataclass(cls=None, /, **options):
        """``dataclasses.dataclass``: the same options, the same classes."""

        def declared(cls: type) -> type:
            return _declared(cls, options)

        return declared if cls is None else declared(cls)

    def _declared(cls: type, options: dict[str, Any]) -> type:
        if _is_unusual(cls, options):
            return _dataclass(cls, **options)
        own, compared, frozen = vars(cls), options.get("eq", True), options.get("frozen", False)
        hashed = own.get("__hash__") is not None or ("__hash__" in own and "__eq__" not in own)
        later = [name for name, option in _OPTIONS.items() if options.get(option, True) and name not in own]
        if compared and frozen and not hashed:
            later.append("__hash__")
        made = _dataclass(cls, **{**options, "init": False, "repr": False, "eq": False, "frozen": False})
        if compared and not frozen and not hashed:
            made.__hash__ = None
        for name in later:
            setattr(made, name, _at_first_use(made, name))
        if "__init__" in later:
            made.__signature__ = _SignatureOfInit()
        if frozen:
            _freeze(made)
        if frozen and options.get("slots"):
            _let_pickle(made)
        for option in (*_OPTIONS.values(), "frozen"):
            setattr(made.__dataclass_params__, option, options.get(option, option != "frozen"))
        return made

    def _is_unusual(cls: type, options: dict[str, Any]) -> bool:
        """Whether a class is left to the standard decorator as a whole."""
        rare = options.get("order") or options.get("unsafe_hash") or any(map(is_dataclass, cls.__mro__[1:]))
        parameters = any("InitVar" in str(one) for one in getattr(cls, "__annotations__", {}).values())
        return rare or parameters or not {"__setattr__", "__delattr__"}.isdisjoint(vars(cls))

    def _freeze(owner: type) -> None:
        """Refuse assignments to the fields of a class; a subclass may have attributes of its own."""
        names = frozenset(one.name for one in fields(owner))

        def refused_assignment(self: object, name: str, value: object) -> None:
            if type(self) is owner or name in names:
                raise FrozenInstanceError(f"cannot assign to field {name!r}")
            super(owner, self).__setattr__(name, value)

        def refused_deletion(self: object, name: str) -> None:
            if type(self) is owner or name in names:
                raise FrozenInstanceError(f"cannot delete field {name!r}")
            super(owner, self).__delattr__(name)

        owner.__setattr__, owner.__delattr__ = refused_assignment, refused_deletion

    def _let_pickle(owner: type) -> None:
        """Have pickle set the fields in a way that a frozen class with slots does not refuse."""
        for name, function in (("__getstate__", _state), ("__setstate__", _set_state)):
            if name not in vars(owner):
                setattr(owner, name, function)


_OPTIONS = {"__init__": "init", "__repr__": "repr", "__eq__": "eq"}
"""The functions that an option of the decorator asks for."""


class _Factory:
    """The default of a parameter whose value a factory makes."""

    def __repr__(self) -> str:
        return "<factory>"


_FACTORY = _Factory()


def _state(self: Any) -> list[Any]:
    return [getattr(self, one.name) for one in fields(self)]


def _set_state(self: Any, state: Sequence[Any]) -> None:
    for one, value in zip(fields(self), state, strict=True):
        object.__setattr__(self, one.name, value)


def _init(owner: type, used: dict[str, Any]) -> str:
    frozen, slots = _is_frozen(owner), "__slots__" in vars(owner)
    positional, keyword, body = ["self"], list[str](), list[str]()
    for one in fields(owner):
        name, default = one.name, _default(one, used)
        if one.init:
            (keyword if one.kw_only else positional).append(name + (f"=_{name}" if default else ""))
        elif default is None or (default == f"_{name}" and not slots):
            continue
        value = name if one.init else default
        if one.init and default not in (None, f"_{name}"):
            value = f"{default} if {name} is _{name} else {name}"
        body.append(f"_set(self, {name!r}, {value})" if frozen else f"self.{name} = {value}")
    if hasattr(owner, "__post_init__"):
        body.append("self.__post_init__()")
    used["_set"] = object.__setattr__
    parameters = ", ".join([*positional, *(["*"] if keyword else ()), *keyword])
    return f"def __init__({parameters}):\n    " + "\n    ".join(body or ["pass"])


def _default(one: Field[Any], used: dict[str, Any]) -> str | None:
    """The text of a field's default, whose value goes to what the function may use; None if there is none."""
    if one.default_factory is not MISSING:
        used[f"_{one.name}"], used[f"_make_{one.name}"] = _FACTORY, one.default_factory
        return f"_make_{one.name}()"
    if one.default is MISSING:
        return None
    used[f"_{one.name}"] = one.default
    return f"_{one.name}"


def _is_frozen(owner: type) -> bool:
    return bool(owner.__dataclass_params__.frozen)  # type: ignore[attr-defined]


def _repr(owner: type, _used: dict[str, Any]) -> str:
    shown = ", ".join(f"{one.name}={{self.{one.name}!r}}" for one in fields(owner) if one.repr)
    return f"def __repr__(self):\n    return f'{{self.__class__.__qualname__}}({shown})'"


def _eq(owner: type, _used: dict[str, Any]) -> str:
    mine, others = (_parts(name, [one.name for one in fields(owner) if one.compare]) for name in ("self", "other"))
    same = "other.__class__ is self.__class__"
    return f"def __eq__(self, other):\n    return {mine} == {others} if {same} else NotImplemented"


def _hash(owner: type, _used: dict[str, Any]) -> str:
    counted = [one.name for one in fields(owner) if (one.compare if one.hash is None else one.hash)]
    return f"def __hash__(self):\n    return hash({_parts('self', counted)})"


def _parts(name: str, parts: Sequence[str]) -> str:
    return f"({''.join(f'{name}.{part}, ' for part in parts)})"


_TEXTS: dict[str, Callable[[type, dict[str, Any]], str]] = {
    "__init__": _init,
    "__repr__": _repr,
    "__eq__": _eq,
    "__hash__": _hash,
}
"""What the standard decorator would write for each function; what the text uses goes to the second argument."""


def _written(owner: type, name: str) -> Callable[..., Any]:
    """A function as the standard decorator would have written it."""
    made: dict[str, Any] = {}
    exec(_TEXTS[name](owner, made), made)
    function: Callable[..., Any] = made[name]
    function.__qualname__, function.__module__ = f"{owner.__qualname__}.{name}", owner.__module__
    if name == "__init__":
        function.__annotations__ = {one.name: one.type for one in fields(owner) if one.init} | {"return": None}
    return function if name != "__repr__" else recursive_repr()(function)


def _at_first_use(owner: type, name: str) -> Callable[..., Any]:
    """A method that replaces itself by the one that the standard decorator would have written."""

    def method(self: object, *others: Any, **named: Any) -> Any:
        written = _written(owner, name)
        setattr(owner, name, written)
        return written(self, *others, **named)

    method.__name__, method.__qualname__ = name, f"{owner.__qualname__}.{name}"
    return method


class _SignatureOfInit:
    """The attribute by which `inspect.signature` finds the parameters of a class whose `__init__` is not written."""

    def __get__(self, value: object, owner: type) -> Signature:
        from inspect import signature  # noqa: PLC0415 - already loaded by the standard decorator, but not by type

        declarer = next(one for one in owner.__mro__ if vars(one).get("__signature__") is self)
        if "__init__" in vars(owner) and owner is not declarer:
            raise AttributeError("__signature__")  # it has an own one
        own = signature(_written(declarer, "__init__"))
        return own.replace(parameters=list(own.parameters.values())[1:])
