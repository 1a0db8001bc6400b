"""The bounds of a parameter that an operator may change while the machine runs."""

from __future__ import annotations

from hsm.dsl.semantics.context import Context
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.tokens import Token
from hsm.model.chart import Adjustable
from hsm.model.expressions import Literal
from hsm.model.registry import Parameter
from hsm.model.types import Integer, Quantity


def adjustable(context: Context, name: Token, declared: Parameter | None, line: ast.AdjustableSyntax) -> Adjustable:
    """The bounds after ``adjustable``; mistakes are reported.

    Args:
        context: what all stages share.
        name: the parameter's name.
        declared: the parameter; None if it is invalid.
        line: what is written.
    """
    free = Adjustable(str(name))
    if declared is None or not line.bounds:
        context.scope.used.update(word for one in line.bounds for word in ast.names_in(one))
        return free
    if not isinstance(declared.type, Integer | Quantity):
        message = f"`{name}` is a {declared.type}: only a number has bounds"
        context.add("E0213", line.keyword, message, "write `adjustable` alone")
        return free
    found = [context.scope.value(one, declared.type) for one in line.bounds]
    for one in found:
        if one is not None and not isinstance(one, Literal):
            context.report.add("E0303", one.place, f"a bound of `{name}` is not a constant")
    values = [one.value for one in found if isinstance(one, Literal)]
    if len(values) < len(found):
        return free
    least, most = values
    if least > most:
        context.add("E0301", line.keyword, f"the bounds of `{name}` exclude every value", "put the smaller one first")
    elif not declared.required and not least <= declared.default <= most:
        message = f"the default of `{name}` is not within its bounds"
        context.add("E0301", line.keyword, message, "change the default or a bound")
    return Adjustable(str(name), least, most)
