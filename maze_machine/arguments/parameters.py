"""Values for a machine's parameters, written by a person as in the language: ``0.5 m/s``, ``90 deg``, ``true``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from enum import StrEnum
from typing import Any

from hsm.engine.inputs import parameter_value
from hsm.model.chart import Model
from hsm.model.registry import Parameter
from hsm.model.types import Enumeration
from hsm.model.written import value_of
from maze_machine.errors import UsageError


def parameter_values(
    model: Model,
    written: Mapping[str, object] | Iterable[tuple[str, object]],
    enumerations: Mapping[str, type[StrEnum]],
) -> dict[str, Any]:
    """What ``machine.start`` takes, from what a person wrote on the command line or in a profile.

    Args:
        model: the machine.
        written: names and values; a text may carry a unit, a plain number is in SI units.
        enumerations: the enumerations that a parameter may be of, by name.

    Raises:
        UsageError: an unknown parameter, a value that is not of its type or beyond its bounds, or none where there is
            no default.
    """
    values = known_values(model, written, enumerations)
    missing = [parameter.name for parameter in model.parameters if parameter.required and parameter.name not in values]
    if missing:
        raise UsageError(
            f"the machine needs a value for its parameter `{missing[0]}`", f"give --param {missing[0]}=VALUE"
        )
    return values


def known_values(
    model: Model,
    written: Mapping[str, object] | Iterable[tuple[str, object]],
    enumerations: Mapping[str, type[StrEnum]],
) -> dict[str, Any]:
    """The same, where parameters without a value may stay without one.

    Raises:
        UsageError: an unknown parameter, or a value that is not of its type or beyond its bounds.
    """
    declared = {parameter.name: parameter for parameter in model.parameters}
    values = {}
    for name, text in dict(written).items():
        if name not in declared:
            raise UsageError(f"the machine has no parameter `{name}`", _known(name, declared))
        values[name] = _within(model, declared[name], _value(declared[name], str(text), enumerations))
    return values


def split_setting(text: str, option: str = "--param") -> tuple[str, str]:
    """Name and value of ``name=value``.

    Args:
        text: what a person wrote.
        option: after which option.

    Raises:
        UsageError: the name or the value is missing.
    """
    name, _, value = (one.strip() for one in text.partition("="))
    if not name or not value:
        raise UsageError(f"{option} {text}: no {'value' if name else 'name'}", f"write {option} name=value")
    return name, value


def _value(parameter: Parameter, text: str, enumerations: Mapping[str, type[StrEnum]]) -> Any:
    kind = parameter.type
    enumeration = enumerations.get(kind.name) if isinstance(kind, Enumeration) else None  # or one of the machine's own
    try:
        return value_of(text, kind, enumeration)
    except ValueError as way_out:
        raise _mismatch(parameter, text, str(way_out)) from None


def _within(model: Model, parameter: Parameter, value: Any) -> Any:
    try:
        return parameter_value(model, parameter, value)
    except ValueError as error:
        raise UsageError(str(error)) from None


def _mismatch(parameter: Parameter, text: str, way_out: str) -> UsageError:
    return UsageError(f"`{text}` is not a value for parameter `{parameter.name}`, which is a {parameter.type}", way_out)


def _known(name: str, declared: Mapping[str, Parameter]) -> str:
    if not declared:
        return "it has no parameters at all"
    close = get_close_matches(name, declared, n=1)
    return f"did you mean `{close[0]}`?" if close else f"it has {', '.join(declared)}"
