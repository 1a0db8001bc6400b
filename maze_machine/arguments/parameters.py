"""Values for a machine's parameters, written by a person as in the language: ``0.5 m/s``, ``90 deg``, ``true``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from enum import StrEnum
from math import isfinite
from typing import Any

from hsm.model.registry import Parameter
from hsm.model.types import LARGEST_INTEGER, UNITS, Boolean, Enumeration, Integer, Quantity, si_value
from maze_machine.errors import UsageError

_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*", re.ASCII)
_WHOLE = re.compile(r"\s*[-+]?\d{1,19}\s*", re.ASCII)


def parameter_values(
    parameters: Sequence[Parameter],
    written: Mapping[str, object] | Iterable[tuple[str, object]],
    enumerations: Mapping[str, type[StrEnum]],
) -> dict[str, Any]:
    """What ``machine.start`` takes, from what a person wrote on the command line or in a profile.

    Args:
        parameters: the machine's parameters.
        written: names and values; a text may carry a unit, a plain number is in SI units.
        enumerations: the enumerations that a parameter may be of, by name.

    Raises:
        UsageError: an unknown parameter, a value that is not of its type, or none where there is no default.
    """
    values = known_values(parameters, written, enumerations)
    missing = [parameter.name for parameter in parameters if parameter.required and parameter.name not in values]
    if missing:
        raise UsageError(
            f"the machine needs a value for its parameter `{missing[0]}`", f"give --param {missing[0]}=VALUE"
        )
    return values


def known_values(
    parameters: Sequence[Parameter],
    written: Mapping[str, object] | Iterable[tuple[str, object]],
    enumerations: Mapping[str, type[StrEnum]],
) -> dict[str, Any]:
    """The same, where parameters without a value may stay without one.

    Raises:
        UsageError: an unknown parameter, or a value that is not of its type.
    """
    declared = {parameter.name: parameter for parameter in parameters}
    values = {}
    for name, text in dict(written).items():
        if name not in declared:
            raise UsageError(f"the machine has no parameter `{name}`", _known(name, declared))
        values[name] = _value(declared[name], str(text), enumerations)
    return values


def split_setting(text: str) -> tuple[str, str]:
    """Name and value of ``name=value``.

    Raises:
        UsageError: there is no ``=``.
    """
    name, equals, value = text.partition("=")
    if not equals:
        raise UsageError(f"--param {text}: no value", "write --param name=value")
    return name.strip(), value.strip()


def _value(parameter: Parameter, text: str, enumerations: Mapping[str, type[StrEnum]]) -> Any:
    match parameter.type:
        case Boolean():
            if text.lower() in ("true", "false"):
                return text.lower() == "true"
            raise _mismatch(parameter, text, "write true or false")
        case Integer():
            if _WHOLE.fullmatch(text) is None or abs(int(text)) > LARGEST_INTEGER:
                raise _mismatch(parameter, text, f"write a whole number up to {LARGEST_INTEGER}")
            return int(text)
        case Enumeration(name, members):
            if text in members:
                return enumerations[name](text) if name in enumerations else text  # one of the machine's own
            raise _mismatch(parameter, text, f"one of {', '.join(members)}")
        case Quantity() as quantity:
            return _quantity(parameter, quantity, text)


def _quantity(parameter: Parameter, quantity: Quantity, text: str) -> float:
    units = [unit.name for unit in UNITS.values() if unit.quantity == quantity]
    way_out = f"write a number and one of {', '.join(units)}" if units else "write a plain number"
    written = _NUMBER.fullmatch(text)
    if written is None:
        raise _mismatch(parameter, text, way_out)
    number, unit = written.groups()
    if not isfinite(float(number)):
        raise _mismatch(parameter, text, "no number is that large")
    if not unit:
        return float(number)
    if unit not in UNITS or UNITS[unit].quantity != quantity:
        raise _mismatch(parameter, text, way_out)
    return si_value(number, UNITS[unit])


def _mismatch(parameter: Parameter, text: str, way_out: str) -> UsageError:
    return UsageError(f"`{text}` is no value for parameter `{parameter.name}`, which is a {parameter.type}", way_out)


def _known(name: str, declared: Mapping[str, Parameter]) -> str:
    if not declared:
        return "it has no parameters at all"
    close = get_close_matches(name, declared, n=1)
    return f"did you mean `{close[0]}`?" if close else f"it has {', '.join(declared)}"
