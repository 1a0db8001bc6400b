"""Lark's own parser loop with the interface of ``parse_table.TableParser``: slower, but independent of lark's table."""

from __future__ import annotations

from typing import Any

from lark import Lark
from lark.exceptions import UnexpectedToken
from lark.parsers.lalr_interactive_parser import InteractiveParser

from hsm.dsl.syntax.tokens import Token
from hsm.model.values import dataclass


@dataclass(slots=True)
class LarkParser:
    """A parse in progress."""

    parser: InteractiveParser

    @classmethod
    def of(cls, lark: Lark) -> LarkParser:
        """The beginning of a parse."""
        return cls(lark.parse_interactive())

    def feed(self, token: Token) -> bool:
        """Take a token; if it does not fit, return False and leave the parse unchanged except for reductions."""
        try:
            self.parser.feed_token(token)  # type: ignore[arg-type]  # of a token it uses the type alone
        except UnexpectedToken:
            return False
        return True

    def finish(self) -> Any:
        """The value of the whole text."""
        return self.parser.feed_eof()

    def expected(self) -> frozenset[str]:
        """The kinds of token that could come next."""
        return frozenset(self.parser.accepts())

    def back_to(self, kind: str) -> None:
        """Drop the latest tokens until a token of a kind fits."""
        while kind not in self.parser.choices():
            self.parser.parser_state.state_stack.pop()
            self.parser.parser_state.value_stack.pop()
