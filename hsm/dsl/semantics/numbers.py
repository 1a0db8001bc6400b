"""From a number as it is written, with or without a unit, to its value in SI."""

from __future__ import annotations

import math
import re

from hsm.dsl.reporting.report import Report
from hsm.dsl.semantics.values import OTHER_UNITS, listed, meant
from hsm.dsl.syntax.tokens import Token
from hsm.model.diagnostics import Place
from hsm.model.expressions import Literal
from hsm.model.types import INTEGER, LARGEST_INTEGER, NUMBER, UNITS, Type, si_value

_NUMBER = re.compile(r"([0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?) *(.*)")
_LONGEST_INTEGER = 19
_LONGEST_NUMBER = 300


def number(token: Token, place: Place, report: Report) -> Literal | None:
    """The value of a number; None, with a diagnostic, where its unit is unknown or it is too large.

    Args:
        token: the number with its unit.
        place: where it is.
        report: where diagnostics go.
    """
    written = _NUMBER.fullmatch(token)
    assert written is not None, "the lexer takes nothing else for a number"
    digits, unit_name = written.groups()
    if not unit_name and digits.isdecimal():
        return _whole(digits, place, report)
    if not unit_name:
        return _finite(float(digits), NUMBER, place, report)
    unit = UNITS.get(unit_name)
    if unit is None:
        hint = meant(unit_name, OTHER_UNITS) or report.guess(unit_name, UNITS).text
        hint = hint or listed("the units are", UNITS)
        report.add_once("E0207", place, f"there is no unit `{unit_name}`", hint)
        return None
    return _finite(si_value(digits, unit), unit.quantity, place, report)


def _whole(digits: str, place: Place, report: Report) -> Literal | None:
    if len(digits.lstrip("0")) <= _LONGEST_INTEGER and int(digits) <= LARGEST_INTEGER:
        return Literal(int(digits), INTEGER, place)
    hint = f"an `int` goes to {LARGEST_INTEGER}"
    if len(digits) < _LONGEST_NUMBER:
        hint += f"; where a plain number is wanted, write `{float(digits)}`"
    report.add("E0306", place, "this whole number is too large", hint)
    return None


def _finite(value: float, kind: Type, place: Place, report: Report) -> Literal | None:
    if math.isinf(value):
        report.add("E0306", place, "this number is too large")
        return None
    return Literal(value, kind, place)
