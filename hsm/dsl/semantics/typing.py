"""From the syntax of an expression to a typed one: resolve names, convert units to SI, check types."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import field, replace
from enum import StrEnum
from types import MappingProxyType
from typing import Any

from hsm.dsl.reporting.report import Report
from hsm.dsl.semantics.names import Names
from hsm.dsl.semantics.numbers import number
from hsm.dsl.semantics.values import (
    OTHER_TYPES,
    SIMPLE_TYPES,
    Declared,
    Definition,
    DefinitionVisit,
    as_quantity,
    comparable,
    in_words,
    joined,
    listed,
    meant,
    size_of,
    type_of_enumeration,
)
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.ast import DEEPEST_EXPRESSION, depth_of, first_token, last_token, place_of
from hsm.dsl.syntax.tokens import Token
from hsm.model.diagnostics import Place, Related
from hsm.model.expressions import (
    Active,
    Binary,
    Choice,
    EventValue,
    Expression,
    Literal,
    SignalValue,
    Unary,
    VariableValue,
)
from hsm.model.registry import Library, Parameter
from hsm.model.types import (
    BOOLEAN,
    INTEGER,
    LARGEST_INTEGER,
    NUMBER,
    UNITS,
    Enumeration,
    Integer,
    Quantity,
    Type,
)
from hsm.model.unparse import value_text
from hsm.model.values import dataclass

FUNCTIONS = ("abs", "in", "max", "min")
"""The language's own functions."""

_ARITHMETIC: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda left, right: left + right,
    "-": lambda left, right: left - right,
    "*": lambda left, right: left * right,
    "/": lambda left, right: left / right,
    "min": min,
    "max": max,
}


_DURATION = Quantity(time=1)
_LARGEST_DEFINITION = 500
_LARGEST = 1e300


@dataclass(slots=True)
class Scope:
    """The names that the expressions of one file may use.

    Attributes:
        library: the registry.
        report: where diagnostics go.
        variables: variables and parameters by name.
        definitions: named expressions.
        enumerations: those of the registry and of the file.
        carried: the data of events, by the name of the event and of the part: the event and the type.
        outcomes: the enumerations of how each instance has ended, by name.
        heard: the events that the current transition waits for.
        states: names of states, for ``in(state)``.
        doubtful: names that may be declared on lines that could not be read; nothing is reported about those.
        possible: the same of states.
        used: names of variables that something reads.
    """

    library: Library
    report: Report
    variables: dict[str, Declared] = field(default_factory=dict)
    states: Set[str] = frozenset()
    doubtful: Names = field(default_factory=Names)
    possible: Names = field(default_factory=Names)
    used: Names = field(default_factory=Names)
    definitions: dict[str, Definition] = field(default_factory=dict)
    enumerations: dict[str, type[StrEnum]] = field(default_factory=dict)
    carried: dict[str, tuple[str, Type]] = field(default_factory=dict)
    outcomes: dict[str, type[StrEnum]] = field(default_factory=dict)
    heard: tuple[Token, ...] = ()

    def __post_init__(self) -> None:
        self.enumerations = self.enumerations or dict(self.library.enumerations)

    def type_named(self, name: Token) -> Type | None:
        """The type with a name; None if there is none: that is reported, unless its declaration was not understood."""
        found = SIMPLE_TYPES.get(name)
        if found is not None:
            return found
        enumeration = self.enumerations.get(name)
        if enumeration is not None:
            return type_of_enumeration(enumeration)
        if name in self.doubtful:
            return None
        hint = meant(name, OTHER_TYPES) or self.report.guess(name, [*SIMPLE_TYPES, *self.enumerations]).text
        if name in ("string", "str", "text"):
            hint = "strings are not supported; declare an enumeration: `enum NAME = VALUE, VALUE`"
        hint = hint or "`maze-machine list types` lists them"
        self.report.add_once("E0206", self._place(name), f"there is no type `{name}`", hint)
        return None

    def own_enumerations(self) -> tuple[type[StrEnum], ...]:
        """The enumerations of the file and of what it imports, in the order of their declaration."""
        return tuple(one for name, one in self.enumerations.items() if name not in self.library.enumerations)

    def value(self, node: ast.Expression, expected: Type) -> Expression | None:
        """A typed expression of a type; None if an error was reported."""
        found = self.expression(node, expected)
        return None if found is None else self._fit(found, expected, self._span(node))

    def duration(self, node: ast.Expression) -> Expression | None:
        """A typed expression that is a time and, where its value is known, not negative; None where it is invalid."""
        found = self.value(node, _DURATION)
        if isinstance(found, Literal) and found.value < 0:
            hint = "write the duration without the minus sign"
            self.report.add(
                "E0307", self._span(node), f"a duration cannot be {value_text(found.value, _DURATION)}", hint
            )
            return None
        return found

    def condition(self, node: ast.Expression) -> Expression | None:
        """A typed expression that is true or false; None if an error was reported."""
        return self.value(node, BOOLEAN)

    def expression(self, node: ast.Expression, expected: Type | None = None) -> Expression | None:
        """A typed expression; ``expected`` only helps to find the enumeration that a bare name belongs to."""
        if depth_of(node) > DEEPEST_EXPRESSION:
            message = f"this expression is nested more than {DEEPEST_EXPRESSION} deep"
            hint = "move parts of it into variables, or into a signal of the library"
            self.report.add("E0106", place_of(self.report.file, first_token(node)), message, hint)
            self.used.update(ast.names_in(node))
            return None
        return self._expression(node, expected)

    def arguments(
        self,
        call: ast.CallSyntax,
        parameters: Sequence[Parameter],
        subject: str,
        derived: Mapping[str, Expression] = MappingProxyType({}),
    ) -> tuple[Expression, ...] | None:
        """The arguments of a call in the order of the parameters, defaults filled in; None where one is invalid.

        Args:
            call: the call.
            parameters: of what is called.
            subject: its name in messages.
            derived: the expressions that replace defaults, by the parameter's name.
        """
        by_name = {parameter.name: parameter for parameter in parameters}
        given: dict[str, Expression | None] = {}
        position = 0
        for argument in call.arguments:
            if isinstance(argument, ast.Named):
                name, value, place = str(argument.name), argument.value, self._place(argument.name)
                if name not in by_name:
                    guess = self.report.guess(name, by_name)
                    hint = guess.text or listed(f"{subject} takes", by_name)
                    self.report.add("E0210", place, f"{subject} has no argument `{name}`", hint)
                    if guess.name is not None and guess.name not in given:
                        self.value(value, by_name[guess.name].type)
                    self.used.update(ast.names_in(value))
                    given[name] = None
                    continue
            elif position < len(parameters):
                name, value, place = parameters[position].name, argument, self._span(argument)
                position += 1
            else:
                takes = f"{len(parameters)} argument{'s' * (len(parameters) != 1)}"
                self.report.add("E0213", self._span(argument), f"{subject} takes {takes}")
                return None
            if name in given:
                self.report.add("E0213", place, f"argument `{name}` of {subject} is given twice")
                continue
            given[name] = self.value(value, by_name[name].type)
        missing = [name for name, one in by_name.items() if one.required and name not in given]
        if missing and not given.keys() - by_name.keys():
            names = ", ".join(f"`{name}`" for name in missing)
            message = f"{subject} needs {names}"
            hint = f"give it in the parentheses: `{call.name}({', '.join(f'{name} = ...' for name in missing)})`"
            self.report.add("E0212", place_of(self.report.file, call.name, call.closing), message, hint)
            return None
        if missing or None in given.values():
            return None
        return tuple(
            given.get(one.name) or derived.get(one.name) or Literal(one.default, one.type) for one in parameters
        )

    def _expression(self, node: ast.Expression | ast.Named, expected: Type | None) -> Expression | None:
        match node:
            case Token(type="NUMBER"):
                return number(node, self._place(node), self.report)
            case Token(type="NOT_FINITE") if not self._is_named(node, expected):
                hint = "only a signal and an argument that is expected can have it, with their own unit or none"
                self.report.add("E0306", self._place(node), f"`{node}` is not a finite number", hint)
                return None
            case Token():
                return self._name(node, expected)
            case ast.ChainSyntax():
                return self._chain(node)
            case ast.UnarySyntax():
                return self._unary(node)
            case ast.BinarySyntax():
                return self._binary(node)
            case ast.CallSyntax():
                return self._call(node)
            case ast.ChoiceSyntax():
                return self._choice(node, expected)
            case ast.Named():
                self.report.add("E0101", self._place(node.name), "a named argument is allowed only in a call")
                return None

    def _is_named(self, token: Token, expected: Type | None) -> bool:
        """Whether something has a name that may be read as a number which is not finite."""
        members = expected.members if isinstance(expected, Enumeration) else ()
        return any(token.value in known for known in (self.variables, self.library.signals, members))

    def _name(self, token: Token, expected: Type | None) -> Expression | None:
        name = token.value
        if name in ("true", "false"):
            return Literal(name == "true", BOOLEAN, self._place(token))
        declared = self.variables.get(name)
        if declared is not None:
            self.used.add(name)
            return VariableValue(name, declared.type, self._place(token))
        if name in self.definitions:
            return self._defined(token)
        if name in self.carried:
            return self._carried(token)
        constant = self.library.constants.get(name)
        if constant is not None:
            return Literal(constant.value, constant.type, self._place(token))
        signal = self.library.signals.get(name)
        if signal is not None:
            call = ast.CallSyntax(token, (), token, 1)
            arguments = self.arguments(call, signal.parameters, f"signal `{name}`")
            return None if arguments is None else SignalValue(signal, arguments, self._place(token))
        return self._member(token, expected)

    def _carried(self, token: Token) -> EventValue | None:
        """The data of the event that the current transition waits for."""
        event, kind = self.carried[token.value]
        if [str(one) for one in self.heard] == [event]:
            return EventValue(token.value, kind, self._place(token))
        listed = len(self.heard) > 1 and event in self.heard
        hint = f"write a line for `on {event}` alone" if listed else f"only a transition `on {event}` can use it"
        message = f"`{token}` is known only while the event `{event}` is handled"
        self.report.add_once("E0202", self._place(token), message, hint, subject=f"{token} on {len(self.heard)}")
        return None

    def _choice(self, node: ast.ChoiceSyntax, expected: Type | None) -> Expression | None:
        """One of two values; one of two conditions becomes a condition of all three."""
        condition = self.condition(node.condition)
        then = self._expression(node.then, expected)
        other = self._expression(node.otherwise, expected if then is None else then.type)
        if condition is None or then is None or other is None:
            return None
        place = self._span(node)
        if not comparable(then.type, other.type):
            self._mismatch(then.type, other.type, "if ... else", place, (then, other))
            return None
        if then.type == BOOLEAN:
            chosen = Binary("and", condition, then, BOOLEAN, place)
            return Binary("or", chosen, Binary("and", Unary("not", condition, BOOLEAN), other, BOOLEAN), BOOLEAN, place)
        if isinstance(condition, Literal):
            return then if condition.value else other
        kind = then.type if then.type == other.type else NUMBER
        return Choice(condition, then, other, kind, place)

    def _defined(self, token: Token) -> Expression | None:
        """The expression that a name represents, at the place where it is used."""
        definition = self.definitions[token.value]
        self.used.add(token.value)
        if definition.state is DefinitionVisit.OPEN:
            self.report.add_once("E0202", self._place(token), f"`{token}` is defined by itself", subject=token.value)
            return None
        if definition.state is None:
            definition.state = DefinitionVisit.OPEN
            heard, self.heard = self.heard, ()  # it means the same everywhere
            definition.value = self.expression(definition.node)
            self.heard = heard
            definition.state = DefinitionVisit.DONE
            if definition.value is not None and size_of(definition.value) > _LARGEST_DEFINITION:
                message = f"`{token}` expands to an expression with more than {_LARGEST_DEFINITION} parts"
                self.report.add("E0106", definition.place, message, "move a part of it into a signal of the library")
                definition.value = None
        return None if definition.value is None else replace(definition.value, place=self._place(token))

    def _member(self, token: Token, expected: Type | None) -> Literal | None:
        if isinstance(expected, Enumeration):
            known = {**self.enumerations, **self.outcomes}
            candidates = [one for name, one in known.items() if name == expected.name]
        else:
            candidates = list(self.enumerations.values())
        owners = [one for one in candidates if token.value in one._value2member_map_]
        if len(owners) == 1:
            return Literal(owners[0](token.value), type_of_enumeration(owners[0]), self._place(token))
        if self.doubtful.has_part_of(token.value) or self.possible.has_owner_of(token.value):
            return None
        if owners:
            names = " and ".join(one.__name__ for one in owners)
            self.report.add_once(
                "E0202",
                self._place(token),
                f"`{token}` is a value of {names}; compare it with a variable or signal of one of these types",
            )
            return None
        hint: str | None
        if isinstance(expected, Enumeration) and "." not in token:
            message = f"`{token}` is neither a variable nor a value of {expected}"
            close = self.report.guess(token, [*self.variables, *self.definitions, *expected.members])
            hint = close.text or f"the values are {', '.join(expected.members)}"
        else:
            message = f"there is no variable, parameter or signal `{token}`"
            close = self.report.guess(
                token,
                [
                    *self.variables,
                    *self.definitions,
                    *self.library.signals,
                    *self.library.constants,
                    *(name for name, (event, _) in self.carried.items() if event in self.heard),
                ],
            )
            hint = self._other_kind(token.value) or close.text or "`maze-machine list signals` lists them"
        self.used.add(close.name or "")
        if close.name is None:
            self.used.add_unknown()
        self.report.add_once("E0202", self._place(token), message, hint, subject=token.value)
        return None

    def _other_kind(self, name: str) -> str | None:
        """A suggestion if a name is known, but has no value."""
        library = self.library
        if name.lower() in ("true", "false"):
            return f"write `{name.lower()}`"
        if name in library.events or any(name in one.outcomes for one in library.activities.values()):
            return f"`{name}` is an event: write `on {name}`"
        if name in self.states:
            return f"to ask whether a state is active, write `in({name})`"
        return None

    def _chain(self, node: ast.ChainSyntax) -> Expression | None:
        operands = [self.value(operand, BOOLEAN) for operand in node.operands]
        known = [one for one in operands if one is not None]
        return self._balanced(node.operator, known) if len(known) == len(operands) else None

    def any_of(self, conditions: list[Expression]) -> Expression:
        """The disjunction of some conditions."""
        return self._balanced("or", conditions)

    def _balanced(self, operator: str, operands: list[Expression]) -> Expression:
        """A flat tree: a long chain is not a deep expression."""
        if len(operands) == 1:
            return operands[0]
        middle = len(operands) // 2
        left, right = self._balanced(operator, operands[:middle]), self._balanced(operator, operands[middle:])
        return Binary(operator, left, right, BOOLEAN, joined(left, right))

    def _unary(self, node: ast.UnarySyntax) -> Expression | None:
        if node.operator == "not":
            operand = self.value(node.operand, BOOLEAN)
            return None if operand is None else Unary("not", operand, BOOLEAN, self._span(node))
        operand = self._numeric(node.operand)
        if operand is None:
            return None
        if isinstance(operand, Literal):
            return Literal(-operand.value, operand.type, self._span(node))
        return Unary("-", operand, operand.type, self._span(node))

    def _binary(self, node: ast.BinarySyntax) -> Expression | None:
        if node.operator in ("==", "!="):
            return self._equality(node)
        left = self._numeric(node.left)
        right = self._numeric(node.right) if left is not None else self._expression(node.right, None)
        if left is None or right is None:
            return None
        return self._combine(str(node.operator), left, right, self._span(node))

    def _combine(self, operator: str, left: Expression, right: Expression, place: Place) -> Expression | None:
        """An arithmetic operation or an ordering of two numeric expressions."""
        left_type, right_type = left.type, right.type
        kind: Type
        if operator in ("*", "/"):
            if operator == "/" and isinstance(right, Literal) and right.value == 0:
                self.report.add("E0305", right.place or place, "this is a division by zero", "divide by another value")
                return None
            first, second = as_quantity(left_type), as_quantity(right_type)
            kind = first * second if operator == "*" else first / second
            if operator == "*" and left_type == right_type == INTEGER:
                kind = INTEGER
        else:
            if as_quantity(left_type) != as_quantity(right_type):
                self._mismatch(left_type, right_type, operator, place, (left, right))
                return None
            kind = INTEGER if left_type == right_type == INTEGER else as_quantity(left_type)
        if operator in _ARITHMETIC:
            if isinstance(left, Literal) and isinstance(right, Literal):
                return self._folded(operator, left, right, kind, place)
            return Binary(operator, left, right, kind, place)
        return Binary(operator, left, right, BOOLEAN, place)

    def _folded(self, operator: str, left: Literal, right: Literal, kind: Type, place: Place) -> Literal | None:
        value = _ARITHMETIC[operator](left.value, right.value)
        if abs(value) > (LARGEST_INTEGER if kind == INTEGER else _LARGEST):
            self.report.add("E0306", place, "this number is too large")
            return None
        return Literal(value, kind, place)

    def _equality(self, node: ast.BinarySyntax) -> Expression | None:
        operands: tuple[Expression | None, Expression | None]
        if self._is_bare(node.left):
            right = self.expression(node.right)
            operands = (None if right is None else self.expression(node.left, right.type), right)
        else:
            left = self.expression(node.left)
            operands = (left, None if left is None else self.expression(node.right, left.type))
        first, second = operands
        if first is None or second is None:
            return None
        if not comparable(first.type, second.type):
            self._mismatch(first.type, second.type, str(node.operator), self._span(node), (first, second))
            return None
        return Binary(str(node.operator), first, second, BOOLEAN, self._span(node))

    def _is_bare(self, node: ast.Expression) -> bool:
        """Whether a node is a name whose meaning depends on the other side of a comparison."""
        return (
            isinstance(node, Token)
            and node.type == "NAME"
            and node.value not in self.variables
            and node.value not in self.definitions
            and node.value not in self.carried
            and node.value not in self.library.signals
        )

    def _call(self, node: ast.CallSyntax) -> Expression | None:
        name = str(node.name)
        place = place_of(self.report.file, node.name, node.closing)
        if name == "in":
            return self._active(node, place)
        if name == "abs":
            return self._absolute(node, place)
        if name in ("min", "max"):
            return self._extreme(node, place)
        signal = self.library.signals.get(name)
        if signal is None:
            if not self.doubtful.has_part_of(name):
                hint = self.report.guess(name, [*FUNCTIONS, *self.library.signals]).text
                message = f"there is no signal or function `{name}`"
                self.report.add_once("E0202", self._place(node.name), message, hint)
            return None
        arguments = self.arguments(node, signal.parameters, f"signal `{name}`")
        if arguments is None:
            return None
        for argument in arguments:
            if not self.is_constant(argument):
                message = "an argument of a signal can contain only constants and parameters"
                self.report.add("E0303", argument.place, message)
                return None
        return SignalValue(signal, arguments, place)

    def _active(self, node: ast.CallSyntax, place: Place) -> Expression | None:
        match node.arguments:
            case (Token(type="NAME") as state,):
                if state in self.states:
                    return Active(str(state), place)
                if not (self.doubtful.has_part_of(state) or self.possible.has_part_of(state)):
                    hint = self.report.guess(state, self.states).text
                    self.report.add_once("E0201", self._place(state), f"there is no state `{state}`", hint)
            case _:
                self.report.add("E0213", place, "`in` takes the name of one state")
        return None

    def _absolute(self, node: ast.CallSyntax, place: Place) -> Expression | None:
        if len(node.arguments) != 1 or isinstance(node.arguments[0], ast.Named):
            self.report.add("E0213", place, "`abs` takes one number")
            return None
        operand = self._numeric(node.arguments[0])
        if isinstance(operand, Literal):
            return Literal(abs(operand.value), operand.type, place)
        return None if operand is None else Unary("abs", operand, operand.type, place)

    def _extreme(self, node: ast.CallSyntax, place: Place) -> Expression | None:
        values = [one for one in node.arguments if not isinstance(one, ast.Named)]
        if len(values) < 2 or len(values) < len(node.arguments) or len(values) > DEEPEST_EXPRESSION:
            self.report.add("E0213", place, f"`{node.name}` takes two to {DEEPEST_EXPRESSION} numbers")
            return None
        operands = [self._numeric(one) for one in values]
        result = operands[0]
        for operand in operands[1:]:
            if result is None or operand is None:
                return None
            result = self._combine(str(node.name), result, operand, place)
        return result

    def _numeric(self, node: ast.Expression | ast.Named) -> Expression | None:
        found = self._expression(node, None)
        if found is not None and not isinstance(found.type, (Integer, Quantity)):
            self.report.add("E0302", self._span(node), f"expected a number here, but this is {in_words(found.type)}")
            return None
        return found

    def is_constant(self, expression: Expression) -> bool:
        """Whether an expression keeps its value while the machine runs."""
        match expression:
            case Literal():
                return True
            case EventValue():
                return False
            case VariableValue(name=name):
                return self.variables[name].constant
            case Unary(operand=operand):
                return self.is_constant(operand)
            case Binary(left=left, right=right):
                return self.is_constant(left) and self.is_constant(right)
            case Choice(condition, then, otherwise):
                return all(map(self.is_constant, (condition, then, otherwise)))
            case _:
                return False

    def _fit(self, found: Expression, expected: Type, place: Place) -> Expression | None:
        """The expression as one of the expected type: a whole number may represent a number."""
        if found.type == expected:
            return found
        if found.type == INTEGER and expected == NUMBER:
            return Literal(float(found.value), NUMBER, found.place) if isinstance(found, Literal) else found
        hint = None
        if isinstance(expected, Quantity) and found.type in (INTEGER, NUMBER):
            units = [f"`{unit.name}`" for unit in UNITS.values() if unit.quantity == expected]
            hint = f"write a unit after the number: {' or '.join(units) or f'`{expected.si_unit}`'}"
        actual = "this number has no unit" if hint and isinstance(found, Literal) else f"this is {in_words(found.type)}"
        self.report.add("E0301", place, f"expected {in_words(expected)} here, but {actual}", hint)
        return None

    def _mismatch(
        self, left: Type, right: Type, operator: str, place: Place, operands: tuple[Expression, Expression]
    ) -> None:
        message = f"`{operator}` cannot combine {in_words(left)} and {in_words(right)}"
        related = tuple(
            Related(operand.place, f"this is {in_words(operand.type)}")
            for operand in operands
            if operand.place is not None
        )
        self.report.add("E0302", place, message, related=related)

    def _place(self, token: Token) -> Place:
        return place_of(self.report.file, token)

    def _span(self, node: ast.Expression | ast.Named) -> Place:
        return place_of(self.report.file, first_token(node), last_token(node))
