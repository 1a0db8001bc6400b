"""The grammar as a table of an LALR(1) parser, and the loop that runs it token by token, so that it can recover.

The table is plain data, as ``lark_table`` makes it of what lark has analysed and ``table_cache`` keeps it. We use our
own loop because lark's took a third of the time from text to machine, and the import of lark alone takes a tenth of the
time of a short command.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from typing import Any, NamedTuple, TypeAlias

from hsm.model.values import dataclass

Row: TypeAlias = dict[str, int]
"""For each kind of token, and each rule that has just ended, the state to go to; or ``~n`` if rule ``n`` ends here."""


class GrammarRule(NamedTuple):
    """A rule of the grammar, one of its alternatives.

    Attributes:
        size: the number of its parts.
        name: what it is a case of.
        method: the method of the builder that makes one value of its parts; empty for a part of another rule's list.
        kept: which of its parts count.
        joined: which of those are lists of parts themselves, to be taken over one by one.
        passes: whether a single part passes as it is.
    """

    size: int
    name: str
    method: str
    kept: tuple[int, ...]
    joined: tuple[int, ...]
    passes: bool


class PlainGrammar(NamedTuple):
    """A grammar as plain data.

    Attributes:
        pattern: a regular expression that matches any token, with the blanks before it.
        symbols: the kind of each token that is always the same.
        rows: for each state, what to do.
        rules: the rules, by their numbers.
        start: the state to begin in.
        end: the state of a whole text.
    """

    pattern: str
    symbols: dict[str, str]
    rows: tuple[Row, ...]
    rules: tuple[GrammarRule, ...]
    start: int
    end: int


Reduction: TypeAlias = tuple[int, str, Callable[[list[Any]], Any] | None]
"""What ends a rule: the number of its parts, its name, and what makes one value of them; None if the one part is it."""


@dataclass(frozen=True, slots=True)
class ParseTable:
    """A parse table with the functions that build the values of rules."""

    rows: Sequence[Row]
    reductions: Sequence[Reduction]
    start: int
    end: int

    @classmethod
    def of(cls, grammar: PlainGrammar, builder: object) -> ParseTable:
        """The table of a grammar.

        Args:
            grammar: the grammar.
            builder: has the methods that the rules name.
        """
        reductions = [(one.size, one.name, _build(one, builder)) for one in grammar.rules]
        return cls(grammar.rows, reductions, grammar.start, grammar.end)


def _build(rule: GrammarRule, builder: object) -> Callable[[list[Any]], Any] | None:
    size, _, method, kept, joined, passes = rule
    if passes and size == 1 and kept == (0,) and not joined:
        return None
    make: Callable[[list[Any]], Any] = getattr(builder, method) if method else list
    if passes:
        make = _passing(make)
    return _chosen(make, kept, frozenset(joined)) if len(kept) < size or joined else make


def _passing(make: Callable[[list[Any]], Any]) -> Callable[[list[Any]], Any]:
    return lambda parts: parts[0] if len(parts) == 1 else make(parts)


def _chosen(
    make: Callable[[list[Any]], Any], kept: Sequence[int], joined: frozenset[int]
) -> Callable[[list[Any]], Any]:
    """What makes a value of the parts that count."""
    if not joined:
        return lambda parts: make([parts[one] for one in kept])
    first, *rest = kept

    def build(parts: list[Any]) -> Any:
        # A list that comes first is only ever used here: a long list of lines grows in place.
        chosen = parts[first] if first in joined else [parts[first]]
        for one in rest:
            if one in joined:
                chosen += parts[one]
            else:
                chosen.append(parts[one])
        return make(chosen)

    return build


@dataclass(slots=True)
class TableParser:
    """A parse in progress."""

    table: ParseTable
    states: list[int] = field(default_factory=list)
    values: list[Any] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.states.append(self.table.start)

    def feed(self, token: Any) -> bool:
        """Take a token; if it does not fit, return False and leave the parse unchanged except for reductions."""
        rows, states = self.table.rows, self.states
        kind = token.type
        while (action := rows[states[-1]].get(kind)) is not None:
            if action >= 0:
                states.append(action)
                self.values.append(token)
                return True
            self._reduce(~action)
        return False

    def _reduce(self, number: int) -> None:
        size, rule, build = self.table.reductions[number]
        states, values = self.states, self.values
        if build is None:
            states[-1] = self.table.rows[states[-2]][rule]
            return
        if size:
            parts = values[-size:]
            del states[-size:]
            del values[-size:]
        else:
            parts = []
        values.append(build(parts))
        states.append(self.table.rows[states[-1]][rule])

    def finish(self) -> Any:
        """The value of the whole text."""
        while self.states[-1] != self.table.end:
            self._reduce(~self.table.rows[self.states[-1]]["$END"])
        return self.values[-1]

    def expected(self) -> frozenset[str]:
        """The kinds of token that could come next."""
        return frozenset(kind for kind in self.table.rows[self.states[-1]] if kind.isupper() and self._accepts(kind))

    def _accepts(self, kind: str) -> bool:
        """Whether a kind of token can come next; the table by itself also allows tokens that follow elsewhere."""
        rows, states = self.table.rows, list(self.states)
        while True:
            action = rows[states[-1]].get(kind)
            if action is None or action >= 0:
                return action is not None
            size, rule, _ = self.table.reductions[~action]
            if size:
                del states[-size:]
            states.append(rows[states[-1]][rule])

    def back_to(self, kind: str) -> None:
        """Drop the latest tokens until a token of a kind fits."""
        while kind not in self.table.rows[self.states[-1]]:
            self.states.pop()
            self.values.pop()
