"""Sensor values that the language has no numbers for: NaN and the infinities."""

from __future__ import annotations

from hsm.dsl.semantics.typing import Scope
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.ast import first_token, last_token, place_of
from hsm.dsl.syntax.tokens import Token
from hsm.model.expressions import Literal
from hsm.model.types import UNITS, Quantity, Type


def unusual_value(node: ast.Expression | ast.Named, kind: Type, scope: Scope) -> Literal | None:
    """The value of ``nan``, ``inf m`` or ``-inf m`` where a quantity is wanted; None of everything else.

    The unit may be left out.

    Args:
        node: what is written.
        kind: the type that is wanted.
        scope: where something else may have that name, and where another unit is reported.
    """
    negated = isinstance(node, ast.UnarySyntax) and node.operator == "-"
    token = node.operand if isinstance(node, ast.UnarySyntax) and negated else node
    if not isinstance(token, Token) or token.type != "NOT_FINITE" or not isinstance(kind, Quantity):
        return None
    if token.value in scope.variables:
        return None
    word, _, unit = token.partition(" ")
    known = UNITS.get(unit.strip())
    if unit and (known is None or known.quantity != kind):
        return None
    value = float(word)
    return Literal(-value if negated else value, kind, place_of(scope.report.file, first_token(node), last_token(node)))
