"""Machines with several parallel regions of four states."""

from __future__ import annotations

from hsm.model.chart import Model
from hsm.testing.proofs.verdicts import PropertyVerdict
from hsm.testing.scenarios.script import scripted_machine
from tests.trust.random_machines import replays

SIGNALS = ("space.left", "space.front", "space.right", "door.near", "door.open", "exit.crossed")


def region_lines(number: int, answer: str, *, entry: str = "", leave: str = "") -> list[str]:
    """A region of four states.

    Args:
        number: of the region, and of its states and its signal.
        answer: what leads from the third state to the last.
        entry: the actions on entry of the last state.
        leave: the actions on exit of the last state.
    """
    return [
        f"    state region{number}",
        f"        initial a{number}",
        f"        state a{number}",
        f"            when {SIGNALS[number]} -> b{number}",
        f"        state b{number}",
        f"            after 2 s              -> c{number}",
        f"            when not {SIGNALS[number]} -> a{number}",
        f"        state c{number}",
        f"            {answer} -> d{number}",
        f"        state d{number}",
        *([f"            entry / {entry}"] if entry else []),
        *([f"            exit / {leave}"] if leave else []),
        f"            after 1 s -> a{number}",
    ]


def regions_text(count: int) -> str:
    """A machine with so many regions, each with a property of its own, and two properties with more to them."""
    lines = ["machine regions", "", "event go", ""]
    lines += [f"property shut{one} : never in(c{one}) and in(d{one})" for one in range(count)]
    lines += [
        "property soon : always eventually not in(b0) within 3 s",
        "property order : after in(b0), in(c0) or in(a0) before in(d0)",
        "property both : never in(c0) and in(d0) or in(c1) and in(d1)",
        "",
        "parallel all",
    ]
    for one in range(count):
        lines += region_lines(one, "on go")
    return "\n".join(lines) + "\n"


def replayed(model: Model, verdict: PropertyVerdict) -> bool:
    """Whether a counterexample violates its property on the engine."""
    return replays(scripted_machine(model), verdict)
