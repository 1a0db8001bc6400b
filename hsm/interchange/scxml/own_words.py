"""Expressions of a machine in this language, where a chart asks for what SCXML has no word for: signals and actions."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace

from hsm.model.expressions import EventValue, Expression
from hsm.model.rewriting import rewrite_expression
from hsm.model.unparse import expression_text

OWN_DATA_MODEL = "maze-machine"
"""What a chart says whose expressions are in this language: it is for people and other tools, and not read back."""

_IN = re.compile(r"\bin\(([\w.-]+)\)")


class OwnWords:
    """Writes expressions as their author did; active states and what an event carries go by SCXML's names."""

    def condition(self, expressions: Iterable[Expression]) -> str:
        """What holds if all of some conditions do."""
        texts = [self.value(one) for one in expressions]
        return texts[0] if len(texts) == 1 else " and ".join(f"({text})" for text in texts)

    def value(self, expression: Expression) -> str:
        """An expression."""
        return _IN.sub(r"In('\1')", expression_text(renamed(expression)))

    def name(self, variable: str) -> str:
        """What a variable or parameter is called."""
        return variable

    def delay(self, duration: Expression) -> str:
        """A duration."""
        return self.value(duration)


def renamed(expression: Expression) -> Expression:
    """An expression with SCXML's names for what the event carries."""

    def rename(part: Expression) -> Expression:
        name = part.name.rpartition(".")[2] if isinstance(part, EventValue) else ""
        return replace(part, name=f"_event.data.{name}") if isinstance(part, EventValue) else part

    return rewrite_expression(expression, rename)
