"""Lark's parse table, run by our own loop: token by token, so that a parse can recover from errors.

We use our own loop because lark's took a third of the time from text to machine: it looks up by rule what this one has
in the table. The table is a private part of lark: if its structure is not the expected one, ``lark_loop`` does the same
with lark's own loop. A test compares the trees and errors of both.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from sys import intern
from typing import Any, NamedTuple, TypeAlias

from lark import Lark, Token

from hsm.model.values import dataclass


class Reduction(NamedTuple):
    """What ends a rule.

    Attributes:
        size: the number of its parts.
        rule: its name.
        build: makes one value of its parts; None if the single part is the value.
    """

    size: int
    rule: str
    build: Callable[[list[Any]], Any] | None


TableRow: TypeAlias = dict[str, int | Reduction]


@dataclass(frozen=True, slots=True)
class ParseTable:
    """A parse table.

    Attributes:
        rows: for each state, what to do at each kind of token: the number of the state to go to, or a reduction.
        start: the state to begin in.
        end: the state of a whole text.
    """

    rows: tuple[TableRow, ...]
    start: int
    end: int

    @classmethod
    def of(cls, lark: Lark) -> ParseTable:
        """The table of a grammar.

        Raises:
            AttributeError, KeyError, TypeError: lark keeps its table in another way.
        """
        conf = lark.parse_interactive().parser_state.parse_conf
        rows: list[TableRow] = []
        for number in range(len(conf.states)):
            row: TableRow = {}
            for name, (action, target) in conf.states[number].items():
                kind = intern(str(name))  # some of lark's names are tokens, which are slow to compare
                if action.name == "Shift":
                    row[kind] = target
                    continue
                size = len(target.expansion)
                renames = target.options.expand1 and size == 1 and target.alias is None
                row[kind] = Reduction(
                    size, intern(str(target.origin.name)), None if renames else conf.callbacks[target]
                )
            rows.append(row)
        return cls(tuple(rows), conf.start_state, conf.end_state)


@dataclass(slots=True)
class TableParser:
    """A parse in progress."""

    table: ParseTable
    states: list[int] = field(default_factory=list)
    values: list[Any] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.states.append(self.table.start)

    def feed(self, token: Token) -> bool:
        """Take a token; if it does not fit, return False and leave the parse unchanged except for reductions."""
        rows, states = self.table.rows, self.states
        kind = token.type
        while (action := rows[states[-1]].get(kind)) is not None:
            if isinstance(action, int):
                states.append(action)
                self.values.append(token)
                return True
            self._reduce(action)
        return False

    def _reduce(self, reduction: Reduction) -> None:
        size, rule, build = reduction
        states, values = self.states, self.values
        if build is None:
            states[-1] = self.table.rows[states[-2]][rule]  # type: ignore[assignment]
            return
        if size:
            parts = values[-size:]
            del states[-size:]
            del values[-size:]
        else:
            parts = []
        values.append(build(parts))
        states.append(self.table.rows[states[-1]][rule])  # type: ignore[arg-type]

    def finish(self) -> Any:
        """The value of the whole text."""
        while self.states[-1] != self.table.end:
            action = self.table.rows[self.states[-1]]["$END"]
            assert not isinstance(action, int)
            self._reduce(action)
        return self.values[-1]

    def expected(self) -> frozenset[str]:
        """The kinds of token that could come next."""
        return frozenset(kind for kind in self.table.rows[self.states[-1]] if kind.isupper() and self._accepts(kind))

    def _accepts(self, kind: str) -> bool:
        """Whether a kind of token can come next; the table by itself also allows tokens that follow elsewhere."""
        rows, states = self.table.rows, list(self.states)
        while True:
            action = rows[states[-1]].get(kind)
            if action is None or isinstance(action, int):
                return action is not None
            size, rule, _ = action
            if size:
                del states[-size:]
            states.append(rows[states[-1]][rule])  # type: ignore[arg-type]

    def back_to(self, kind: str) -> None:
        """Drop the latest tokens until a token of a kind fits."""
        while kind not in self.table.rows[self.states[-1]]:
            self.states.pop()
            self.values.pop()
