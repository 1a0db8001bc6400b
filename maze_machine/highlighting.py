"""Pygments lexers for machines and their tests: for sites, notebooks, terminals."""

from __future__ import annotations

from typing import ClassVar

from pygments.lexer import RegexLexer, bygroups, words
from pygments.token import Comment, Keyword, Name, Number, Operator, Punctuation, Text

_NAME = r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*"
_UNIT = r"(?:[ ]*(?!(?:and|or|if|else|within|before|for)\b)[A-Za-z]+(?:/[A-Za-z]{1,3}\b(?:\^\d+)?)?)?"
_BLOCKS = ("state", "member", "parallel", "final")
_STATEMENTS = (
    *("machine", "import", "param", "var", "event", "define", "enum", "initial"),
    *("do", "entry", "exit", "on", "when", "after", "every", "else", "defer", "expose", "stay", "property", "assume"),
)
_TEST_STATEMENTS = ("test", "scenario", "given", "when", "after", "expect", "tick", "property", "covers")
_WORDS = (
    "and",
    "or",
    "not",
    "if",
    "else",
    "raise",
    "cancel",
    "send",
    "never",
    "always",
    "eventually",
    "within",
    "before",
    "for",
    "reports",
    "doing",
    "called",
    "raised",
    "sent",
)


class _MachineText(RegexLexer):
    """The common part of both lexers."""

    tokens: ClassVar = {
        "expression": [
            (r"#.*$", Comment.Single),
            (r"(->|=>)(\s*)(" + _NAME + ")", bygroups(Operator, Text, Name.Class)),
            (words(_WORDS, prefix=r"\b", suffix=r"\b"), Keyword),
            # Names elsewhere: `raise late after 1 s`, `stay when near`, a claim that begins with `after`.
            (r"\b(?:after|when)\b(?=[ \t]+(?!(?:and|or|if)\b)[\w(])", Keyword),
            (words(("true", "false"), prefix=r"\b", suffix=r"\b"), Keyword.Constant),
            (r"\d+(?:\.\d+)?(?:[eE][+-]?\d+)?" + _UNIT, Number),
            (rf"({_NAME})(\s*)(\()", bygroups(Name.Function, Text, Punctuation)),
            (_NAME, Name),
            (r"[-+*/<>=!]=?", Operator),
            (r"[(),:]", Punctuation),
            (r"\n", Text),
            (r"[^\S\n]+", Text),
            (r".", Text),
        ],
    }


class MachineLexer(_MachineText):
    """A lexer for ``.maze-machine`` files."""

    name = "maze-machine"
    aliases: ClassVar = ["maze-machine", "mazemachine"]
    filenames: ClassVar = ["*.maze-machine"]
    url = ""
    tokens: ClassVar = {
        "root": [
            (rf"^([ \t]*)({'|'.join(_BLOCKS)})(\s+)({_NAME})", bygroups(Text, Keyword.Declaration, Text, Name.Class)),
            (rf"^([ \t]*)(initial)(\s+)({_NAME})", bygroups(Text, Keyword, Text, Name.Class)),
            (rf"^([ \t]*)(param|var)(\s+)({_NAME})(\s*)(:)(\s*)({_NAME})",
             bygroups(Text, Keyword.Declaration, Text, Name.Variable, Text, Punctuation, Text, Keyword.Type)),
            (r"(,)([ \t]*)(adjustable)(?=[ \t]*(?:\(|#|$))", bygroups(Punctuation, Text, Keyword.Declaration)),
            (rf"^([ \t]*)({'|'.join(_STATEMENTS)})\b", bygroups(Text, Keyword)),
            *_MachineText.tokens["expression"],
        ],
    }  # fmt: skip


class ScenarioLexer(_MachineText):
    """A lexer for ``.maze-test`` files."""

    name = "maze-test"
    aliases: ClassVar = ["maze-test", "mazetest"]
    filenames: ClassVar = ["*.maze-test"]
    url = ""
    tokens: ClassVar = {
        "root": [
            (r"^(scenario|requirement)(\s+)([^#\n]*)", bygroups(Keyword.Declaration, Text, Name.Label)),
            (r"^(property)([ \t]+)(" + _NAME + r")([ \t]+)(covers)\b", bygroups(Keyword, Text, Name, Text, Keyword)),
            (rf"^([ \t]*)({'|'.join(_TEST_STATEMENTS)})\b", bygroups(Text, Keyword)),
            *_MachineText.tokens["expression"],
        ],
    }
