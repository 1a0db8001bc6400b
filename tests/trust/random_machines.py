"""Machines drawn at random, with properties, and biased random runs of them on the engine with its monitor."""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from hsm.dsl import load_model
from hsm.engine.machine import Machine
from hsm.model.diagnostics import MachineError
from hsm.testing.proofs.proving import check
from hsm.testing.proofs.verdicts import NO_FAULT, PropertyVerdict
from hsm.testing.scenarios.driver import Driver
from hsm.testing.scenarios.running import run_scenario
from hsm.testing.scenarios.watching import property_watch
from tests.trust.library import make_library
from tests.trust.random_runs import LONGEST_TICK, RandomRuns

TALKING = 1_000_000
"""From this seed on machines have events with data and deferred ones."""

_ACTIVITIES = {
    "drive()": ["blocked"],
    "rotate(90 deg)": ["done", "blocked"],
    "ring()": ["accepted", "refused"],
    "stop()": [],
}
_FLAGS = ("space.left", "space.front", "space.right", "door.open")
_DURATIONS = ("0.25 s", "0.5 s", "1 s", "1.5 s")
_LENGTHS = ("0 m", "0.3 m", "1 m")
_CLAIMS = ("never", "always", "recurrence", "response", "precedence")


@dataclass
class _Writer:
    """Writes one machine.

    Attributes:
        draw: what is random.
        lines: the text so far.
        states: names of all its states that can be active.
        leaves: names of those without states inside.
        count: how many states there are.
        talks: whether events carry data, and some are deferred.
    """

    draw: random.Random
    prefix: str
    lines: list[str] = field(default_factory=list)
    states: list[str] = field(default_factory=list)
    count: int = 0
    talks: bool = False

    def chance(self, share: float) -> bool:
        return self.draw.random() < share

    def condition(self, *, variables: bool = True) -> str:
        kinds = ["flag", "flag", "length", "steps", "light"] + (["n", "d", "seen", "hue"] if variables else [])
        kind = self.draw.choice(kinds)
        match kind:
            case "flag":
                text = self.draw.choice(_FLAGS)
            case "length":
                text = f"ahead {self.draw.choice(('<', '>', '<=', '>='))} {self.draw.choice(_LENGTHS)}"
            case "steps":
                text = f"steps {self.draw.choice(('<', '>', '=='))} {self.draw.randint(0, 2)}"
            case "light":
                text = f"light == {self.draw.choice(('red', 'green'))}"
            case "n":
                text = f"n {self.draw.choice(('<', '>', '==', '>='))} {self.draw.randint(0, 3)}"
            case "d":
                text = f"d {self.draw.choice(('<', '>', '<='))} {self.draw.choice(_LENGTHS)}"
            case "seen":
                text = "seen"
            case _:
                text = f"hue == {self.draw.choice(('red', 'green'))}"
        if self.chance(0.25):
            text = f"not ({text})"
        if self.chance(0.25):
            text = f"{text} {self.draw.choice(('and', 'or'))} {self.condition(variables=variables)}"
        return f"({text})" if " or " in text else text

    def actions(self) -> str:
        kinds = {
            "n += 1": 3,
            "n = 0": 1,
            "n = steps": 1,
            "n -= 1": 1,
            "d = ahead": 2,
            "d += 0.1 m": 1,
            "seen = space.left": 1,
            "hue = light": 1,
            "raise tick": 1,
            f"seen = {self.condition()}": 1,
            "log(n)": 1,
            f"raise late after {self.draw.choice(_DURATIONS)}": 1,
        }
        if self.talks:
            kinds |= {"raise pick(n, d)": 1, "raise pick(steps, 0.3 m)": 1, "raise pick(2, d) after 0.5 s": 1}
        if self.chance(0.6):
            return ""
        chosen = self.draw.choices(list(kinds), list(kinds.values()), k=self.draw.choice((1, 1, 2)))
        return " / " + ", ".join(dict.fromkeys(chosen))

    def machine(self, name: str, part: str | None, *, two_regions: bool) -> str:
        self.lines = [f"machine {name}", ""]
        if part is not None:
            self.lines.append(f"import {part}")
        self.lines += [
            "event go, back, tick, late" + ", pick(number : int, far : length)" * self.talks,
            "var n : int = 0",
            "var d : length = 0 m",
            "var seen : bool = false",
            "var hue : Light = red",
            "PROPERTIES",
        ]
        if two_regions:
            self.lines.append("parallel both")
            for region in ("one", "two"):
                self.lines.append(f"    state {region}")
                self.states.append(region)
                self.block(8, part if region == "one" else None)
        else:
            self.block(0, part)
        text = "\n".join(self.lines) + "\n"
        return text.replace("PROPERTIES", "\n".join(self.properties()))

    def block(self, indent: int, part: str | None) -> None:
        """Some states side by side."""
        names = [f"{self.prefix}{self.count + number}" for number in range(self.draw.choice((2, 3, 3, 4)))]
        self.count += len(names)
        compound = self.draw.choice(names) if self.chance(0.35) and self.count < 9 else None
        final = f"{self.prefix}over" if self.chance(0.3) and indent in (0,) else None
        targets = [
            *names,
            *([f"{compound}.history"] if compound is not None and self.chance(0.7) else []),
            *([final] if final else []),
        ]
        pad = " " * indent
        self.lines.append(f"{pad}initial {names[0]}")
        instance = self.draw.choice(names[1:]) if part is not None else None
        for name in names:
            self.states.append(name)
            if name == instance:
                self.lines.append(f"{pad}state {name} = {part}()")
                self.lines.append(f"{pad}    on finished -> {self.draw.choice(targets)}{self.actions()}")
            else:
                self.state(name, indent, targets, compound=name == compound)
        if final is not None:
            self.lines.append(f"{pad}final {final}")

    def state(self, name: str, indent: int, targets: list[str], *, compound: bool) -> None:
        pad = " " * (indent + 4)
        self.lines.append(f"{' ' * indent}state {name}")
        outcomes: list[str] = []
        if not compound and self.chance(0.7):
            activity = self.draw.choice(list(_ACTIVITIES))
            self.lines.append(f"{pad}do {activity}")
            outcomes = _ACTIVITIES[activity]
        if self.chance(0.15):
            self.lines.append(f"{pad}entry{self.actions() or ' / n += 1'}")
        for _ in range(self.draw.choice((1, 2, 2, 3))):
            self.transition(pad, outcomes, targets)
        if self.talks:
            self.talking(pad, targets)
        if compound:
            self.block(indent + 4, None)

    def transition(self, pad: str, outcomes: list[str], targets: list[str]) -> None:
        trigger = self.draw.choice(["when", "when", "after", "after if", "on", "event", "held", "every", "any"])
        guard = f" if {self.condition()}" if self.chance(0.3) else ""
        match trigger:
            case "when":
                head = f"when {self.condition()}"
            case "after":
                head = f"after {self.draw.choice(_DURATIONS)}"
            case "after if":
                head = f"after {self.draw.choice(_DURATIONS)} if {self.condition()}"
            case "held":
                head = f"when {self.condition()} for {self.draw.choice(_DURATIONS)}{guard}"
            case "every":
                head = f"every {self.draw.choice(_DURATIONS)}{guard}"
            case "any" if self.chance(0.3):
                head = f"on *{guard}"
            case "on" if outcomes:
                head = f"on {self.draw.choice(outcomes)}{guard}"
            case _:
                head = f"on {self.draw.choice(('go', 'back', 'tick', 'late'))}{guard}"
        stays = trigger in ("held", "every") and self.chance(0.6)
        target = "" if stays else f" -> {self.draw.choice(targets)}"
        self.lines.append(f"{pad}{head}{target}{self.actions() or ' / n += 1' * stays}")

    def talking(self, pad: str, targets: list[str]) -> None:
        """Lines about events with data, and deferred ones."""
        if self.chance(0.35):
            self.lines.append(f"{pad}defer {self.draw.choice(('go', 'pick', 'back', 'go, pick'))}")
        if self.chance(0.6):
            guard = self.draw.choice(
                (
                    "",
                    " if pick.number > 1",
                    " if pick.far < 0.3 m and n < 3",
                    " if pick.number == n",
                    " if pick.far > d",
                )
            )
            actions = self.draw.choice(
                ("", " / n = pick.number", " / d = pick.far", " / n += 1, d = pick.far", " / raise pick(0, pick.far)")
            )
            if "raise" in actions and " if " not in guard:
                guard = " if pick.number > 0"
            target = f" -> {self.draw.choice(targets)}" if self.chance(0.7) else ""
            if target or actions:
                self.lines.append(f"{pad}on pick{guard}{target}{actions}")

    def properties(self) -> list[str]:
        return [f"property p{number} : {self.claim()}" for number in range(3)]

    def claim(self) -> str:
        def place() -> str:
            text = f"in({self.draw.choice(self.states)})"
            if self.chance(0.3):
                text = f"{text} {self.draw.choice(('and', 'or'))} {self.condition()}"
            return f"({text})" if self.chance(0.7) else f"not ({text})"

        within = self.draw.choice(("0.6 s", "1 s", "1.7 s", "3 s"))
        match self.draw.choice(_CLAIMS):
            case "never":
                return f"never {place()}"
            case "always":
                return f"always {self.draw.choice((place(), self.condition(), 'n <= 3', 'd < 1 m', 'n >= 0'))}"
            case "recurrence":
                return f"always eventually {place()} within {within}"
            case "response":
                return f"after {place()}, {place()} within {within}"
        return f"after {place()}, {place()} before {place()}"


@cache
def _library() -> object:
    return make_library()


def drawn_text(seed: int) -> dict[str, str]:
    """The files of a machine, by name; the last one is the machine. Those of seeds from a million on have messages."""
    talks = seed >= TALKING * 1000
    draw = random.Random(seed)
    files = {}
    part = None
    if draw.random() < 0.25:
        part = "part"
        writer = _Writer(draw, "p", talks=talks)
        text = writer.machine(part, None, two_regions=False)
        if "final pover" in text:
            text = text.replace("pover", "finished")
        else:
            text += "final finished\n"
            text = text.replace("state p0\n", "state p0\n    after 1 s if space.right -> finished\n", 1)
        files["part.maze-machine"] = text
    files["m.maze-machine"] = _Writer(draw, "s", talks=talks).machine("m", part, two_regions=draw.random() < 0.35)
    return files


def drawn_machine(seed: int) -> Machine:
    """A machine drawn at random: the first with this seed, or one after it, that the language accepts."""
    for attempt in range(100):
        with TemporaryDirectory() as folder:
            for name, text in drawn_text(seed * 1000 + attempt).items():
                (Path(folder) / name).write_text(text, encoding="utf-8")
            try:
                return Machine(load_model(Path(folder) / "m.maze-machine", _library()))
            except MachineError:
                continue
    raise AssertionError(f"nothing that is drawn from {seed} is a machine")


@dataclass(frozen=True)
class Crossed:
    """What was found out of one machine.

    Attributes:
        seed: what it was drawn from.
        proved: properties that were proved.
        shown: those with a run that violates them.
        undecided: all others.
        contradicted: those that were proved and then violated by a random run.
        missed: those that a random run violates and that were not decided.
    """

    seed: int
    proved: tuple[str, ...]
    shown: tuple[str, ...]
    undecided: tuple[str, ...]
    contradicted: tuple[str, ...]
    missed: tuple[str, ...]


def cross_checked(seed: int, runs: int, seconds: float = 10.0) -> Crossed:
    """Decide the properties of a machine, and try to contradict what was proved by random runs.

    That a violation replays is asserted by running its scenario again.
    """
    machine = drawn_machine(seed)
    verdicts = check(machine, seconds=seconds)
    for one in verdicts:
        if one.violated and one.name != NO_FAULT:
            assert replays(machine, one), f"seed {seed}: {one.name} does not replay"
    shown = {one.name for one in verdicts if one.violated}
    open_ones = {one.name for one in verdicts} - shown  # what a run shows already is not contradicted by another
    violated = RandomRuns(machine, seed).violated(runs, open_ones) if open_ones else set[str]()
    return Crossed(
        seed,
        tuple(one.name for one in verdicts if one.proved),
        tuple(one.name for one in verdicts if one.violated),
        tuple(one.name for one in verdicts if not (one.proved or one.violated)),
        tuple(one.name for one in verdicts if one.proved and one.name in violated),
        tuple(one.name for one in verdicts if not (one.proved or one.violated) and one.name in violated),
    )


def replays(machine: Machine, verdict: PropertyVerdict) -> bool:
    """Whether the counterexample of a property violates it on the engine."""
    assert verdict.counterexample is not None
    watch = property_watch(machine.model.properties)
    seen: list[str] = []

    def look(driver: Driver) -> None:
        seen.extend(watch(driver))

    def watched(driver: Driver) -> str | None:
        look(driver)
        return None

    title = verdict.counterexample.name
    tick = float(title.partition("(tick ")[2].partition(" s")[0] or LONGEST_TICK)
    result = run_scenario(verdict.counterexample, machine, tick, [watched])
    return verdict.name in seen and result.failure is None
