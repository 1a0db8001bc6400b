"""Guards, decomposed into conditions.

A guard is a tree of ``and``, ``or`` and ``not`` over conditions, which have no such operator at their top. Which of its
conditions were evaluated, and to what, is one number, the *path*: a ternary numeral with one digit a condition (0: not
evaluated, 1: false, 2: true). The generated code marks paths; coverage and explanations read them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

from hsm.model.chart import Held, Transition, When
from hsm.model.expressions import Binary, Expression, Literal, Unary
from hsm.model.types import BOOLEAN
from hsm.model.values import dataclass

FALSE, TRUE = 1, 2


@dataclass(frozen=True, slots=True)
class Condition:
    """A leaf of the tree: the condition with this number."""

    number: int


@dataclass(frozen=True, slots=True)
class Constant:
    """A leaf that was written as ``true`` or ``false``."""

    value: bool


@dataclass(frozen=True, slots=True)
class Negation:
    """``not``."""

    operand: Tree


@dataclass(frozen=True, slots=True)
class Connective:
    """``and`` (decided as soon as a part is false) or ``or`` (decided as soon as a part is true)."""

    parts: tuple[Tree, ...]
    conjunction: bool


Tree = Condition | Constant | Negation | Connective


@dataclass(frozen=True)
class Decision:
    """The guard of one transition.

    Attributes:
        tree: how the conditions are combined.
        conditions: the conditions, from left to right.
    """

    tree: Tree
    conditions: tuple[Expression, ...]

    @cached_property
    def count(self) -> int:
        """How many paths there are."""
        true, false = _count(self.tree)
        return true + false

    @cached_property
    def paths(self) -> tuple[int, ...]:
        """All paths, sorted; call it only if there are few."""
        true, false = _walk(self.tree, (0,))
        return tuple(sorted((*true, *false)))

    def follow(self, evaluate: Callable[[Expression], bool]) -> tuple[bool, int]:
        """The outcome and the path; conditions are evaluated in order and only if needed."""
        path = 0

        def ask(number: int) -> bool:
            nonlocal path
            held = bool(evaluate(self.conditions[number]))
            path += 3**number * (TRUE if held else FALSE)
            return held

        return _decide(self.tree, ask), path

    def values(self, path: int) -> tuple[bool | None, ...]:
        """What each condition was on a path; None where it was not evaluated."""
        digits = []
        for _ in self.conditions:
            path, digit = divmod(path, 3)
            digits.append(None if digit == 0 else digit == TRUE)
        return tuple(digits)

    def outcome(self, path: int) -> bool:
        """What was decided on a path."""
        values = self.values(path)
        return _decide(self.tree, lambda number: bool(values[number]))


def _decide(tree: Tree, ask: Callable[[int], bool]) -> bool:
    match tree:
        case Condition(number):
            return ask(number)
        case Constant(held):
            return held
        case Negation(operand):
            return not _decide(operand, ask)
        case Connective(parts, conjunction):
            decided = (_decide(part, ask) for part in parts)
            return all(decided) if conjunction else any(decided)


def decision_of(transition: Transition) -> Decision:
    """The conjunction of a transition's condition and guard, which decides besides its event or time-out."""
    needed = [transition.trigger.condition] if isinstance(transition.trigger, When | Held) else []
    if transition.guard is not None:
        needed.append(transition.guard)
    conditions: list[Expression] = []
    parts = tuple(_tree(expression, conditions) for expression in needed)
    match parts:
        case ():
            return Decision(Constant(value=True), ())
        case (tree,):
            return Decision(tree, tuple(conditions))
        case _:
            return Decision(Connective(parts, conjunction=True), tuple(conditions))


def _tree(expression: Expression, conditions: list[Expression]) -> Tree:
    match expression:
        case Literal(value):
            return Constant(bool(value))
        case Unary("not", operand):
            return Negation(_tree(operand, conditions))
        case Binary("and" | "or" as operator, _, _):
            return Connective(
                tuple(_tree(part, conditions) for part in _chain(expression, operator)), conjunction=operator == "and"
            )
        case _:
            conditions.append(expression)
            return Condition(len(conditions) - 1)


def _chain(expression: Expression, operator: str) -> list[Expression]:
    """The operands of a chain of one left-associative operator, without recursion."""
    operands = []
    while isinstance(expression, Binary) and expression.operator == operator and expression.type == BOOLEAN:
        operands.append(expression.right)
        expression = expression.left
    return [expression, *reversed(operands)]


def _count(tree: Tree) -> tuple[int, int]:
    """How many paths lead to true and how many to false."""
    match tree:
        case Condition():
            return 1, 1
        case Constant(held):
            return (1, 0) if held else (0, 1)
        case Negation(operand):
            true, false = _count(operand)
            return false, true
        case Connective(parts, conjunction):
            going, decided = 1, 0
            for part in parts:
                true, false = _count(part)
                further, leaving = (true, false) if conjunction else (false, true)
                decided += going * leaving
                going *= further
            return (going, decided) if conjunction else (decided, going)


def _walk(tree: Tree, paths: tuple[int, ...]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """How paths through a tree continue: those that leave it with true and those that leave it with false."""
    match tree:
        case Condition(number):
            true, false = (tuple(path + digit * 3**number for path in paths) for digit in (TRUE, FALSE))
            return true, false
        case Constant(held):
            return (paths, ()) if held else ((), paths)
        case Negation(operand):
            true, false = _walk(operand, paths)
            return false, true
        case Connective(parts, conjunction):
            decided: tuple[int, ...] = ()
            for part in parts:
                true, false = _walk(part, paths)
                paths, leaving = (true, false) if conjunction else (false, true)
                decided += leaving
            return (paths, decided) if conjunction else (decided, paths)
