"""Machines with several parallel regions of four states."""

from __future__ import annotations

from hsm.model.chart import Model
from hsm.testing.proofs.verdicts import PropertyVerdict
from hsm.testing.scenarios.script import scripted_machine
from tests.trust.random_machines import replays

SIGNALS = ("space.left", "space.front", "space.right", "door.near", "door.open", "exit.crossed")


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
        lines += [
            f"    state region{one}",
            f"        initial a{one}",
            f"        state a{one}",
            f"            when {SIGNALS[one]} -> b{one}",
            f"        state b{one}",
            f"            after 2 s              -> c{one}",
            f"            when not {SIGNALS[one]} -> a{one}",
            f"        state c{one}",
            f"            on go -> d{one}",
            f"        state d{one}",
            f"            after 1 s -> a{one}",
        ]
    return "\n".join(lines) + "\n"


def replayed(model: Model, verdict: PropertyVerdict) -> bool:
    """Whether a counterexample violates its property on the engine."""
    return replays(scripted_machine(model), verdict)
