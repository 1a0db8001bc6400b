"""The time of a tick: this engine, other statechart libraries, and code written by hand.

One machine of ten states, the same for all; rounds are interleaved, so that a busy computer slows all of them; each
figure is the median of its rounds, each ratio the median of the ratios within a round.

    python benchmarks/engine.py            all tables
    python benchmarks/engine.py --quick    fewer rounds, smaller machines

The peers are python-statemachine, sismic and xstate-statemachine; those that are not installed are left out.
"""

from __future__ import annotations

import argparse
import gc
import logging
import statistics
import sys
import time
import tracemalloc
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from hsm import Supervisor, build
from hsm.model.chart import Model, On, State, StateKind, Transition, When
from hsm.model.expressions import Binary, Expression, SignalValue, Unary
from hsm.model.registry import Library
from hsm.model.types import BOOLEAN

FACTS = ("ready", "front", "left", "right", "aligned", "exit", "door", "rung")


class Facts:
    """What a tick can ask."""

    __slots__ = FACTS

    def __init__(self, *true: str) -> None:
        for name in FACTS:
            setattr(self, name, name in true)


# source, target, facts that must be true, facts that must be false
TABLE: tuple[tuple[str, str, tuple[str, ...], tuple[str, ...]], ...] = (
    ("start", "search.drive", ("ready",), ()),
    ("search.drive", "search.turn_left", ("left",), ("front",)),
    ("search.drive", "search.turn_right", ("right",), ("front", "left")),
    ("search.drive", "search.turn_back", (), ("front", "left", "right")),
    ("search.turn_left", "search.drive", ("aligned",), ()),
    ("search.turn_right", "search.drive", ("aligned",), ()),
    ("search.turn_back", "search.drive", ("aligned",), ()),
    ("search", "finished", ("exit",), ()),
    ("search", "door.ring", ("door",), ()),
    ("door.ring", "door.wait", ("rung",), ()),
    ("door", "search.drive", (), ("door",)),
)
TREE: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("start", ()),
    ("search", ("drive", "turn_left", "turn_right", "turn_back")),
    ("door", ("ring", "wait")),
    ("finished", ()),
)

FREE = Facts("front")
DOOR = Facts("front", "door")
LEFT = Facts("left")
ALIGNED = Facts("front", "aligned")


@dataclass
class Contender:
    """One implementation: ``run`` does a tick for each of the facts, ``where`` gives the name of the atomic state."""

    name: str
    run: Callable[[Sequence[Any]], object]
    where: Callable[[], str]

    def tick(self, facts: Facts) -> None:
        """One tick."""
        self.run((facts,))


# This engine.

LIBRARY = Library("benchmark")


@LIBRARY.signal("ready")
def is_ready(facts: Facts) -> bool:
    return facts.ready  # type: ignore[attr-defined, no-any-return]


@LIBRARY.signal("front")
def is_front(facts: Facts) -> bool:
    return facts.front  # type: ignore[attr-defined, no-any-return]


@LIBRARY.signal("left")
def is_left(facts: Facts) -> bool:
    return facts.left  # type: ignore[attr-defined, no-any-return]


@LIBRARY.signal("right")
def is_right(facts: Facts) -> bool:
    return facts.right  # type: ignore[attr-defined, no-any-return]


@LIBRARY.signal("aligned")
def is_aligned(facts: Facts) -> bool:
    return facts.aligned  # type: ignore[attr-defined, no-any-return]


@LIBRARY.signal("exit")
def is_exit(facts: Facts) -> bool:
    return facts.exit  # type: ignore[attr-defined, no-any-return]


@LIBRARY.signal("door")
def is_door(facts: Facts) -> bool:
    return facts.door  # type: ignore[attr-defined, no-any-return]


@LIBRARY.signal("rung")
def is_rung(facts: Facts) -> bool:
    return facts.rung  # type: ignore[attr-defined, no-any-return]


def guard(needs: Iterable[str], forbids: Iterable[str]) -> Expression:
    parts: list[Expression] = [SignalValue(LIBRARY.signals[name]) for name in needs]
    parts = [Unary("not", SignalValue(LIBRARY.signals[name]), BOOLEAN) for name in forbids] + parts
    whole = parts[0]
    for part in parts[1:]:
        whole = Binary("and", whole, part, BOOLEAN)
    return whole


def machine_model() -> Model:
    names = ["maze"]
    parents = [-1]
    for outer, inner in TREE:
        parents.append(0)
        names.append(outer)
        at = len(names) - 1
        for one in inner:
            parents.append(at)
            names.append(f"{outer}.{one}")
    index = {name: number for number, name in enumerate(names)}
    transitions = tuple(
        Transition(number, index[source], (index[target],), When(guard(needs, forbids)))
        for number, (source, target, needs, forbids) in enumerate(TABLE)
    )
    return tree_model("maze", names, parents, transitions)


def tree_model(name: str, names: list[str], parents: list[int], transitions: tuple[Transition, ...]) -> Model:
    children: list[list[int]] = [[] for _ in names]
    last = list(range(len(names)))
    for number in range(len(names) - 1, 0, -1):
        children[parents[number]].insert(0, number)
        last[parents[number]] = max(last[parents[number]], last[number])
    own: list[list[int]] = [[] for _ in names]
    for transition in transitions:
        own[transition.source].append(transition.index)
    states = tuple(
        State(
            number,
            names[number],
            StateKind.COMPOUND if children[number] else StateKind.ATOMIC,
            parents[number],
            tuple(children[number]),
            last[number],
            tuple(children[number][:1]),
            transitions=tuple(own[number]),
        )
        for number in range(len(names))
    )
    return Model(name, states, transitions)


def _steps(supervisor: Supervisor, turns: Sequence[Facts]) -> None:
    for facts in turns:
        supervisor.step(0.0, (), facts)


def this_engine() -> Contender:
    supervisor = build(machine_model()).start()
    return Contender("this engine", partial(_steps, supervisor), lambda: max(supervisor.configuration, key=len))


# By hand.


class ByHand:
    """Code for this machine only: the fastest that Python allows, without a record.

    It behaves the same: it is stepped like a supervisor, calls the same functions for its facts, only if needed, and
    continues until nothing fires any more.
    """

    def __init__(self) -> None:
        self.state = "start"

    def step(self, _time: float, _events: tuple[str, ...], facts: Facts) -> None:  # noqa: PLR0912 - that is the point
        """One tick."""
        while True:
            state = self.state
            if state == "search.drive":
                if not is_front(facts):
                    if is_left(facts):
                        self.state = "search.turn_left"
                    elif is_right(facts):
                        self.state = "search.turn_right"
                    else:
                        self.state = "search.turn_back"
                    continue
            elif state in {"search.turn_left", "search.turn_right", "search.turn_back"}:
                if is_aligned(facts):
                    self.state = "search.drive"
                    continue
            elif state == "door.ring":
                if is_rung(facts):
                    self.state = "door.wait"
                elif not is_door(facts):
                    self.state = "search.drive"
                else:
                    return
                continue
            elif state == "door.wait":
                if is_door(facts):
                    return
                self.state = "search.drive"
                continue
            else:
                if state == "start" and is_ready(facts):
                    self.state = "search.drive"
                    continue
                return
            if is_exit(facts):
                self.state = "finished"
            elif is_door(facts):
                self.state = "door.ring"
            else:
                return


def by_hand() -> Contender:
    machine = ByHand()

    def run(turns: Sequence[Facts]) -> None:
        for facts in turns:
            machine.step(0.0, (), facts)

    return Contender("by hand", run, lambda: machine.state)


# The peers.


class ConditionMethods:
    """One method for each fact and its negation, the form of conditions in several libraries."""

    facts = FREE


def _add_methods() -> None:
    for name in FACTS:
        setattr(ConditionMethods, f"is_{name}", lambda self, *_, name=name: getattr(self.facts, name))


_add_methods()


def transitions() -> Contender:
    from transitions.extensions import HierarchicalMachine

    model = ConditionMethods()
    machine = HierarchicalMachine(
        model,
        states=[
            {"name": outer, "children": list(inner), "initial": inner[0]} if inner else outer for outer, inner in TREE
        ],
        initial="start",
        queued=True,
        auto_transitions=False,
        ignore_invalid_triggers=True,
    )
    for source, target, needs, forbids in TABLE:
        machine.add_transition(
            "tick",
            source.replace(".", "_"),
            target.replace(".", "_"),
            conditions=[f"is_{name}" for name in needs],
            unless=[f"is_{name}" for name in forbids],
        )

    def run(turns: Sequence[Facts]) -> None:
        for facts in turns:
            model.facts = facts
            model.tick()  # type: ignore[attr-defined]

    return Contender("transitions", run, lambda: str(model.state).replace("_", ".", 1))  # type: ignore[attr-defined]


def python_statemachine() -> Contender:
    from statemachine import State as PState
    from statemachine import StateChart

    def condition(needs: tuple[str, ...], forbids: tuple[str, ...]) -> str:
        return " and ".join([f"is_{name}" for name in needs] + [f"not is_{name}" for name in forbids])

    body: dict[str, Any] = {"allow_event_without_transition": True}
    found: dict[str, Any] = {}
    for outer, inner in TREE:
        if inner:
            nested = {one: PState(initial=number == 0) for number, one in enumerate(inner)}
            found.update({f"{outer}.{one}": state for one, state in nested.items()})
            body[outer] = type(PState.Compound)(outer, (PState.Compound,), nested)
        else:
            body[outer] = PState(initial=outer == "start", final=outer == "finished")
        found[outer] = body[outer]
    tick: Any = None
    for source, target, needs, forbids in TABLE:
        one = found[source].to(found[target], cond=condition(needs, forbids))
        tick = one if tick is None else tick | one
    body["tick"] = tick
    for name in FACTS:
        body[f"is_{name}"] = lambda self, name=name: getattr(self.facts, name)
    body["facts"] = FREE
    machine = type(StateChart)("Maze", (StateChart,), body)()

    def run(turns: Sequence[Facts]) -> None:
        for facts in turns:
            machine.facts = facts
            machine.send("tick")

    def where() -> str:
        leaf = list(machine.configuration)[-1].id
        return next(name for name in found if name.rpartition(".")[2] == leaf)

    return Contender("python-statemachine", run, where)


def sismic() -> Contender:
    from sismic.interpreter import Interpreter
    from sismic.model import CompoundState, Statechart
    from sismic.model import Transition as STransition
    from sismic.model.elements import BasicState, FinalState

    chart = Statechart("maze")
    chart.add_state(CompoundState("root", initial="start"), None)
    for outer, inner in TREE:
        if inner:
            chart.add_state(CompoundState(outer, initial=inner[0]), "root")
            for one in inner:
                chart.add_state(BasicState(one), outer)
        else:
            chart.add_state(FinalState(outer) if outer == "finished" else BasicState(outer), "root")
    for source, target, needs, forbids in TABLE:
        code = " and ".join([f"world.facts.{name}" for name in needs] + [f"not world.facts.{name}" for name in forbids])
        own, goal = source.rpartition(".")[2], target.rpartition(".")[2]
        chart.add_transition(STransition(own, goal, event="tick", guard=code))
    world = ConditionMethods()
    interpreter = Interpreter(chart, initial_context={"world": world})
    interpreter.execute()

    def run(turns: Sequence[Facts]) -> None:
        for facts in turns:
            world.facts = facts
            interpreter.queue("tick").execute_once()

    def where() -> str:
        leaf = interpreter.configuration[-1]
        parent = chart.parent_for(leaf)
        return leaf if parent in (None, "root") else f"{parent}.{leaf}"

    return Contender("sismic", run, where)


def xstate() -> Contender:
    from xstate_statemachine import MachineLogic, SyncInterpreter, create_machine

    world = ConditionMethods()

    def make(needs: tuple[str, ...], forbids: tuple[str, ...]) -> Callable[..., bool]:
        def holds(_context: Any, _event: Any) -> bool:
            facts = world.facts
            return all(getattr(facts, name) for name in needs) and not any(getattr(facts, name) for name in forbids)

        return holds

    states: dict[str, Any] = {}
    for outer, inner in TREE:
        states[outer] = {"initial": inner[0], "states": {one: {} for one in inner}} if inner else {}
    guards = {}
    for number, (source, target, needs, forbids) in enumerate(TABLE):
        guards[f"g{number}"] = make(needs, forbids)
        outer, _, own = source.partition(".")
        node = states[outer]["states"][own] if own else states[outer]
        node.setdefault("on", {}).setdefault("TICK", []).append({"target": f"#maze.{target}", "guard": f"g{number}"})
    config = {"id": "maze", "initial": "start", "context": {}, "states": states}
    interpreter = SyncInterpreter(create_machine(config, logic=MachineLogic(guards=guards))).start()

    def run(turns: Sequence[Facts]) -> None:
        for facts in turns:
            world.facts = facts
            interpreter.send("TICK")

    return Contender(
        "xstate-statemachine", run, lambda: next(iter(interpreter.current_state_ids)).removeprefix("maze.")
    )


MAKERS: tuple[Callable[[], Contender], ...] = (
    transitions,
    sismic,
    python_statemachine,
    xstate,
    this_engine,
    by_hand,
)

# What is measured: the facts given in turn, and the state that each of them must lead to.
CASES: tuple[tuple[str, tuple[tuple[Facts, str], ...]], ...] = (
    ("nothing taken", ((FREE, "search.drive"),)),
    ("2 exits, 2 entries", ((DOOR, "door.ring"), (FREE, "search.drive"))),
    ("sibling", ((LEFT, "search.turn_left"), (ALIGNED, "search.drive"))),
)


def contenders() -> list[Contender]:
    found = []
    for make in MAKERS:
        try:
            one = make()
        except ImportError as error:
            print(f"{make.__name__} is left out: {error}", file=sys.stderr)
            continue
        one.tick(Facts("ready", "front"))
        for name, case in CASES:
            for facts, expected in case:
                one.tick(facts)
                if one.where() != expected:
                    raise SystemExit(f"{one.name}, {name}: in {one.where()}, not in {expected}")
        found.append(one)
    return found


def time_case(contender: Contender, case: tuple[tuple[Facts, str], ...], budget: float) -> float:
    """Processor seconds per tick, measured over about ``budget`` seconds, including the call itself."""
    facts = [one for one, _ in case]
    count = 8
    while True:
        turns = facts * (count // len(facts))
        start = time.process_time()
        contender.run(turns)
        spent = time.process_time() - start
        if spent >= budget:
            return spent / len(turns)
        count = min(count * 10, max(count * 2, int(count * budget * 1.2 / max(spent, 1e-7))))


def compare(rounds: int, budget: float) -> None:
    """The first table: microseconds and how many times as fast as transitions; by hand is the limit."""
    logging.disable(logging.CRITICAL)
    competing = contenders()
    print(f"10 states, medians of {rounds} interleaved rounds; x: times as fast as transitions in the same round\n")
    print(f"{'':22}" + "".join(f"{name:>30}" for name, _ in CASES))
    measured: dict[tuple[str, str], list[float]] = {}
    gc.disable()
    for _ in range(rounds):
        for name, case in CASES:
            for one in competing:
                measured.setdefault((one.name, name), []).append(time_case(one, case, budget))
        gc.collect()
    gc.enable()
    for one in competing:
        row = f"{one.name:22}"
        for name, _ in CASES:
            own, base = measured[one.name, name], measured["transitions", name]
            ratio = statistics.median(b / a for a, b in zip(own, base, strict=True))
            row += f"{statistics.median(own) * 1e6:16.2f} us {ratio:9.1f}x "
        print(row)
    row = f"{'this engine / by hand':22}"
    for name, _ in CASES:
        pairs = zip(measured["this engine", name], measured["by hand", name], strict=True)
        row += f"{'':18} {statistics.median(a / b for a, b in pairs):9.1f}  "
    print(row)


# Size and depth.


def wide_model(count: int, *, around: bool = False) -> Model:
    """Groups of ten states: ``count`` states in total.

    Each state drives on to the next one of its group or, with ``around``, of the machine: then every step of a
    measurement is in another state, and what the processor's caches hold shows.
    """
    names, parents, transitions = ["wide"], [-1], []
    for group in range(max(1, count // 10)):
        parents.append(0)
        names.append(f"g{group}")
        at = len(names) - 1
        for one in range(9):
            parents.append(at)
            names.append(f"g{group}.s{one}")
    leaves = [number for number in range(1, len(names)) if "." in names[number]]
    for number, leaf in enumerate(leaves):
        following = number + 1 if around or number % 9 < 7 else number - number % 9
        target = leaves[following % len(leaves)]
        # Neighbours wait for different facts: one step makes one transition.
        waits = guard(("left",), ("front",)) if (number if around else number % 9) % 2 == 0 else guard(("aligned",), ())
        transitions.append(Transition(len(transitions), leaf, (target,), When(waits)))
    return tree_model("wide", names, parents, tuple(transitions))


def deep_model(depth: int) -> Model:
    """Two states at the bottom of a tower, with one condition at the bottom and one event at the top."""
    names, parents = ["deep"], [-1]
    for level in range(depth - 1):
        parents.append(len(names) - 1)
        names.append(f"level{level}")
    bottom = len(names) - 1
    for one in ("a", "b"):
        parents.append(bottom)
        names.append(one)
    a, b = len(names) - 2, len(names) - 1
    moves = (
        Transition(0, a, (b,), When(guard(("left",), ("front",)))),
        Transition(1, b, (a,), When(guard(("aligned",), ()))),
        Transition(2, 0, (a,), On(("reset",))),
    )
    return tree_model("deep", names, parents, moves)


def flatness(models: Iterable[tuple[str, Model]], rounds: int, budget: float) -> None:
    """A tick with nothing taken and one that moves, for each model; the first is the measure for the others."""
    runs = [(name, build(model)) for name, model in models]
    taken: dict[str, list[float]] = {}
    idle: dict[str, list[float]] = {}
    for _ in range(rounds):
        for name, machine in runs:
            supervisor = machine.start()
            own = Contender(name, partial(_steps, supervisor), str)
            idle.setdefault(name, []).append(time_case(own, ((FREE, ""),), budget))
            taken.setdefault(name, []).append(time_case(own, ((LEFT, ""), (ALIGNED, "")), budget))
    first = runs[0][0]
    print(f"\n{'':22}{'nothing taken':>24}{'taken':>24}")
    for name, _ in runs:
        row = f"{name:22}"
        for found in (idle, taken):
            ratio = statistics.median(a / b for a, b in zip(found[name], found[first], strict=True))
            row += f"{statistics.median(found[name]) * 1e6:14.2f} us {ratio:5.2f}x"
        print(row)


def starting(sizes: Iterable[int]) -> None:
    """What one more run of a machine costs: processor time, the least of many, and memory, the mean of many."""
    print(f"\n{'start of a run':22}{'time':>12}{'memory':>12}")
    for size in sizes:
        machine = build(wide_model(size))
        kept = [machine.start()]
        times = []
        for _ in range(300):
            began = time.process_time_ns()
            machine.start()
            times.append(time.process_time_ns() - began)
        tracemalloc.start()
        kept += [machine.start() for _ in range(100)]
        memory = tracemalloc.get_traced_memory()[0] / 100
        tracemalloc.stop()
        print(f"{f'{size} states':22}{min(times) / 1e3:9.1f} us{memory / 1e3:9.1f} KB")


def main() -> None:
    """Print all tables."""
    warnings.simplefilter("ignore")
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer rounds and smaller machines")
    quick = parser.parse_args().quick
    rounds, budget = (5, 0.01) if quick else (15, 0.05)
    compare(rounds, budget)
    sizes = (10, 100, 1000) if quick else (10, 100, 1000, 10_000)
    flatness([(f"{size} states", wide_model(size)) for size in sizes], rounds, budget)
    print("\nthe same, through all states one after the other")
    flatness([(f"{size} states", wide_model(size, around=True)) for size in sizes], rounds, budget)
    starting((10, 10_000))
    flatness([(f"depth {depth}", deep_model(depth)) for depth in (1, 2, 4, 8, 16, 32)], rounds, budget)


if __name__ == "__main__":
    main()
