"""Machines with parallel regions that depend on one another: by the states, the variables and the events of others."""

from __future__ import annotations

from random import Random

from tests.trust.regions import SIGNALS, region_lines

COUPLINGS = ("in", "lock", "count", "raise")
"""How each region of ``coupled_text`` depends on others: asks for a state, shares a flag or a count, raises events."""


def coupled_text(kind: str, count: int) -> str:
    """A machine with so many regions of four states, each of which depends on others."""
    lines = ["machine coupled", "", "event go"]
    lines += {
        "in": [],
        "lock": ["var busy : bool = false"],
        "count": ["var inside : int = 0"],
        "raise": [f"event next{one}" for one in range(count)],
    }[kind]
    lines += [f"property shut{one} : never in(c{one}) and in(d{one})" for one in range(count)]
    lines += ["property soon : always eventually not in(b0) within 3 s", "", "parallel all"]
    for one in range(count):
        before, after = (one - 1) % count, (one + 1) % count
        answer, entry, leave = {
            "in": (f"on go if not in(d{before}) and not in(d{after})", "", ""),
            "lock": ("on go if not busy", "busy = true", "busy = false"),
            "count": (f"on go if inside < {count}", "inside = inside + 1", "inside = inside - 1"),
            "raise": (f"on go, next{one}", f"raise next{after}", ""),
        }[kind]
        lines += region_lines(one, answer, entry=entry, leave=leave)
    return "\n".join(lines) + "\n"


def drawn_text(seed: int, regions: int = 4) -> str:
    """A machine that is drawn at random: its regions of two or three states depend on one another in some ways."""
    draw = Random(seed)
    names = [[f"s{one}{at}" for at in range(draw.choice((2, 2, 3)))] for one in range(regions)]
    every = [name for some in names for name in some]
    events = ["go", "e0", "e1"]

    def condition() -> str:
        kinds = (
            lambda: draw.choice(SIGNALS),
            lambda: f"not {draw.choice(SIGNALS)}",
            lambda: f"in({draw.choice(every)})",
            lambda: f"not in({draw.choice(every)})",
            lambda: draw.choice(("flag", "not flag", "n > 1", "n == 0", "n < 3", "mode == calm", "mode != calm")),
        )
        first = draw.choice(kinds)()
        return first if draw.random() < 0.6 else f"{first} {draw.choice(('and', 'or'))} {draw.choice(kinds)()}"

    def action() -> str:
        return draw.choice(
            (
                "flag = true",
                "flag = false",
                "flag = not flag",
                f"flag = in({draw.choice(every)})",
                "n = 0",
                "n = n + 1",
                "n = min(n + 1, 3)",
                "mode = calm",
                "mode = wild",
                f"raise {draw.choice(events)}",
                f"raise {draw.choice(events)} after 1 s",
            )
        )

    lines = ["machine drawn", "", "enum Mode = calm, wild", *(f"event {one}" for one in events)]
    lines += ["var flag : bool = false", "var n : int = 0", "var mode : Mode = calm"]
    claims = (
        lambda: f"never in({draw.choice(every)}) and in({draw.choice(every)})",
        lambda: f"never in({draw.choice(every)}) and {condition()}",
        lambda: f"always n <= {draw.choice((2, 3))} or in({draw.choice(every)})",
        lambda: f"after in({draw.choice(every)}), in({draw.choice(every)}) before in({draw.choice(every)})",
        lambda: f"after in({draw.choice(every)}), not in({draw.choice(every)}) within 3 s",
        lambda: f"always eventually not in({draw.choice(every)}) within 3 s",
    )
    lines += [f"property p{one} : {draw.choice(claims)()}" for one in range(6)]
    lines += ["", "initial all", "", "parallel all"]
    if draw.random() < 0.3:
        lines.append(f"    when {condition()} -> away")
    for one, own in enumerate(names):
        lines += [f"    state r{one}", f"        initial {own[0]}"]
        for name in own:
            lines.append(f"        state {name}")
            if draw.random() < 0.4:
                lines.append(f"            {draw.choice(('entry', 'exit'))} / {action()}")
            for _ in range(draw.choice((1, 2))):
                trigger = draw.choice(
                    (
                        lambda: f"when {condition()}",
                        lambda: f"on {draw.choice(events)}",
                        lambda: f"on {draw.choice(events)} if {condition()}",
                        lambda: "after 1 s",
                        lambda: f"after 2 s if {condition()}",
                    )
                )()
                actions = f" / {action()}" if draw.random() < 0.4 else ""
                lines.append(
                    f"            {trigger} -> {draw.choice([other for other in own if other != name])}{actions}"
                )
    lines += ["state away", "    after 1 s -> all"]
    return "\n".join(lines) + "\n"
