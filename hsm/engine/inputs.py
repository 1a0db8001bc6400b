"""Checks of the inputs of a run from Python: parameters and the time of a step."""

from __future__ import annotations

from collections.abc import Mapping
from enum import StrEnum
from math import inf, isfinite
from numbers import Integral, Real
from typing import Any

from hsm.engine.evaluation import Evaluation
from hsm.engine.limits import within_limits
from hsm.model.chart import Model
from hsm.model.expressions import Expression
from hsm.model.registry import Parameter
from hsm.model.types import NUMBER, Boolean, Enumeration, Integer, Type
from hsm.model.unparse import value_text

_WIDEST = 40


def shown(given: object) -> str:
    """A value from Python in a message: the beginning of its ``repr``, and its type."""
    try:
        text = f"{given!r:.{_WIDEST}}"
    except ValueError:  # a whole number with thousands of digits
        text = "a number that is too large"
    return f"{text} ({type(given).__name__})"


def parameter_values(model: Model, given: Mapping[str, Any]) -> list[Any]:
    """The values of all parameters of a machine, in order: those given, and the defaults of the others.

    Args:
        model: the machine.
        given: values by name, in SI units.

    Raises:
        ValueError: a parameter is unknown, one without a default is missing, or a value, given or made of others, is
            out of bounds, infinite or NaN.
        TypeError: a value is of the wrong type.
    """
    if not isinstance(given, Mapping):
        raise TypeError(f"parameters are given as a mapping from names to values, not as {shown(given)}")
    declared = {parameter.name: parameter for parameter in model.parameters}
    for name in given:
        if name not in declared:
            known = ", ".join(declared) or "none"
            raise ValueError(f"machine {model.name} has no parameter `{name}`; its parameters: {known}")
    missing = [name for name, parameter in declared.items() if parameter.required and name not in given]
    if missing:
        raise ValueError(f"machine {model.name} needs a value for its parameter `{missing[0]}`")
    checked = {name: parameter_value(model, declared[name], value) for name, value in given.items()}
    return list(settled(model, checked).values())


def settled(model: Model, given: Mapping[str, Any]) -> dict[str, Any]:
    """The values of all parameters of a machine by name: those given, what is made of others, and defaults.

    Args:
        model: the machine.
        given: values by name, as the engine has them.

    Raises:
        ValueError: what a parameter is made of divides by zero, or is not a value of it.
    """
    values: dict[str, Any] = {}
    for parameter in model.parameters:
        if parameter.name in given:
            values[parameter.name] = given[parameter.name]
        elif parameter.name in model.derived:
            values[parameter.name] = follow(model.derived[parameter.name], parameter, values)
        else:
            values[parameter.name] = parameter.default
    return values


def follow(formula: Expression, parameter: Parameter, values: Mapping[str, Any]) -> Any:
    """The value of a parameter that is made of others.

    Args:
        formula: what it is made of.
        parameter: which one it is.
        values: those of the parameters before it, by name.

    Raises:
        ValueError: this is a division by zero, or is not a value of the parameter.
    """
    slots = {name: slot for slot, name in enumerate(values)}
    constants = Evaluation(tuple(values.values()), slots, (), {}, {}, _no_signal, _no_signal)
    try:
        value = typed(constants.value(formula), parameter.type)
    except ZeroDivisionError:
        raise ValueError(f"parameter `{parameter.name}` divides by zero") from None
    if not within_limits(value, parameter.type):
        raise ValueError(f"parameter `{parameter.name}` cannot hold {value!r:.{_WIDEST}}")
    return value


def _no_signal(*_: object) -> Any:
    raise AssertionError("constants and parameters contain no signal")


def parameter_value(model: Model, parameter: Parameter, given: Any) -> Any:
    """A value for a parameter of a machine, as the engine has it.

    Raises:
        ValueError: it is out of bounds, infinite or NaN.
        TypeError: it is of the wrong type.
    """
    default = parameter.default
    value = typed(given, parameter.type, type(default) if isinstance(default, StrEnum) else None)
    if value is None:
        wanted = f"parameter `{parameter.name}` of machine {model.name} is {wanted_type(parameter.type)}"
        raise TypeError(f"{wanted}, not {shown(given)}")
    if not within_limits(value, parameter.type):
        raise ValueError(f"machine {model.name} cannot hold {shown(given)} in its parameter `{parameter.name}`")
    bounds = model.adjustable_named(parameter.name)
    if bounds is not None and isinstance(value, int | float) and not bounds.least <= value <= bounds.most:
        allowed = f"{value_text(bounds.least, parameter.type)} to {value_text(bounds.most, parameter.type)}"
        raise ValueError(
            f"parameter `{parameter.name}` of machine {model.name} takes {allowed}, not "
            f"{value_text(value, parameter.type)}"
        )
    return value


def typed(given: Any, kind: Type, enumeration: type[StrEnum] | None = None) -> Any:
    """A value from Python as the engine has it; None where it is of another type.

    Args:
        given: the value.
        kind: the type that is wanted.
        enumeration: where the members of an enumeration come from.
    """
    match kind:
        case Boolean():
            return given if isinstance(given, bool) else None
        case Integer():
            return int(given) if isinstance(given, Integral) and not isinstance(given, bool) else None
        case Enumeration(_, members):
            if not isinstance(given, str) or str(given) not in members:
                return None
            return given if enumeration is None else enumeration(given)
        case _:
            return _real(given) if isinstance(given, Real) and not isinstance(given, bool) else None


def _real(given: Real) -> float:
    """A number as the engine has it; infinite, which no value may be, where it is too large."""
    try:
        return float(given)
    except OverflowError:
        return inf


def wanted_type(kind: Type) -> str:
    """A type in a message about a value from Python."""
    match kind:
        case Boolean():
            return "true or false"
        case Integer():
            return "a whole number"
        case Enumeration(name, members):
            return f"a {name} ({', '.join(members)})"
        case _ if kind == NUMBER:
            return "a number"
        case _:
            return f"a number, its {kind} in {kind.si_unit}"


def checked_time(time: float, last: float) -> float:
    """The time of a step, as the engine has it.

    Args:
        time: of the step, in seconds.
        last: of the step before.

    Raises:
        ValueError: it is before that of the step before, infinite or NaN.
        TypeError: it is not a number at all.
    """
    if not isinstance(time, Real) or isinstance(time, bool):
        raise TypeError(f"the time of a step is a number of seconds, not {shown(time)}")
    seconds = _real(time)
    if not isfinite(seconds):
        raise ValueError(f"the time of a step is a finite number of seconds, not {shown(time)}")
    if seconds < last:
        raise ValueError(f"time runs backwards: {seconds} s after {last} s")
    return seconds
