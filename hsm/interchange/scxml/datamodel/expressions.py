"""Data expressions: read into trees of functions, without any evaluation of foreign code.

The subset is what ECMAScript and Python have in common, in both spellings: literals, lists and objects, arithmetic,
comparison, logic, members of data, and a few functions. Nothing in it reaches an object of the program.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from typing import Any

from hsm.interchange.scxml.datamodel.tokens import InvalidExpressionError, Lexeme, UnsupportedError, tokens_of
from hsm.model.messages import Store
from hsm.model.values import dataclass


class DataError(Exception):
    """An expression that cannot be evaluated: SCXML's ``error.execution``."""


@dataclass(frozen=True, slots=True)
class Environment:
    """The names that an expression can use.

    Attributes:
        store: the data.
        active: the active states, by index.
        states: the index of each state, by name.
        system: the chart's own constants, such as ``_name``.
    """

    store: Store
    active: Collection[int]
    states: Mapping[str, int]
    system: Mapping[str, Any]

    @property
    def constants(self) -> Mapping[str, Any]:
        """The chart's constants; an invoked chart has a session identifier of its own."""
        return self.system if self.store.session is None else in_session(self.system, self.store.session)


def in_session(system: Mapping[str, Any], session: str) -> Mapping[str, Any]:
    """The constants of a chart in a session of its own."""
    processors = {name: {"location": f"#_scxml_{session}"} for name in system.get("_ioprocessors", {})}
    return {**system, "_sessionid": session, "_ioprocessors": processors}


Evaluate = Callable[[Environment], Any]

PROCESSORS = (
    "http://www.w3.org/TR/scxml/#SCXMLEventProcessor",
    "http://www.w3.org/TR/scxml/",
    "http://www.w3.org/TR/scxml",
    "scxml",
)
"""The spellings of the type of the SCXML event processor, which compare as equal; ``_event.origintype`` is the first.

Source: W3C, State Chart XML (SCXML), section 6.2.5, which names the first and the last of them.
"""

_DEPTH = 60
_LONGEST = 100_000
_CONSTANTS = {"true": True, "false": False, "True": True, "False": False, "null": None, "None": None, "undefined": None}
_WORDS = frozenset(
    {"and", "or", "not", "is", "in", "instanceof", "typeof", "return", "var", "let", "const", "if", "else"}
)
_LEVELS: tuple[tuple[str, ...], ...] = (("||", "or"), ("&&", "and"))
_CLASSES: dict[str, type | tuple[type, ...]] = {"Array": list, "Object": (list, dict)}
_COMPARE = frozenset({"==", "!=", "===", "!==", "<", "<=", ">", ">="})


def truth(value: Any) -> bool:
    """Whether a value counts as true, by ECMAScript's rules: lists and objects do."""
    if isinstance(value, float) and math.isnan(value):
        return False
    return isinstance(value, list | dict) or bool(value)


def compile_expression(text: str) -> Evaluate:
    """The function that evaluates an expression.

    Raises:
        InvalidExpressionError: it is none.
        UnsupportedError: it is not in the subset.
    """
    parser = _Parser(tokens_of(text))
    made = parser.choice(0)
    if parser.left:
        raise InvalidExpressionError(f"`{parser.left[0].value}` is not allowed there")
    return made


def event_fields(store: Store) -> Any:
    """The value of ``_event``."""
    event = store.event
    if event is None:
        return None
    origin = event.origin
    return {
        "name": event.name,
        "type": event.kind,
        "sendid": event.sendid,
        "origin": origin,
        "origintype": PROCESSORS[0] if origin is not None else None,
        "invokeid": event.invokeid,
        "data": event.data,
    }


@dataclass(slots=True)
class _Parser:
    left: list[Lexeme]

    def _is(self, *words: str) -> bool:
        return bool(self.left) and self.left[0].kind in ("mark", "name") and self.left[0].value in words

    def _take(self, *words: str) -> bool:
        if self._is(*words):
            self.left.pop(0)
            return True
        return False

    def _expect(self, word: str) -> None:
        if not self._take(word):
            raise InvalidExpressionError(f"`{word}` is missing")

    def choice(self, depth: int) -> Evaluate:
        if depth > _DEPTH:
            raise UnsupportedError(f"an expression nested more than {_DEPTH} deep")
        condition = self._junction(depth, 0)
        if not self._take("?"):
            return condition
        then = self.choice(depth + 1)
        self._expect(":")
        other = self.choice(depth + 1)
        return lambda env: then(env) if truth(condition(env)) else other(env)

    def _junction(self, depth: int, level: int) -> Evaluate:
        if level == len(_LEVELS):
            return self._negation(depth)
        first = self._junction(depth, level + 1)
        while self._take(*_LEVELS[level]):
            first = _joined(first, self._junction(depth, level + 1), conjunction=level == 1)
        return first

    def _negation(self, depth: int) -> Evaluate:
        if self._take("not"):
            operand = self._negation(depth + 1) if depth < _DEPTH else self.choice(depth + 1)
            return lambda env: not truth(operand(env))
        return self._comparison(depth)

    def _comparison(self, depth: int) -> Evaluate:
        first = self._sum(depth)
        while self.left and (self.left[0].value in _COMPARE or self._is("is", "in", "instanceof")):
            operator = str(self.left.pop(0).value)
            if operator == "instanceof":
                first = _instance(first, str(self.left.pop(0).value) if self.left else "")
                continue
            if operator == "is" and self._take("not"):
                operator = "!="
            first = _compared("==" if operator == "is" else operator, first, self._sum(depth))
        return first

    def _sum(self, depth: int) -> Evaluate:
        first = self._product(depth)
        while self._is("+", "-"):
            first = _computed(str(self.left.pop(0).value), first, self._product(depth))
        return first

    def _product(self, depth: int) -> Evaluate:
        first = self._unary(depth)
        while self._is("*", "/", "%"):
            first = _computed(str(self.left.pop(0).value), first, self._unary(depth))
        return first

    def _unary(self, depth: int) -> Evaluate:
        if depth > _DEPTH:
            raise UnsupportedError(f"an expression nested more than {_DEPTH} deep")
        if self._take("!"):
            operand = self._unary(depth + 1)
            return lambda env: not truth(operand(env))
        if self._take("-"):
            operand = self._unary(depth + 1)
            return lambda env: -_number(operand(env))
        if self._take("+"):
            operand = self._unary(depth + 1)
            return lambda env: _number(operand(env))
        if self._take("typeof"):
            return _typeof(self._unary(depth + 1))
        return self._postfix(depth)

    def _postfix(self, depth: int) -> Evaluate:
        value = self._primary(depth)
        while True:
            if self._take("."):
                if not self.left or self.left[0].kind != "name":
                    raise InvalidExpressionError("a name is missing after `.`")
                name = str(self.left.pop(0).value)
                value = self._method(value, name, depth) if self._take("(") else _member(value, _constant(name))
            elif self._take("["):
                key = self.choice(depth + 1)
                self._expect("]")
                value = _member(value, key)
            elif self._is("("):
                raise UnsupportedError("a call of something that is not a function of the subset")
            else:
                return value

    def _arguments(self, depth: int, closing: str) -> list[Evaluate]:
        found: list[Evaluate] = []
        while not self._take(closing):
            found.append(self.choice(depth + 1))
            if not self._is(closing):
                self._expect(",")
        return found

    def _method(self, value: Evaluate, name: str, depth: int) -> Evaluate:
        if name not in _METHODS:
            raise UnsupportedError(f"the method `{name}`")
        arguments, method = self._arguments(depth, ")"), _METHODS[name]
        return lambda env: _guarded(method, value(env), *(one(env) for one in arguments))

    def _primary(self, depth: int) -> Evaluate:
        if not self.left:
            raise InvalidExpressionError("it ends where a value is expected")
        token = self.left.pop(0)
        if token.kind in ("number", "text"):
            return lambda _: token.value
        if token.kind == "name":
            return self._named(str(token.value), depth)
        match token.value:
            case "(":
                inner = self.choice(depth + 1)
                self._expect(")")
                return inner
            case "[":
                parts = self._arguments(depth, "]")
                return lambda env: [one(env) for one in parts]
            case "{":
                return self._object(depth)
        raise InvalidExpressionError(f"`{token.value}` is not a value")

    def _object(self, depth: int) -> Evaluate:
        parts: dict[str, Evaluate] = {}
        while not self._take("}"):
            if not self.left or self.left[0].kind not in ("name", "text"):
                raise InvalidExpressionError("a key is missing")
            key = str(self.left.pop(0).value)
            self._expect(":")
            parts[key] = self.choice(depth + 1)
            if not self._is("}"):
                self._expect(",")
        return lambda env: {key: one(env) for key, one in parts.items()}

    def _named(self, name: str, depth: int) -> Evaluate:
        if name in _CONSTANTS:
            return lambda _: _CONSTANTS[name]
        if name == "Math":
            self._expect(".")
            name = f"Math.{self.left.pop(0).value}" if self.left else name
        if name in _WORDS:
            raise InvalidExpressionError(f"`{name}` is not a value")
        if not self._take("("):
            return lambda env: _lookup(env, name)
        arguments = self._arguments(depth, ")")
        if name == "In" and len(arguments) == 1:
            return lambda env: _in(env, arguments[0](env))
        if name not in _FUNCTIONS:
            raise UnsupportedError(f"the function `{name}`")
        function = _FUNCTIONS[name]
        return lambda env: _guarded(function, *(one(env) for one in arguments))


def _constant(value: Any) -> Evaluate:
    return lambda _: value


def _joined(left: Evaluate, right: Evaluate, *, conjunction: bool) -> Evaluate:
    def both(env: Environment) -> Any:
        first = left(env)
        return right(env) if truth(first) is conjunction else first

    return both


def _compared(operator: str, left: Evaluate, right: Evaluate) -> Evaluate:
    def compare(env: Environment) -> bool:
        first, second = left(env), right(env)
        if operator in ("==", "==="):
            return _alike(first, second)
        if operator in ("!=", "!=="):
            return not _alike(first, second)
        if operator == "in":
            if not isinstance(second, dict | list | str):
                raise DataError(f"nothing is in {second!r:.40}")
            return first in second
        if not (isinstance(first, str) and isinstance(second, str)):
            first, second = _number(first), _number(second)
        return bool({"<": first < second, "<=": first <= second, ">": first > second, ">=": first >= second}[operator])

    return compare


def _instance(operand: Evaluate, name: str) -> Evaluate:
    """Whether a value is a list (``Array``), or a list or an object (``Object``)."""
    if name not in _CLASSES:
        raise UnsupportedError(f"`instanceof {name}`")
    return lambda env: isinstance(operand(env), _CLASSES[name])


def _alike(first: Any, second: Any) -> bool:
    if isinstance(first, bool) != isinstance(second, bool):
        return False
    return bool(first == second) or (first in PROCESSORS and second in PROCESSORS)


def _computed(operator: str, left: Evaluate, right: Evaluate) -> Evaluate:
    def compute(env: Environment) -> Any:
        first, second = left(env), right(env)
        if operator == "+" and isinstance(first, list) and isinstance(second, list):
            return _bounded(first + second)
        if operator == "+" and (isinstance(first, str) or isinstance(second, str)):
            return _bounded(_text(first) + _text(second))
        one, other = _number(first), _number(second)
        try:
            value = {"+": lambda: one + other, "-": lambda: one - other, "*": lambda: one * other}.get(
                operator, lambda: one / other if operator == "/" else one % other
            )()
        except (ZeroDivisionError, OverflowError) as error:
            raise DataError(str(error)) from None
        if isinstance(value, int) and abs(value) > 2**63:
            raise DataError("a whole number has grown beyond 63 bits")
        return value

    return compute


def _bounded(value: Any) -> Any:
    if len(value) > _LONGEST:
        raise DataError("the value has grown too large")
    return value


def _number(value: Any) -> int | float:
    if isinstance(value, int | float):
        return value
    raise DataError(f"{value!r:.40} is not a number")


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str | int | float):
        return str(value)
    if isinstance(value, list):
        return ",".join(map(_text, value))
    raise DataError(f"{value!r:.40} is not text")


def _typeof(operand: Evaluate) -> Evaluate:
    names = {bool: "boolean", int: "number", float: "number", str: "string", list: "object", dict: "object"}

    def kind(env: Environment) -> str:
        try:
            return names.get(type(operand(env)), "undefined")
        except DataError:
            return "undefined"

    return kind


def _member(value: Evaluate, key: Evaluate) -> Evaluate:
    def read(env: Environment) -> Any:
        owner, name = value(env), key(env)
        if isinstance(owner, dict):
            return owner.get(name)
        if isinstance(owner, list | str):
            if name == "length":
                return len(owner)
            if isinstance(name, int) and not isinstance(name, bool):
                return owner[name] if 0 <= name < len(owner) else None
        raise DataError(f"{owner!r:.40} has no `{name}`")

    return read


def _lookup(env: Environment, name: str) -> Any:
    if name == "_event":
        found = event_fields(env.store)
        if found is None:
            raise DataError("there was no event yet")
        return found
    if name in env.system:
        return env.constants[name]
    if name in env.store.values:
        return env.store.values[name]
    raise DataError(f"there is no data `{name}`")


def _in(env: Environment, state: Any) -> bool:
    if state not in env.states:
        raise DataError(f"there is no state `{state}`")
    return env.states[state] in env.active


def _guarded(function: Callable[..., Any], *arguments: Any) -> Any:
    try:
        return function(*arguments)
    except (TypeError, ValueError, AttributeError, LookupError, OverflowError) as error:
        raise DataError(str(error)) from None


def _concat(owner: list[Any], *others: Any) -> list[Any]:
    if not isinstance(owner, list):
        raise TypeError("only lists are joined")
    return owner + [one for other in others for one in (other if isinstance(other, list) else [other])]


def _owner(value: Any, kind: type) -> Any:
    if not isinstance(value, kind):
        raise TypeError(f"{value!r:.40} has no such method")
    return value


_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "hasattr": lambda owner, name: name in _owner(owner, dict),
    "len": len,
    "str": _text,
    "String": _text,
    "int": lambda value: int(_number(value)),
    "Number": _number,
    "abs": lambda value: abs(_number(value)),
    "Math.abs": lambda value: abs(_number(value)),
    "Math.floor": lambda value: math.floor(_number(value)),
    **dict.fromkeys(("min", "Math.min"), lambda *values: min(map(_number, values))),
    **dict.fromkeys(("max", "Math.max"), lambda *values: max(map(_number, values))),
    "bool": truth,
    "Boolean": truth,
}
_METHODS: dict[str, Callable[..., Any]] = {
    "get": lambda owner, name, default=None: _owner(owner, dict).get(name, default),
    "hasOwnProperty": lambda owner, name: name in _owner(owner, dict),
    "startswith": lambda owner, text: _owner(owner, str).startswith(text),
    "startsWith": lambda owner, text: _owner(owner, str).startswith(text),
    "endsWith": lambda owner, text: _owner(owner, str).endswith(text),
    "endswith": lambda owner, text: _owner(owner, str).endswith(text),
    "indexOf": lambda owner, part: _owner(owner, str | list).index(part) if part in owner else -1,  # type: ignore[arg-type]
    "concat": _concat,
    "toString": _text,
}
