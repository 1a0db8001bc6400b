"""Data expressions: read into trees of functions, without any evaluation of foreign code.

What ECMAScript and Python have in common is read here: literals, lists and objects, arithmetic, members, calls of a few
functions. Each language adds its own operators, and says what they mean. Nothing reaches an object of the program.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from typing import Any, ClassVar

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


class Language(ABC):
    """A reader of expressions of one language: its grammar, and what its operators mean.

    A reader reads one expression.

    Attributes:
        beyond: the words and marks that mean something in the language and are not in the subset.
        constants: the words for constants.
        reserved: the words that cannot be names.
        functions: the functions of the subset.
        methods: the methods of the subset; the owner is the first argument.
    """

    beyond: ClassVar[frozenset[str]]
    constants: ClassVar[Mapping[str, Any]]
    reserved: ClassVar[frozenset[str]]
    functions: ClassVar[Mapping[str, Callable[..., Any]]]
    methods: ClassVar[Mapping[str, Callable[..., Any]]]

    def __init__(self, text: str) -> None:
        self.left: list[Lexeme] = tokens_of(text, self.beyond)

    @classmethod
    def read(cls, text: str) -> Evaluate:
        """The function that evaluates an expression.

        Raises:
            InvalidExpressionError: it is none.
            UnsupportedError: it is not in the subset.
        """
        reader = cls(text)
        made = reader.choice(0)
        if reader.left:
            raise reader.strange(reader.left[0])
        return made

    @classmethod
    def literal(cls, text: str) -> Any:
        """The value of a literal: a number, a text, a constant, or a list or object of those.

        Raises:
            InvalidExpressionError: it is not an expression.
            UnsupportedError: it is another expression.
        """
        marks = [str(one.value) for one in tokens_of(text, cls.beyond) if one.kind == "mark"]
        computed = [one for one in marks if one not in "[]{},:-"]
        if computed:
            raise UnsupportedError(f"`{computed[0]}`")
        try:
            return cls.read(text)(Environment(Store(), (), {}, {}))
        except DataError as error:
            raise UnsupportedError(str(error)) from None

    @staticmethod
    @abstractmethod
    def truth(value: Any) -> bool:
        """Whether a value counts as true."""

    @staticmethod
    @abstractmethod
    def computed(operator: str, first: Any, second: Any) -> Any:
        """The result of an operator of arithmetic.

        Raises:
            DataError: the values have none.
        """

    @staticmethod
    @abstractmethod
    def member(owner: Any, name: Any) -> Any:
        """What an owner holds under a name or a number in brackets.

        Raises:
            DataError: it holds nothing there, and that is an error in the language.
        """

    @staticmethod
    @abstractmethod
    def attribute(owner: Any, name: str) -> Any:
        """What an owner holds under a name after a dot.

        Raises:
            DataError: it holds nothing there, and that is an error in the language.
        """

    @abstractmethod
    def choice(self, depth: int) -> Evaluate:
        """Read an expression, with its operators of choice, logic and comparison."""

    @abstractmethod
    def unary(self, depth: int) -> Evaluate:
        """Read an operand of arithmetic, with the operators before it."""

    def at(self, *words: str) -> bool:
        """Whether one of some words or marks is next."""
        return bool(self.left) and self.left[0].kind in ("mark", "name") and self.left[0].value in words

    def take(self, *words: str) -> str | None:
        """Read one of some words or marks, if it is next."""
        return str(self.left.pop(0).value) if self.at(*words) else None

    def expect(self, word: str) -> None:
        """Read a word or mark that must be next."""
        if not self.take(word):
            raise InvalidExpressionError(f"`{word}` is missing")

    def deeper(self, depth: int) -> int:
        """One level further inside."""
        if depth >= _DEPTH:
            raise UnsupportedError(f"an expression nested more than {_DEPTH} deep")
        return depth + 1

    def strange(self, token: Lexeme) -> ValueError:
        """The error of a token that is not allowed where it is."""
        if token.value == "," and token.kind == "mark":
            return UnsupportedError("`,` between expressions")
        return InvalidExpressionError(f"`{token.value}` is not allowed there")

    def sum(self, depth: int) -> Evaluate:
        """Read a sum."""
        return self._row(self._product, ("+", "-"), depth)

    def _product(self, depth: int) -> Evaluate:
        return self._row(self.unary, ("*", "/", "%", "//"), depth)

    def _row(self, part: Callable[[int], Evaluate], operators: tuple[str, ...], depth: int) -> Evaluate:
        first = part(depth)
        while operator := self.take(*operators):
            first = self._binary(operator, first, part(depth))
        return first

    def _binary(self, operator: str, left: Evaluate, right: Evaluate) -> Evaluate:
        compute = self.computed
        return lambda env: finite(compute(operator, left(env), right(env)))

    def postfix(self, depth: int) -> Evaluate:
        """Read a value with what follows it: members, calls of methods."""
        value = self._primary(depth)
        while True:
            if self.take("."):
                if not self.left or self.left[0].kind != "name":
                    raise InvalidExpressionError("a name is missing after `.`")
                value = self._after_dot(value, str(self.left.pop(0).value), depth)
            elif self.take("["):
                value = self._in_brackets(value, depth)
            elif self.at("("):
                raise UnsupportedError("a call of something that is not a function of the subset")
            else:
                return value

    def _after_dot(self, value: Evaluate, name: str, depth: int) -> Evaluate:
        if not self.take("("):
            read = self.attribute
            return lambda env: read(value(env), name)
        if name not in self.methods:
            raise UnsupportedError(f"the method `{name}`")
        arguments, method = self._arguments(depth, ")"), self.methods[name]
        return lambda env: _guarded(method, value(env), *(one(env) for one in arguments))

    def _in_brackets(self, value: Evaluate, depth: int) -> Evaluate:
        key = self.choice(self.deeper(depth))
        if self.at(":", ","):
            raise UnsupportedError("a slice")
        self.expect("]")
        read = self.member
        return lambda env: read(value(env), key(env))

    def _arguments(self, depth: int, closing: str) -> list[Evaluate]:
        found: list[Evaluate] = []
        while not self.take(closing):
            found.append(self.choice(self.deeper(depth)))
            if self.at("="):
                raise UnsupportedError("an argument with a name")
            if not self.at(closing):
                self.expect(",")
        return found

    def _primary(self, depth: int) -> Evaluate:
        if not self.left:
            raise InvalidExpressionError("it ends where a value is expected")
        token = self.left.pop(0)
        if token.kind in ("number", "text"):
            return lambda _: token.value
        if token.kind == "name":
            return self.named(str(token.value), depth)
        match token.value:
            case "(":
                if self.at(")"):
                    raise UnsupportedError("`()`")
                inner = self.choice(self.deeper(depth))
                if self.at(","):
                    raise UnsupportedError("`,` between expressions")
                self.expect(")")
                return inner
            case "[":
                parts = self._arguments(depth, "]")
                return lambda env: [one(env) for one in parts]
            case "{":
                return self._object(depth)
            case "/":
                raise UnsupportedError("a regular expression")
        raise InvalidExpressionError(f"`{token.value}` is not a value")

    def _object(self, depth: int) -> Evaluate:
        parts: dict[str, Evaluate] = {}
        while not self.take("}"):
            if not self.left:
                raise InvalidExpressionError("a key is missing")
            key = self.key(self.left.pop(0))
            self.expect(":")
            parts[key] = self.choice(self.deeper(depth))
            if not self.at("}"):
                self.expect(",")
        return lambda env: {key: one(env) for key, one in parts.items()}

    def key(self, token: Lexeme) -> str:
        """The key of a pair in an object."""
        if token.kind == "text":
            return str(token.value)
        raise UnsupportedError(f"the key `{token.value}`")

    def named(self, name: str, depth: int) -> Evaluate:
        """Read what begins with a name: a constant, a call of a function, or a piece of data."""
        if name in self.constants:
            return lambda _: self.constants[name]
        if name in self.reserved:
            raise InvalidExpressionError(f"`{name}` is not a value")
        if not self.take("("):
            return lambda env: _lookup(env, name)
        arguments = self._arguments(depth, ")")
        if name == "In" and len(arguments) == 1:
            return lambda env: _in(env, arguments[0](env))
        if name not in self.functions:
            raise UnsupportedError(f"the function `{name}`")
        function = self.functions[name]
        return lambda env: finite(_guarded(function, *(one(env) for one in arguments)))


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


def same_text(first: str, second: str) -> bool:
    """Whether two texts are equal, or both name the SCXML event processor."""
    return first == second or (first in PROCESSORS and second in PROCESSORS)


def finite(value: Any) -> Any:
    """A result.

    Raises:
        DataError: it is a number without a finite value, a whole number beyond 63 bits, or too large.
    """
    if isinstance(value, float) and not -float("inf") < value < float("inf"):
        raise DataError("the number is not finite")
    if isinstance(value, int) and abs(value) > 2**63:
        raise DataError("a whole number has grown beyond 63 bits")
    if isinstance(value, str | list) and len(value) > _LONGEST:
        raise DataError("the value has grown too large")
    return value


def undeclared(env: Environment, name: str) -> bool:
    """Whether a name is neither data nor a constant of the chart."""
    return name not in env.store.values and name not in env.system and name != "_event"


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
    if not isinstance(state, str) or state not in env.states:
        raise DataError(f"there is no state `{state}`")
    return env.states[state] in env.active


def _guarded(function: Callable[..., Any], *arguments: Any) -> Any:
    try:
        return function(*arguments)
    except (TypeError, ValueError, AttributeError, LookupError, OverflowError) as error:
        raise DataError(str(error)) from None


def joined(truth: Callable[[Any], bool], left: Evaluate, right: Evaluate, *, conjunction: bool) -> Evaluate:
    """Both or one of two values: the second is evaluated only where the first does not decide."""

    def both(env: Environment) -> Any:
        first = left(env)
        return right(env) if truth(first) is conjunction else first

    return both


def owned(value: Any, *kinds: type) -> Any:
    """A value of one of some types.

    Raises:
        TypeError: it is another.
    """
    if not isinstance(value, kinds):
        raise TypeError(f"{value!r:.40} has no such method")
    return value
