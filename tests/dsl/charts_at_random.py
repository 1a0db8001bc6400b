"""Machines drawn at random, with every kind of state and trigger, and a library whose parts can fail."""

from __future__ import annotations

from random import Random

from hsm.model.registry import Library, Outcome

EVENTS = ("e", "f", "g")
DATA = (
    "enum Kind = low, high",
    "event h(number : int, kind : Kind)",
    "var kind : Kind = low",
    "define odd = m == 1 and not (kind == high)",
)
"""Declarations of an event with data, an enumeration and a named condition."""

PART = """machine part
expose laps
event e
param limit : int = 1
var laps : int = 0
initial p0
state p0
    entry / laps += 1, note(700)
    exit / note(701)
    on e if laps > limit -> over
    on e                 -> p1 / note(702)
    when flag(2)         -> p1
state p1
    after 0.2 s -> p0 / fragile(703)
    on e        => p0
final over
"""
"""A machine of which others have instances."""


def make_library(done: list[int]) -> Library:
    """A library whose facts are a set: of numbers, for what is true, and of pairs, for what fails or is reported.

    Args:
        done: the numbers of the actions that were run, failing ones included.
    """
    library = Library("random")

    @library.signal("flag")
    def flag(facts: object, number: int = 0) -> bool:
        """Whether a number is among the facts."""
        if ("broken flag", number) in facts:
            raise OSError(number)
        return number in facts

    @library.action("note")
    def note(facts: object, number: int) -> None:
        """Note that it was run."""
        done.append(number)

    @library.action("fragile")
    def fragile(facts: object, number: int) -> None:
        """Note that it was run, and perhaps fail."""
        done.append(number)
        if ("broken action", number % 5) in facts:
            raise OSError(number)

    @library.activity("work", outcomes=("ready", "stuck"))
    class Work:
        """Report what the facts say."""

        def __init__(self, number: int) -> None:
            self.number = number

        def tick(self, facts: object) -> object:
            if ("broken activity", self.number % 7) in facts:
                raise OSError(self.number)
            for name in ("ready", "stuck"):
                if (name, self.number % 7) in facts:
                    return Outcome(name)
            return None

    return library


class _Chart:
    """Writes one machine."""

    def __init__(self, draw: Random, *, instances: bool, data: bool) -> None:
        self.draw = draw
        self.lines: list[str] = []
        self.states: list[str] = []
        self.groups: list[str] = []
        self.finals: dict[str, list[str]] = {}
        self.around: list[str] = []
        self.number = 0
        self.instances = instances
        self.data = data
        self.slots: list[tuple[int, int, str, str]] = []

    def chance(self, share: float) -> bool:
        return self.draw.random() < share

    def next(self) -> int:
        self.number += 1
        return self.number

    def text(self) -> str:
        self.children(0, parallel=False)
        body = self.lines
        head = ["machine chart", ""] + ["import part", ""] * self.instances
        head += ["event e, f, g", "var n : int = 0", "var m : int = 0", ""]
        head += [*DATA, "entry / raise g after 0.3 s, raise h(1, high) after 0.3 s", ""] * self.data
        self.lines = []
        if self.chance(0.5):
            self.transitions(0, "top", "")
        parts = [*head, *self.lines]
        # Transitions may name every state: they are written when all are known.
        at = 0
        for end, indent, kind, name in self.slots:
            parts += body[at:end]
            self.lines, at = [], end
            self.transitions(indent, kind, name)
            parts += self.lines
        return "\n".join([*parts, *body[at:], "final end", ""])

    def children(self, indent: int, *, parallel: bool) -> None:
        pad = " " * indent
        names = [f"s{self.next()}" for _ in range(self.draw.choice((2, 2, 3)))]
        if not parallel and self.chance(0.7):
            actions = self.actions() if self.chance(0.4) else ""
            self.lines.append(f"{pad}initial {self.draw.choice(names)}{actions}")
        for name in names:
            self.states.append(name)
            deep = indent < 12 and len(self.states) < 14
            kind = self.draw.choice(("state", "state", "compound", "parallel") if deep else ("state",))
            if kind == "state" and self.instances and self.chance(0.3):
                kind = "instance"
            self.state(name, kind, indent, parallel=parallel)
        if not parallel and indent and self.chance(0.6):
            final = f"z{self.next()}"
            for around in self.around:
                self.finals[around].append(final)
            self.states.append(final)
            self.lines.append(f"{pad}final {final}")

    def state(self, name: str, kind: str, indent: int, *, parallel: bool) -> None:
        pad, inner = " " * (indent + 4), indent + 4
        if kind == "instance":
            self.lines.append(f"{' ' * indent}state {name} = part(limit = {self.draw.randint(0, 2)})")
            self.groups.append(name)
            self.slots.append((len(self.lines), inner, kind, name))
            return
        self.lines.append(f"{' ' * indent}{'parallel' if kind == 'parallel' else 'state'} {name}")
        if kind == "state" and self.chance(0.6):
            kind = "work"
            self.lines.append(f"{pad}do work({self.next()})")
        self.slots.append((len(self.lines), inner, kind, name))
        for word in ("entry", "exit"):
            if self.chance(0.5):
                self.lines.append(f"{pad}{word}{self.actions()}")
        if kind in ("compound", "parallel"):
            self.groups.append(name)
            self.finals[name] = []
            self.around.append(name)
            self.children(inner, parallel=kind == "parallel")
            self.around.pop()

    def condition(self) -> str:
        text = self.draw.choice(
            [f"flag({self.draw.randint(0, 4)})"] * 3
            + [f"in({self.draw.choice(self.states)})", f"n < {self.draw.randint(0, 6)}", "m == 1", "n > m"]
        )
        if self.data and self.chance(0.3):
            text = self.draw.choice(("odd", "kind == high", "(n if odd else m) < 2"))
        if self.chance(0.3):
            text = f"not ({text})"
        if self.chance(0.25):
            text = f"({text} {self.draw.choice(('and', 'or'))} {self.condition()})"
        return text

    def actions(self) -> str:
        kinds = ["n += 1", "m = 1 - m", "n = 0"] * 2 + ["raise e", "raise f", "raise g after 0.3 s", "cancel g"]
        if self.data:
            kinds += ["raise h(n, kind)", "raise h(n + 1, high) after 0.3 s", "cancel h", "kind = low"]
            kinds += ["kind = high if n > m else kind", "send h(m, kind)", "send e"]
        chosen = [self.draw.choice(kinds) for _ in range(self.draw.choice((0, 0, 1, 2)))]
        marks = [f"{self.draw.choice(('note', 'note', 'fragile'))}({self.next()})"]
        return " / " + ", ".join([*chosen, *marks] if self.chance(0.5) else [*marks, *chosen])

    def targets(self) -> str:
        if self.chance(0.25):
            return (
                f"{self.draw.choice(self.groups)}.{self.draw.choice(('history', 'deep_history'))}"
                if (self.groups)
                else self.draw.choice(self.states)
            )
        return self.draw.choice([*self.states, *self.states, "end"] if self.chance(0.2) else self.states)

    def transitions(self, indent: int, kind: str, name: str) -> None:
        pad = " " * indent
        whens = 0
        for _ in range(self.draw.choice((1, 2, 3, 4))):
            trigger = self.draw.choice(
                ("on", "on", "on", "when", "after", "every", "for", "done", "done", "defer", "fault")
            )
            guard = f" if {self.condition()}" if self.chance(0.35) else ""
            if self.data and trigger == "on" and self.chance(0.4):
                self.carrying(pad)
                continue
            match trigger:
                case "on":
                    head = f"on {self.draw.choice(('e', 'f', 'g', 'e, f', '*'))}"
                case "when":
                    head, whens = f"when {self.condition()}", whens + 1
                case "after":
                    head = f"after {self.draw.choice(('0.1', '0.2', '0.35', '1'))} s"
                case "every":
                    head = f"every {self.draw.choice(('0.1', '0.25', '0.3'))} s"
                case "for":
                    head = f"when {self.condition()} for {self.draw.choice(('0.1', '0.25', '0.3'))} s"
                case "done":
                    head = f"on {self.outcome(kind, name)}"
                case "fault":
                    head = "on fault"
                case _:
                    self.lines.append(f"{pad}defer {self.draw.choice(EVENTS)}{guard}")
                    continue
            target = f" {self.draw.choice(('->', '->', '=>'))} {self.targets()}" if self.chance(0.8) else ""
            if trigger == "when" and not target:
                target = f" -> {self.targets()}"  # one that stays would fire without end
            self.lines.append(f"{pad}{head}{guard}{target}{self.actions() if not target or self.chance(0.5) else ''}")
        if whens and self.chance(0.3):
            self.lines.append(f"{pad}else -> {self.targets()}")

    def carrying(self, pad: str) -> None:
        """A line that handles the event with data."""
        read = ("h.number > n", "h.kind == kind", "not (h.kind == low) or odd", "h.number == 1 and flag(1)")
        guard = f" if {self.draw.choice(read)}" if self.chance(0.6) else ""
        if self.chance(0.2):
            self.lines.append(f"{pad}defer h{guard}")
            return
        target = f" {self.draw.choice(('->', '->', '=>'))} {self.targets()}" if self.chance(0.7) else ""
        takes = self.draw.choice(("n = h.number", "kind = h.kind", "raise h(h.number - 1, kind)", "send h(n, h.kind)"))
        self.lines.append(f"{pad}on h{guard}{target} / {takes}{self.actions().replace(' / ', ', ')}")

    def outcome(self, kind: str, name: str) -> str:
        if kind == "instance":
            return self.draw.choice(("over", "done"))
        if kind == "work":
            return self.draw.choice(("ready", "stuck", "ready, stuck"))
        finals = self.finals.get(name)
        return self.draw.choice(["done", "done", *finals] if finals else EVENTS)


def chart_text(seed: int, *, instances: bool = False, data: bool = False) -> str:
    """The text of a machine, which the language may refuse.

    Args:
        seed: what it is drawn from.
        instances: whether it may have instances of ``part``.
        data: whether it has an event with data, an enumeration, a named condition, and sends events.
    """
    return _Chart(Random(seed), instances=instances, data=data).text()


def members_text(seed: int) -> str:
    """The text of a machine with two members of the machine ``chart``, and lines of its own about their events."""
    draw = Random(seed)
    lines = ["machine whole", "import chart", "", "event e, f, g", *DATA[1:]]
    lines += ["var n : int = 0", "var m : int = 0", ""]
    own = ("on h / n = h.number", "on h if h.kind == high / kind = h.kind", "on e / n += 1", "on f -> rest")
    lines += ["initial both", "", "parallel both", *(f"    {one}" for one in own if draw.random() < 0.4)]
    if draw.random() < 0.4:
        lines.append("    defer h")
    lines += ["    member red = chart()", "    member blue = chart()", ""]
    return "\n".join([*lines, "state rest", "    on e -> both", "    on h => both", "", "final end", ""])


def carelessly(text: str, draw: Random) -> str:
    """The same machine in another layout, with comments."""
    width = draw.choice((1, 2, 3, 8))
    lines = []
    for line in text.split("\n"):
        words = line.lstrip()
        depth = (len(line) - len(words)) // 4
        for tight, mark in ((" = ", "="), (", ", ","), (" < ", "<"), (" -> ", "->"), (" / ", "/")):
            if draw.random() < 0.2:
                # `1 s/n` would be a number with a unit.
                marks = (f"  {mark} ", f" {mark}  ") if f" s{tight}" in words else (mark, f"  {mark} ", f"{mark}  ")
                words = words.replace(tight, draw.choice(marks))
        if words and draw.random() < 0.1:
            lines.append(f"{' ' * draw.randint(0, 9)}#about line {len(lines)}")
        if words and draw.random() < 0.1:
            words += draw.choice((" # a remark", "#tight"))
        lines += [" " * width * depth + words, *[""] * (draw.random() < 0.05)]
    return "\n".join(lines)
