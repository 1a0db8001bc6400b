"""From text to a syntax tree; a line that cannot be read is reported and skipped, and parsing continues."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hsm.dsl.reporting.report import Report
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.ast import depth_of, place_of
from hsm.dsl.syntax.layout import LAYOUT
from hsm.dsl.syntax.lexer import Lexer, Terminals
from hsm.dsl.syntax.parse_table import ParseTable, PlainGrammar, TableParser
from hsm.dsl.syntax.syntax_errors import report_line
from hsm.dsl.syntax.table_cache import kept
from hsm.dsl.syntax.tokens import Token
from hsm.model.chart import StateKind
from hsm.model.diagnostics import Diagnostic, Place
from hsm.model.values import dataclass

if TYPE_CHECKING:
    from lark import Lark

    from hsm.dsl.syntax.lark_loop import LarkParser

_INDENTED = "this is indented under a line that has no block"
_MISFIT = "this indentation matches no block"
_SHIFT = "align it with the lines of its block; only `state` and `parallel` open a block"
_TAB = "a tab cannot be used here"
_CLAIM_WORDS = ("EVENTUALLY", "WITHIN", "BEFORE")
_NAME = re.compile(r"[A-Za-z_][\w.]*")
_NAMELESS = re.compile(r" *(?:state|parallel|final|param|var|event|enum|define|import|expose|member)\b(?! *[A-Za-z_])")
_DECLARES_NOTHING = re.compile(r" *(?:initial|do|entry|exit|on|when|else|after|every|stay|property|assume|defer)\b")


class TreeBuilder:
    """Makes the nodes of the syntax tree; lark calls the method named after each rule with the rule's parts."""

    def file(self, parts: list[Any]) -> tuple[ast.Item, ...]:
        return tuple(parts)

    def machine(self, parts: list[Any]) -> ast.MachineLine:
        return ast.MachineLine(parts[0])

    def import_line(self, parts: list[Any]) -> ast.ImportLine:
        return ast.ImportLine(parts[0])

    def param(self, parts: list[Any]) -> ast.ParameterLine:
        adjustable = parts.pop() if isinstance(parts[-1], ast.AdjustableSyntax) else None
        name, kind, *default = parts
        return ast.ParameterLine(name, kind, default[0] if default else None, adjustable)

    def adjustable(self, parts: list[Any]) -> ast.AdjustableSyntax:
        return ast.AdjustableSyntax(parts[0], tuple(parts[1:-1]))

    def var(self, parts: list[Any]) -> ast.VariableLine:
        return ast.VariableLine(*parts)

    def event(self, parts: list[Any]) -> ast.EventLine:
        return ast.EventLine(tuple(parts))

    def declared_event(self, parts: list[Any]) -> ast.EventSyntax:
        return ast.EventSyntax(parts[0], tuple(parts[1:-1]))

    def field(self, parts: list[Any]) -> ast.FieldSyntax:
        return ast.FieldSyntax(*parts)

    def enum(self, parts: list[Any]) -> ast.EnumerationLine:
        name, _, *values = parts
        return ast.EnumerationLine(name, tuple(values))

    def define(self, parts: list[Any]) -> ast.DefinitionLine:
        name, _, value = parts
        return ast.DefinitionLine(name, value)

    def state(self, parts: list[Any]) -> ast.StateBlock:
        if len(parts) > 1 and isinstance(parts[1], ast.CallSyntax):
            return ast.StateBlock(parts[0], StateKind.ATOMIC, parts[1], tuple(parts[2:]))
        return ast.StateBlock(parts[0], StateKind.ATOMIC, None, tuple(parts[1:]))

    def member(self, parts: list[Any]) -> ast.StateBlock:
        return ast.StateBlock(parts[0], StateKind.ATOMIC, parts[1], tuple(parts[2:]), member=True)

    def expose(self, parts: list[Any]) -> ast.ExposeLine:
        return ast.ExposeLine(tuple(parts))

    def parallel(self, parts: list[Any]) -> ast.StateBlock:
        return ast.StateBlock(parts[0], StateKind.PARALLEL, None, tuple(parts[1:]))

    def final(self, parts: list[Any]) -> ast.FinalLine:
        return ast.FinalLine(parts[0])

    def initial(self, parts: list[Any]) -> ast.InitialLine:
        return ast.InitialLine(parts[0], parts[1].actions if len(parts) > 1 else ())

    def do(self, parts: list[Any]) -> ast.DoLine:
        return ast.DoLine(parts[0])

    def entry(self, parts: list[Any]) -> ast.EntryLine:
        return ast.EntryLine(parts[0].actions)

    def exit(self, parts: list[Any]) -> ast.ExitLine:
        return ast.ExitLine(parts[0].actions)

    def on(self, parts: list[Any]) -> ast.TransitionLine:
        end = 1
        while end < len(parts) and isinstance(parts[end], Token):
            end += 1
        return self._transition(parts[0], tuple(parts[1:end]), None, parts[end:])

    defer = on

    def when(self, parts: list[Any]) -> ast.TransitionLine:
        return self._transition(parts[0], (), parts[1], parts[2:])

    after = when
    every = when

    def else_line(self, parts: list[Any]) -> ast.TransitionLine:
        return self._transition(parts[0], (), None, parts[1:])

    def _transition(
        self, keyword: Token, names: tuple[Token, ...], operand: ast.Expression | None, clauses: list[Any]
    ) -> ast.TransitionLine:
        guard = target = lasting = None
        actions: tuple[ast.ActionSyntax, ...] = ()
        for clause in clauses:
            if isinstance(clause, ast.TargetSyntax):
                target = clause
            elif isinstance(clause, ast.ActionsSyntax):
                actions = clause.actions
            elif isinstance(clause, ast.LastingSyntax):
                lasting = clause.duration
            else:
                guard = clause.condition
        return ast.TransitionLine(keyword, names, operand, lasting, guard, target, actions)

    def stay(self, parts: list[Any]) -> ast.StayLine:
        return ast.StayLine(*parts)

    def property(self, parts: list[Any]) -> ast.PropertyLine:
        return ast.PropertyLine(*self._stated(*parts))

    def assume(self, parts: list[Any]) -> ast.AssumptionLine:
        return ast.AssumptionLine(*self._stated(*parts))

    def _stated(self, name: Token, claim: list[Any]) -> tuple[Any, ...]:
        keyword, *rest = claim
        words = [one.type for one in rest if isinstance(one, Token) and one.type in _CLAIM_WORDS]
        operands = [one for one in rest if not (isinstance(one, Token) and one.type in _CLAIM_WORDS)]
        kind = keyword.value
        if "WITHIN" in words:
            kind = "recurrence" if "EVENTUALLY" in words else "response"
            return name, keyword, kind, tuple(operands[:-1]), operands[-1]
        return name, keyword, "precedence" if words else kind, tuple(operands)

    def claim(self, parts: list[Any]) -> list[Any]:
        return parts

    def guard(self, parts: list[Any]) -> ast.GuardSyntax:
        return ast.GuardSyntax(parts[0])

    def target(self, parts: list[Any]) -> ast.TargetSyntax:
        return ast.TargetSyntax(parts[0], tuple(parts[1:]))

    def actions(self, parts: list[Any]) -> ast.ActionsSyntax:
        return ast.ActionsSyntax(tuple(parts))

    def assign(self, parts: list[Any]) -> ast.AssignSyntax:
        return ast.AssignSyntax(*parts)

    def raise_event(self, parts: list[Any]) -> ast.RaiseSyntax:
        raised, *after = parts
        delay = after[-1] if after else None
        if isinstance(raised, ast.CallSyntax):
            return ast.RaiseSyntax(raised.name, delay, raised)
        return ast.RaiseSyntax(raised, delay)

    def send_event(self, parts: list[Any]) -> ast.SendSyntax:
        sent = parts[0]
        return ast.SendSyntax(sent.name, sent) if isinstance(sent, ast.CallSyntax) else ast.SendSyntax(sent)

    def cancel(self, parts: list[Any]) -> ast.CancelSyntax:
        return ast.CancelSyntax(parts[0])

    def lasting(self, parts: list[Any]) -> ast.LastingSyntax:
        return ast.LastingSyntax(parts[0])

    def disjunction(self, parts: list[Any]) -> ast.ChainSyntax:
        return ast.ChainSyntax("or", tuple(parts), 1 + max(map(depth_of, parts)))

    def conjunction(self, parts: list[Any]) -> ast.ChainSyntax:
        return ast.ChainSyntax("and", tuple(parts), 1 + max(map(depth_of, parts)))

    def binary(self, parts: list[Any]) -> ast.BinarySyntax:
        left, operator, right = parts
        return ast.BinarySyntax(operator, left, right, 1 + max(depth_of(left), depth_of(right)))

    comparison = binary
    undivided = binary
    product = binary

    def negation(self, parts: list[Any]) -> ast.UnarySyntax:
        return ast.UnarySyntax(parts[0], parts[1], 1 + depth_of(parts[1]))

    unary = negation

    def choice(self, parts: list[Any]) -> ast.ChoiceSyntax:
        then, condition, _, otherwise = parts
        return ast.ChoiceSyntax(then, condition, otherwise, 1 + max(map(depth_of, (then, condition, otherwise))))

    def group(self, parts: list[Any]) -> ast.Expression:
        inner: ast.Expression = parts[0]
        return inner

    def call(self, parts: list[Any]) -> ast.CallSyntax:
        arguments = tuple(parts[1:-1])
        return ast.CallSyntax(parts[0], arguments, parts[-1], 1 + max(map(depth_of, arguments), default=0))

    def named(self, parts: list[Any]) -> ast.Named:
        name, _, value = parts
        return ast.Named(name, value, depth_of(value))

    def bad(self, parts: list[Any]) -> ast.BadLine:
        line, *items = parts
        text = line.partition("#")[0] if "\n" not in line else line
        names = frozenset(_NAME.findall(text))
        return ast.BadLine(names, _declared(text, names), tuple(items))


def _declared(text: str, names: frozenset[str]) -> frozenset[str] | None:
    """What a line may declare that cannot be read; None where that may be anything."""
    if not text or _DECLARES_NOTHING.match(text):
        return frozenset()
    return None if _NAMELESS.match(text) or not names else names


@dataclass(frozen=True, slots=True)
class Grammar:
    """The language's grammar, ready to read texts with.

    Attributes:
        terminals: what a token can be.
        begin: begins a parse.
    """

    terminals: Terminals
    begin: Callable[[], TableParser | LarkParser]

    @classmethod
    def of(cls, plain: PlainGrammar) -> Grammar:
        """A grammar that is run by our loop."""
        table = ParseTable.of(plain, TreeBuilder())
        return cls(Terminals(re.compile(plain.pattern), plain.symbols), partial(TableParser, table))

    @classmethod
    def of_lark(cls, lark: Lark) -> Grammar:
        """A grammar that is run by lark's own loop."""
        from hsm.dsl.syntax.lark_loop import LarkParser  # noqa: PLC0415 - lark takes long to import
        from hsm.dsl.syntax.lark_table import terminals_of  # noqa: PLC0415

        pattern, symbols = terminals_of(lark)
        return cls(Terminals(re.compile(pattern), symbols), partial(LarkParser.of, lark))


def read_grammar() -> Lark:
    """The grammar, read by lark."""
    from lark import Lark  # noqa: PLC0415 - only where no analysed grammar is kept

    builder: Any = TreeBuilder()
    return Lark(
        grammar_text(), parser="lalr", start="file", lexer="basic", transformer=builder, maybe_placeholders=False
    )


def analysed() -> PlainGrammar:
    """The grammar as lark analyses it.

    Raises:
        AttributeError, KeyError, TypeError: lark keeps its table in another way.
    """
    from hsm.dsl.syntax.lark_table import grammar_of  # noqa: PLC0415

    return grammar_of(read_grammar())


def grammar_text() -> str:
    """The grammar as it is written."""
    return Path(__file__).with_name("grammar.lark").read_text(encoding="utf-8")


@cache
def _grammar() -> Grammar:
    try:
        return Grammar.of(kept(grammar_text(), analysed))
    except (AttributeError, KeyError, TypeError):
        return Grammar.of_lark(read_grammar())


def parse(text: str, file: str, grammar: Grammar | None = None) -> tuple[ast.File, list[Diagnostic]]:
    """Read a file.

    Args:
        text: what is in it.
        file: its name, for diagnostics.
        grammar: by default the language's, read once.

    Returns:
        The syntax tree, with a ``BadLine`` for each line that could not be read, and the diagnostics.
    """
    report = Report(file)
    text = _without_tabs(text.replace("\r\n", "\n"), report)
    lines = text.split("\n")
    grammar = grammar or _grammar()
    parser, lexer = grammar.begin(), Lexer(grammar.terminals)
    tokens = lexer.tokens(text + "\n")
    for token in tokens:
        if parser.feed(token):
            continue
        if token.type == "_INDENT":
            report.add("E0103", _line_place(file, lines, token.end_line), _INDENTED, _SHIFT)
            for one in (Token("BAD", ""), Token("_NL", ""), token):
                parser.feed(one)
        else:
            line = token.line
            report_line(report, token, parser.expected(), lines[line - 1])
            _skip_line(parser, tokens, token, lines)
    items = parser.finish()
    for end, token in lexer.unclosed.items():
        _forget_between(report, token.line, end)
        report.add("E0104", place_of(file, token), f"`{token}` is never closed", "close it with `)`")
    for token in lexer.misfits:
        report.add("E0105", _line_place(file, lines, token.end_line), _MISFIT, _SHIFT)
    return ast.File(file, items, tuple(lines)), _once_a_line(report.found)


class BlockParser:
    """An incremental parser for a text that is edited; it does not read unchanged parts again.

    A file is a list of items, and each item that begins at the left edge is read separately, since it does not depend
    on those before it. If anything in the text cannot be read, the whole text is read as by ``parse``.
    """

    def __init__(self) -> None:
        self._known: dict[tuple[int, str], tuple[ast.Item, ...]] = {}

    def parse(self, text: str, file: str) -> tuple[ast.File, list[Diagnostic]]:
        """The same result as ``parse``."""
        if "\t" in text:
            return parse(text, file)
        lines = tuple(text.replace("\r\n", "\n").split("\n"))
        known, items = {}, list[ast.Item]()
        for first, last in _blocks(lines):
            key = first, "\n".join(lines[first:last])
            found = self._known.get(key)
            if found is None:
                found = _items(key[1], first + 1)
            if found is None:
                return parse(text, file)
            known[key] = found
            items.extend(found)
        self._known = known
        return ast.File(file, tuple(items), lines), []


def _blocks(lines: Sequence[str]) -> Iterator[tuple[int, int]]:
    """Where lines at the left edge begin and what follows them ends; lines count from 0."""
    begin = 0
    for number, line in enumerate(lines):
        if line and line[0] not in " #" and number > begin:
            yield begin, number
            begin = number
    yield begin, len(lines)


def _items(text: str, first: int) -> tuple[ast.Item, ...] | None:
    """The items of a part of a file; None where something in it cannot be read."""
    grammar = _grammar()
    parser, lexer = grammar.begin(), Lexer(grammar.terminals)
    if not all(parser.feed(token) for token in lexer.tokens(text + "\n", first)):
        return None
    return None if lexer.unclosed or lexer.misfits else parser.finish()


def _once_a_line(found: list[Diagnostic]) -> list[Diagnostic]:
    """Drops diagnostics about the beginning of a line that has another diagnostic."""
    told = {one.place.line for one in found if one.place is not None and one.code not in LAYOUT}
    return [one for one in found if one.code not in LAYOUT or one.place is None or one.place.line not in told]


def _forget_between(report: Report, first: int, last: int) -> None:
    """Drop the diagnostics of lines that could not be read because a bracket on them is not closed."""
    report.found[:] = [
        one for one in report.found if one.code != "E0101" or one.place is None or not first <= one.place.line <= last
    ]


def tokens_of(text: str) -> Iterator[Token]:
    """The tokens of a text, with the beginnings and ends of blocks."""
    return Lexer(_grammar().terminals).tokens(text + "\n")


def _skip_line(parser: TableParser | LarkParser, tokens: Iterator[Token], token: Token, lines: list[str]) -> None:
    """Puts ``BAD`` in place of the line that a token cannot be on, and continues after that line."""
    parser.back_to("BAD")
    first = token.line
    while token.type != "_NL":
        token = next(tokens)
    parser.feed(Token("BAD", "\n".join(lines[first - 1 : token.line])))
    parser.feed(token)


def _without_tabs(text: str, report: Report) -> str:
    """The text with tabs replaced; the first tab outside comments is reported."""
    if "\t" not in text:
        return text
    lines = text.split("\n")
    columns = {number: line.partition("#")[0].find("\t") + 1 for number, line in enumerate(lines, 1)}
    found = [(number, column) for number, column in columns.items() if column]
    if found:
        number, column = found[0]
        place = Place(report.file, number, column, number, column + 1)
        more = len(found) - 1
        message = f"{_TAB}, as in {more} more line{'s' * (more != 1)}" if more else _TAB
        report.add("E0102", place, message, "use four spaces instead")
    return "\n".join(line.replace("\t", "    ") for line in lines)


def _line_place(file: str, lines: list[str], number: int) -> Place:
    line = lines[number - 1].partition("#")[0]
    return Place(file, number, len(line) - len(line.lstrip()) + 1, number, len(line.rstrip()) + 1)
