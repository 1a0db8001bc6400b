"""Random programs that use every rule of the grammar, random edits of them, and what our own parser says of a text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from random import Random

from hsm.dsl.syntax.lexer import STATEMENTS
from hsm.dsl.syntax.parser import parse

_CLAIM_WORDS = ("after", "always", "before", "eventually", "never")
_NAMES = (
    "a",
    "b2",
    "exit",
    "event",
    "on",
    "state",
    "cancel",
    "within",
    "order",
    "x.y",
    "robot.speed",
    "for_",
    "h",
    *_CLAIM_WORDS,
)
_NUMBERS = ("0", "1.5", "90 deg", "20cm", "0.5 m/s", "1e3", "2e-3 s", "4 m/s^2", "3 order", "1e", "2 orders", "7 e")
_COMPARISONS = ("==", "!=", "<=", ">=", "<", ">")
_ASSIGNMENTS = ("=", "+=", "-=", "*=")
_WIDTHS = (1, 2, 3, 4, 4, 4, 8)
_MARKS = (
    "(",
    ")",
    ",",
    "=",
    "->",
    "/",
    "#",
    "\n",
    "    ",
    " ",
    "and",
    "if",
    "5 m",
    ":",
    "\t",
    "not",
    "$",
    "\r\n",
    "when",
)


@dataclass
class _Writer:
    """Writes one program, laid out carelessly."""

    draw: Random
    names: tuple[str, ...] = _NAMES

    def one(self, *choices: str) -> str:
        return self.draw.choice(choices)

    def chance(self, share: float) -> bool:
        return self.draw.random() < share

    def gap(self) -> str:
        """Blanks that may be left out."""
        return self.draw.choice(("", " ", " ", "  "))

    def name(self) -> str:
        return self.draw.choice(self.names)

    def listed(self, write: Callable[[], str], most: int = 3) -> str:
        return f"{self.gap()},{self.gap()}".join(write() for _ in range(self.draw.randint(1, most)))

    def broken(self, text: str) -> str:
        """A text within brackets, on a line of its own if it does not begin like a statement."""
        if self.chance(0.9) or text.startswith(tuple(STATEMENTS)):
            return f"{self.gap()}{text}{self.gap()}"
        begin = self.one("\n", "  # why\n", "\n\n    # why\n") + " " * self.draw.randint(0, 9)
        return f"{begin}{text}{self.one(' ', ' # so', '')}\n"

    def expression(self, depth: int = 0, *, divided: bool) -> str:
        if depth > 3 or self.chance(0.35):
            return self.draw.choice((self.name, lambda: self.draw.choice(_NUMBERS), self.name))()
        below = depth + 1
        if divided and self.chance(0.05):
            inner = [self.operand(depth + 1, divided=True) for _ in range(3)]
            return f"({inner[0]} if {inner[1]}{self.one(' ', chr(10) + '   ')}else {inner[2]})"
        kind = self.draw.randrange(9)
        first = self.operand(below, divided=divided)
        if kind == 0:
            return self.call(below)
        if kind == 1:
            return f"({self.broken(self.expression(below, divided=True))})"
        if kind == 2:
            return f"-{first}"
        if kind == 3:
            return f"not {first}"
        second = self.operand(below, divided=divided)
        if kind == 4:
            return f"{first}{self.gap()}{self.draw.choice(_COMPARISONS)}{self.gap()}{second}"
        if kind == 5:
            return f"{first} {self.one('and', 'or')} {second}"
        if kind == 6 and divided:
            return f"{first} / {second}"
        return f"{first}{self.gap()}{self.one('+', '-', '*')} {second}"

    def operand(self, depth: int, *, divided: bool) -> str:
        """What may stand beside any operator."""
        if self.chance(0.6):
            return self.draw.choice((self.name, lambda: self.draw.choice(_NUMBERS), lambda: self.call(depth)))()
        return f"({self.expression(depth, divided=True)})"

    def call(self, depth: int = 0) -> str:
        if self.chance(0.2):
            return f"{self.name()}{self.gap()}({self.gap()})"
        return f"{self.name()}{self.gap()}({self.broken(self.listed(lambda: self.argument(depth + 1)))})"

    def argument(self, depth: int) -> str:
        value = self.expression(depth + 1, divided=True)
        return f"{self.name()}{self.gap()}={self.gap()}{value}" if self.chance(0.4) else value

    def condition(self) -> str:
        return self.expression(divided=False)

    def duration(self) -> str:
        return self.one("5 s", "patience", "(near / 0.5 m/s)", "2 * dwell", "1 s + 2 s")

    def action(self) -> str:
        kind = self.draw.randrange(6)
        if kind == 5:
            return f"send {self.draw.choice((self.name, lambda: self.call(2)))()}"
        if kind == 0:
            return f"raise {self.draw.choice((self.name, lambda: self.call(2)))()}" + (
                f" after {self.duration()}" if self.chance(0.4) else ""
            )
        if kind == 1:
            return f"cancel {self.name()}"
        if kind == 2:
            return self.call(2)
        return (
            f"{self.name()}{self.gap()}{self.draw.choice(_ASSIGNMENTS)}{self.gap()}{self.expression(2, divided=True)}"
        )

    def actions(self) -> str:
        return f"/ {self.listed(self.action)}"

    def clauses(self, *, guarded: bool = True) -> str:
        text = f" if {self.condition()}" if guarded and self.chance(0.3) else ""
        if self.chance(0.7):
            text += f" {self.one('->', '=>')}{self.gap()}{self.listed(self.name, 2)}"
        return f"{text} {self.actions()}" if self.chance(0.3) else text

    def claim(self) -> str:
        self.names = tuple(name for name in _NAMES if name != "within")
        first, second = self.operand(2, divided=False), self.operand(2, divided=False)
        self.names = _NAMES
        return self.one(
            f"never {first}", f"always {first}", f"always eventually {first} within 5 s",
            f"after {first}, {second} within {self.duration()}", f"after {first}, {second} before {first}",
        )  # fmt: skip

    def declared_event(self) -> str:
        fields = f"({self.listed(lambda: f'{self.name()} : {self.name()}')})"
        return f"{self.name()}{fields if self.chance(0.3) else ''}"

    def adjustable(self) -> str:
        bounds = f"({self.expression(1, divided=True)},{self.gap()}{self.expression(1, divided=True)})"
        return f"{self.gap()},{self.gap()}adjustable{bounds if self.chance(0.5) else ''}"

    def declaration(self) -> str:
        value = f"{self.gap()}={self.gap()}{self.expression(2, divided=True)}"
        kind = self.name()
        return self.draw.choice(
            (
                lambda: f"machine {self.name()}",
                lambda: f"import {self.name()}",
                lambda: (
                    f"param {self.name()}{self.gap()}:{self.gap()}{kind}{value if self.chance(0.5) else ''}"
                    f"{self.adjustable() if self.chance(0.3) else ''}"
                ),
                lambda: f"var {self.name()} : {kind}{value}",
                lambda: f"event {self.listed(self.declared_event)}",
                lambda: f"expose {self.listed(self.name)}",
                lambda: f"enum {self.name()} = {self.listed(self.name)}",
                lambda: f"define {self.name()}{value}",
                lambda: f"property p : {self.claim()}",
                lambda: f"final {self.name()}",
            )
        )()

    def transition(self) -> str:
        return self.draw.choice(
            (
                lambda: f"on {self.listed(lambda: self.one('*', 'done', self.name()))}{self.clauses()}",
                lambda: f"when {self.condition()}{' for 0.5 s' * self.chance(0.2)}{self.clauses()}",
                lambda: f"else{self.clauses(guarded=False)}",
                lambda: f"after {self.duration()}{self.clauses()}",
                lambda: f"every {self.duration()}{self.clauses()}",
                lambda: f"defer {self.listed(lambda: self.one('*', 'done', self.name()))}",
                lambda: "stay" + (f" when {self.condition()}" if self.chance(0.5) else ""),
                lambda: f"do {self.call()}",
                lambda: f"entry {self.actions()}",
                lambda: f"exit {self.actions()}",
                lambda: f"initial {self.name()}" + (f" {self.actions()}" if self.chance(0.3) else ""),
            )
        )()

    def block(self, lines: list[str], width: int, depth: int) -> None:
        for _ in range(self.draw.randint(1, 4)):
            while self.chance(0.2):
                lines.append(self.one("", " " * self.draw.randint(0, 9) + "# a remark"))
            pad, tail = " " * width, self.one("", "", "", "  # a remark", " #", " ")
            if depth < 5 and self.chance(0.4):
                instance = self.chance(0.2)
                keyword = self.one("state", "state", "member") if instance else self.one("state", "parallel")
                lines.append(f"{pad}{keyword} {self.name()}{f' = {self.call()}' if instance else ''}{tail}")
                if self.chance(0.8):
                    self.block(lines, width + self.draw.choice(_WIDTHS), depth + 1)
            else:
                lines.append(f"{pad}{self.declaration() if self.chance(0.3) else self.transition()}{tail}")


def random_program(draw: Random) -> str:
    """A program that the parser accepts."""
    writer = _Writer(draw)
    lines: list[str] = []
    writer.block(lines, 0, 0)
    text = "\n".join(lines) + draw.choice(("", "\n", "\n\n  "))
    return text.replace("\n", "\r\n") if draw.random() < 0.1 else text


def random_edit(draw: Random, text: str) -> tuple[int, int, str]:
    """A stretch of a text and what replaces it: something removed, repeated, or typed."""
    begin = draw.randrange(len(text) + 1)
    end = min(len(text), begin + draw.choice((0, 0, 1, 1, 2, 5, 30)))
    other = draw.randrange(len(text) + 1)
    written = draw.choice(("", "", draw.choice(_MARKS), draw.choice(_NAMES), text[other : other + draw.randrange(20)]))
    return begin, end, written


def syntax_errors(text: str) -> list[str]:
    """The codes that our parser gives to what it cannot read."""
    return [one.code for one in parse(text, "random")[1]]
