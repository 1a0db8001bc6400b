"""The time of a step by events: a chart read from SCXML, the library `transitions`, and code written by hand.

    python benchmarks/scxml.py [--rounds N]

One machine of ten states, the same for all. *taken*: an event that leaves two states and enters two, and one that leads
back; *nothing*: an event that the active states do not wait for. The rounds are interleaved; each figure is the median
of its rounds, each ratio the median of the ratios within a round.
"""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Callable, Sequence
from itertools import count
from pathlib import Path
from statistics import median
from time import process_time

# Before the folder of the benchmarks, where a script has the name of a package.
sys.path.insert(0, str(Path(__file__).parents[1]))

import hsm

Step = Callable[[str], object]

TREE = {
    "start": (),
    "search": ("drive", "turn_left", "turn_right", "turn_back"),
    "door": ("ring", "wait"),
    "finished": (),
}
TABLE = (
    ("start", "ready", "search_drive"),
    ("search_drive", "left", "search_turn_left"),
    ("search_drive", "right", "search_turn_right"),
    ("search_drive", "end", "search_turn_back"),
    ("search_turn_left", "aligned", "search_drive"),
    ("search_turn_right", "aligned", "search_drive"),
    ("search_turn_back", "aligned", "search_drive"),
    ("search", "exit", "finished"),
    ("search", "door", "door_ring"),
    ("door_ring", "rung", "door_wait"),
    ("door", "gone", "search_drive"),
)
EVENTS = tuple(dict.fromkeys(event for _, event, _ in TABLE))
CASES = {"taken": ("door", "gone"), "nothing": ("rung",)}


def chart() -> str:
    """The machine as SCXML."""

    def state(name: str, inner: Sequence[str]) -> str:
        moves = "".join(f'<transition event="{event}" target="{to}"/>' for own, event, to in TABLE if own == name)
        return f'<state id="{name}">{moves}{"".join(state(f"{name}_{one}", ()) for one in inner)}</state>'

    return f'<scxml name="maze">{"".join(state(name, inner) for name, inner in TREE.items())}</scxml>'


def this_engine() -> tuple[Step, Callable[[], str]]:
    """A run of the chart, `step(time, events)`."""
    run = hsm.build(hsm.scxml.read_text(chart())).start()
    times = count(0.1, 0.1)

    def step(event: str) -> object:
        return run.step(next(times), (event,))

    return step, lambda: max(run.configuration, key=len)


def transitions() -> tuple[Step, Callable[[], str]]:
    """A hierarchical machine of the library."""
    from transitions.extensions import HierarchicalMachine

    machine = HierarchicalMachine(
        states=[{"name": name, "children": list(inner)} if inner else name for name, inner in TREE.items()],
        transitions=[[event, source, target] for source, event, target in TABLE],
        initial="start",
        ignore_invalid_triggers=True,
        auto_transitions=False,
    )
    return machine.trigger, lambda: str(machine.state)


def by_hand() -> tuple[Step, Callable[[], str]]:
    """One dictionary of what follows, with the events of the outer states in each inner one."""
    following: dict[str, dict[str, str]] = {}
    for name, inner in TREE.items():
        for leaf in [f"{name}_{one}" for one in inner] or [name]:
            following[leaf] = {event: to for own, event, to in reversed(TABLE) if own in (name, leaf)}
    at = ["start"]

    def step(event: str) -> object:
        at[0] = following[at[0]].get(event, at[0])
        return at[0]

    return step, lambda: at[0]


def seconds(step: Step, events: Sequence[str], budget: float) -> float:
    """Processor time of a step, measured over about the given time, s."""
    turns = 64
    while True:
        given = [*events] * turns
        began = process_time()
        for event in given:
            step(event)
        spent = process_time() - began
        if spent >= budget:
            return spent / len(given)
        turns *= 4


def main() -> None:
    """Check that all do the same, measure, and print a table."""
    logging.disable(logging.CRITICAL)
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=15)
    rounds = parser.parse_args().rounds
    competing = {make.__name__: make() for make in (transitions, this_engine, by_hand)}
    for event, expected in (
        ("ready", "search_drive"),
        ("rung", "search_drive"),
        ("door", "door_ring"),
        ("gone", "search_drive"),
    ):
        for name, (step, where) in competing.items():
            step(event)
            if where() != expected:
                raise SystemExit(f"{name}, {event}: in {where()}, not in {expected}")
    found: dict[tuple[str, str], list[float]] = {}
    for _ in range(rounds):
        for case, events in CASES.items():
            for name, (step, _) in competing.items():
                found.setdefault((name, case), []).append(seconds(step, events, 0.02))
    print(f"{'':14}" + "".join(f"{case:>26}" for case in CASES))
    for name in competing:
        row = f"{name:14}"
        for case in CASES:
            own, base = found[name, case], found["transitions", case]
            ratio = median(other / one for one, other in zip(own, base, strict=True))
            row += f"{median(own) * 1e6:13.2f} us {ratio:8.1f}x "
        print(row)


if __name__ == "__main__":
    main()
