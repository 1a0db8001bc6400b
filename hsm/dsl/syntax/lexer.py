"""From text to tokens: the grammar's terminals, matched by one expression, and blocks from indentation.

The words that begin lines are keywords only there, so a state may be called ``exit`` or ``event``. A line
within brackets continues the previous one, unless it begins like a statement: then the bracket was never closed. With
``else`` begins a statement if an arrow, a slash or nothing follows.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import field

from hsm.dsl.syntax.tokens import Token
from hsm.model.values import dataclass

STATEMENTS = frozenset(
    {
        *("machine", "import", "param", "var", "event", "state", "parallel", "final", "initial"),
        *("do", "entry", "exit", "on", "when", "else", "after", "every", "stay", "property", "enum", "define"),
        *("assume", "defer", "expose", "member"),
    }
)
"""The words that a line may begin with."""

RESERVED = frozenset({"and", "if", "not", "or", "raise"})
"""The words that are keywords anywhere after the beginning of a line."""

_ACTIONS = frozenset({"cancel", "send"})

IN_PLACE = frozenset(
    {
        *_ACTIONS,
        *("adjustable", "after", "always", "before", "else", "eventually", "for", "never", "when", "within"),
    }
)
"""Words that are keywords only where no name fits."""

_CLAIMING = frozenset({"assume", "property"})
"""The beginnings of lines with a claim."""

_ACTING = frozenset({"on", "when", "else", "after", "every", "entry", "exit", "initial"})
"""The beginnings of lines with actions, for which a slash outside brackets is the beginning of these."""

_DEEPER = {"LPAR": 1, "RPAR": -1}
_BEFORE_ACTIONS = frozenset({"SLASH", "COMMA"})

_ENDS = frozenset({"NAME", "NUMBER", "RPAR"})
"""The tokens that an expression can end with."""

_FOLLOWED = re.compile(r" +[A-Za-z_]")
_LINE = re.compile(r" *(?:[-=]>|[/#\n])")
"""What follows an ``else`` that is not within an expression."""

_new = str.__new__


@dataclass(frozen=True, slots=True)
class Terminals:
    """The terminals of a grammar; shared by concurrent readers.

    Attributes:
        pattern: matches any token, with the blanks before it.
        symbols: the kind of each token that is always the same.
    """

    pattern: re.Pattern[str]
    symbols: Mapping[str, str]


@dataclass(slots=True)
class Lexer:
    """Reads the tokens of one text.

    Attributes:
        terminals: what a token can be.
        unclosed: brackets that are never closed, by the line where the lexer notices it.
        misfits: ends of lines after which the indentation fits no block; only the first of consecutive equal ones.
    """

    terminals: Terminals
    unclosed: dict[int, Token] = field(default_factory=dict)
    misfits: list[Token] = field(default_factory=list)
    _misfit: int = -1
    _opener: Token | None = None

    def tokens(self, text: str, first: int = 1) -> Iterator[Token]:
        """All tokens of a text that ends with a line break, with where blocks begin and end; called once.

        Args:
            text: the text.
            first: the number of its first line.
        """
        levels = [0]
        opened: list[Token] = []
        held: Token | None = None
        end = _token("_NL", "\n", first, 1)
        for token in self._words(text, first):
            kind = token.type
            if kind == "_NL":
                if opened:
                    held = held or token
                    continue
                end = token
                yield token
                yield from self._indentation(token, levels)
                continue
            if held is not None:
                if token is self._opener:
                    yield from self._give_up(opened, held, levels)
                held = None
            if kind == "LPAR":
                opened.append(token)
            elif kind == "RPAR" and opened:
                opened.pop()
            yield token
        if held is not None:
            yield from self._give_up(opened, held, levels)
        for _ in levels[1:]:
            yield _block_token("_DEDENT", end)

    def _words(self, text: str, first: int) -> Iterator[Token]:
        """The tokens of a text; trailing white space is not a line of its own."""
        symbols = self.terminals.symbols
        line, line_start = first, 0
        opening = ""
        depth = 0  # open brackets
        acting = False  # whether the actions of the line have begun
        earlier, previous = "_NL", "_NL"  # the first line begins as if after a line break
        for match in self.terminals.pattern.finditer(text):
            kind = match.lastgroup or "UNKNOWN"
            start, end = match.span(kind)
            word = text[start:end]
            token = _token(kind, word, line, start - line_start + 1)
            if kind == "NAME":
                if (
                    previous == "_NL"
                    and word in STATEMENTS
                    and not (depth and word == "else" and _LINE.match(text, end) is None)
                ):
                    opening, depth, acting = word, 0, False
                    self._opener = token
                    token.type = kind = word.upper()
                elif word in RESERVED:
                    token.type = kind = word.upper()
                elif word in _ACTIONS:
                    if acting and not depth and previous in _BEFORE_ACTIONS and _FOLLOWED.match(text, end):
                        token.type = kind = word.upper()
                elif word in IN_PLACE and _in_place(word, opening, depth, earlier, previous):
                    token.type = kind = word.upper()
            elif kind == "_NL":
                if end == len(text):
                    token = _token(kind, "\n", line, token.column)
                line += word.count("\n")
                line_start = start + word.rindex("\n") + 1
                token.end_line = line
            elif kind == "_MARK":
                token.type = kind = symbols[word]
                depth = max(0, depth + _DEEPER.get(kind, 0))
                acting = acting or (kind == "SLASH" and not depth and opening in _ACTING)
            earlier, previous = previous, kind
            yield token

    def _give_up(self, opened: list[Token], end: Token, levels: list[int]) -> Iterator[Token]:
        """End a line even though a bracket is open."""
        self.unclosed[end.line] = opened[0]
        opened.clear()
        yield end
        yield from self._indentation(end, levels)

    def _indentation(self, newline: Token, levels: list[int]) -> Iterator[Token]:
        """The beginning of a block or the ends of blocks, according to the spaces after a line break.

        A line whose indentation fits no block belongs to the nearest one.
        """
        width = len(newline.value) - newline.value.rindex("\n") - 1
        if width > levels[-1]:
            levels.append(width)
            yield _block_token("_INDENT", newline)
        elif width not in levels:
            if width != self._misfit:
                self.misfits.append(newline)
            self._misfit = width
            width = min(reversed(levels), key=lambda level: abs(level - width))
        elif width < self._misfit:
            self._misfit = -1
        while width < levels[-1]:
            levels.pop()
            yield _block_token("_DEDENT", newline)


def _token(kind: str, word: str, line: int, column: int) -> Token:
    """A token on one line; the constructor takes twice as long."""
    token = _new(Token, word)
    token.type = kind
    token.value = word
    token.line = token.end_line = line
    token.column = column
    token.end_column = column + len(word)
    return token


def _block_token(kind: str, newline: Token) -> Token:
    """The beginning or the end of a block, where the line before it ends."""
    token = _token(kind, "", newline.line, newline.column)
    token.end_line = newline.end_line
    return token


def _in_place(word: str, opening: str, depth: int, earlier: str, previous: str) -> bool:
    """Whether a word is a keyword where it is.

    Args:
        word: one of ``IN_PLACE``, but none that begins an action.
        opening: the word that the line begins with.
        depth: how many brackets are open.
        earlier: the kind of the last token but one.
        previous: the kind of the last token.
    """
    match word:
        case "adjustable":
            return opening == "param" and not depth and previous == "COMMA"
        case "else":
            return previous in _ENDS or previous == "_NL"
        case "after" if opening not in _CLAIMING:
            return (earlier == "RAISE" and previous == "NAME") or previous == "RPAR"
        case "for":
            return opening == "when" and not depth and previous in _ENDS
        case "when":
            return previous == "STAY"
        case "eventually":
            return previous == "ALWAYS"
        case "before" | "within":
            return opening in _CLAIMING and not depth and previous in _ENDS
        case _:  # what a claim begins with
            return opening in _CLAIMING and previous == "COLON"
