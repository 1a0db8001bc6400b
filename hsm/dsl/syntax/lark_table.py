"""The grammar as plain data, of what lark has made of its text; imported only where no kept grammar is found.

Lark's parse table is a private part of it. If its structure is not the expected one, ``lark_loop`` reads texts with
lark's own loop. A test compares the trees and errors of both.
"""

from __future__ import annotations

import re
from sys import intern
from typing import Any

from lark import Lark

from hsm.dsl.syntax.parse_table import GrammarRule, PlainGrammar, Row


def grammar_of(lark: Lark) -> PlainGrammar:
    """A grammar that lark has read.

    Raises:
        AttributeError, KeyError, TypeError: lark keeps its table in another way.
    """
    conf = lark.parse_interactive().parser_state.parse_conf
    numbers: dict[Any, int] = {}
    rules: list[GrammarRule] = []
    rows: list[Row] = []
    for number in range(len(conf.states)):
        row: Row = {}
        for name, (action, target) in conf.states[number].items():
            kind = intern(str(name))  # some of lark's names are tokens, which are slow to compare
            if action.name == "Shift":
                row[kind] = target
                continue
            if target not in numbers:
                numbers[target] = len(rules)
                rules.append(_rule(target))
            row[kind] = ~numbers[target]
        rows.append(row)
    pattern, symbols = terminals_of(lark)
    return PlainGrammar(pattern, symbols, tuple(rows), tuple(rules), conf.start_state, conf.end_state)


def _rule(rule: Any) -> GrammarRule:
    """A rule with what lark's own builder of trees would do: which parts it drops and which it takes over as lists."""
    options, parts = rule.options, rule.expansion
    kept = [at for at, one in enumerate(parts) if options.keep_all_tokens or not (one.is_term and one.filter_out)]
    joined = [at for at in kept if not parts[at].is_term and parts[at].name.startswith("_")]
    method = str(rule.alias or options.template_source or rule.origin.name)
    passes = bool(options.expand1) and rule.alias is None
    return GrammarRule(
        len(parts),
        intern(str(rule.origin.name)),
        "" if method.startswith("_") else method,
        tuple(kept),
        tuple(joined),
        passes,
    )


def terminals_of(lark: Lark) -> tuple[str, dict[str, str]]:
    """An expression that matches any terminal, and the names of those that are always the same.

    A character that begins none of them is a terminal of its own.
    """
    formed = {str(one.name): one.pattern.to_regexp() for one in lark.terminals if one.pattern.type == "re"}
    symbols = {str(one.pattern.value): str(one.name) for one in lark.terminals if one.pattern.type == "str"}
    marks = sorted((text for text in symbols if not text.isidentifier()), key=len, reverse=True)
    groups = [f"(?P<{name}>{formed.pop(name)})" for name in ("NAME", "_NL", "NUMBER")]
    groups += [f"(?P<{name}>{text})" for name, text in formed.items() if name.isupper()]
    groups += [f"(?P<_MARK>{'|'.join(map(re.escape, marks))})", r"(?P<UNKNOWN>[^ \n])"]
    return f"[ ]*(?:{'|'.join(groups)})", symbols
