"""From text to a running machine: the stages, for machines of growing size and depth.

    python benchmarks/language.py [--rounds N] [--most STATES]

Prints the median processor time of each stage in milliseconds and what one state costs: a cost that does not grow with
the number of states is linear growth.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable

from hsm.dsl import check_text, parse_model
from hsm.dsl.format.formatter import format_text
from hsm.dsl.syntax.parser import parse
from hsm.engine.machine import build
from hsm.model.registry import Library
from hsm.model.types import Speed


def library() -> Library:
    """What the machines of this benchmark name."""
    made = Library("benchmark")
    for name in ("space.left", "space.front"):
        made.signal(name)(_flag)

    @made.activity("drive", outcomes=("blocked",))
    class Drive:
        def __init__(self, speed: Speed) -> None:
            self.speed = speed

        def tick(self, facts: object) -> None:
            del facts

    made.event("go")
    return made


def _flag(facts: object) -> bool:
    return facts is not None


def flat(states: int) -> str:
    """A machine whose states lie side by side: each with an activity and three transitions."""
    lines = ["machine flat", "var turns : int = 0"]
    for number in range(states):
        lines += [
            f"state s{number}",
            "    do drive(speed = 0.5 m/s)",
            f"    when space.front and not space.left -> s{(number + 1) % states} / turns -= 1",
            f"    on blocked, go if turns == 3        -> s{(number + 7) % states}",
            f"    after 5 s                           -> s{(number + 3) % states}",
        ]
    return "\n".join(lines) + "\n"


def nested(states: int, depth: int) -> str:
    """A machine of towers of states, each state inside the previous one."""
    lines = ["machine nested"]
    for number in range(states):
        pad = "    " * (number % depth)
        lines += [f"{pad}state s{number}", f"{pad}    on go -> s{(number + 1) % states}"]
    return "\n".join(lines) + "\n"


def median(rounds: int, work: Callable[[], object]) -> float:
    """Median processor time in milliseconds."""
    taken = []
    for _ in range(rounds):
        begin = time.process_time()
        work()
        taken.append((time.process_time() - begin) * 1000)
    return statistics.median(taken)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--most", type=int, default=10_000, help="states of the largest machine")
    given = parser.parse_args()
    known = library()
    parse_model(flat(2), known)  # the grammar is read once
    head = ("machine", "parse", "to a model", "to a run", "a state", "with remarks", "format")
    print(("{:>22}" + "{:>14}" * 6).format(*head))
    for name, text, states in cases(given.most):
        rounds = given.rounds if states <= 1000 else max(1, given.rounds // 3)
        figures = (
            median(rounds, lambda text=text: parse(text, "benchmark")),
            median(rounds, lambda text=text: parse_model(text, known)),
            running := median(rounds, lambda text=text: build(parse_model(text, known)).start()),
            running / states,
            median(rounds, lambda text=text: check_text(text, known)),
            median(rounds, lambda text=text: format_text(text)),
        )
        print(f"{name:>22}" + "".join(f"{figure:>11.3f} ms" for figure in figures), flush=True)


def cases(most: int) -> list[tuple[str, str, int]]:
    """Name, text and number of states of each machine."""
    sizes = [size for size in (10, 100, 1000, 10_000) if size <= most]
    deep = [(f"1000 states, depth {depth}", nested(1000, depth), 1000) for depth in (1, 8, 32, 250)]
    return [*((f"{size} states", flat(size), size) for size in sizes), *deep]


if __name__ == "__main__":
    main()
