"""Random runs of a machine on the engine with its monitor, biased towards what can matter.

Most runs continue one of the earlier runs from where it was: a run is what comes before that place, and what it adds.
Places from which few runs went on come first. While nothing changes, time passes to the next deadline at once: the
steps between do nothing.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from math import inf
from typing import Any

from hsm.engine.machine import Machine
from hsm.engine.monitoring import Memory, Monitor, begin, deadline, holding, look
from hsm.engine.record import took_something
from hsm.engine.run import Supervisor
from hsm.engine.snapshots import SavedRun
from hsm.model.expressions import SignalValue
from hsm.model.faults import MachineFault
from hsm.model.messages import Occurrence
from hsm.model.properties import conditions_of
from hsm.model.rewriting import expressions_of, parts_of
from hsm.testing.proofs.verdicts import NO_FAULT
from hsm.testing.scenarios.script import Script, scripted_machine
from tests.trust.library import Light

LONGEST_TICK = 0.1
MOST_PLACES = 400
NEAR = 1e-5
"""Seconds before a deadline in which a step may already meet it."""

FAULT_COSTS = 20
"""As many runs a place counts as having continued, when one of them fails: an endless sequence costs as much."""

MOST_ROUNDS = 120
"""A run ends after this many rounds, each with one step that does something, or with a pause."""


@dataclass
class _Place:
    """Where a run was.

    Attributes:
        run: it.
        memories: of the properties.
        signals: the values of the last step.
        rounds: how many it has taken.
        continued: how many runs went on from here.
    """

    run: SavedRun
    memories: tuple[Memory, ...]
    signals: Mapping[str, Any]
    rounds: int
    continued: int = 0


@dataclass
class _Going:
    """A run that goes on.

    Attributes:
        run: the machine.
        script: what it perceives.
        memories: of the properties.
        rounds: how many it has taken.
        time: of the last step, including those that do nothing.
    """

    run: Supervisor
    script: Script
    memories: list[Memory]
    rounds: int
    time: float
    monitor: Monitor | None = None


class RandomRuns:
    """Runs of one machine with signals, outcomes, events and waiting times at random, near what can matter.

    Args:
        machine: the machine.
        seed: of all that is random.
        watch: makes a further monitor of a run, or of what one adds to an earlier one.

    Attributes:
        values: those worth trying of each signal.
        steps: how many steps the engine has taken, those that runs have in common once.
        faults: how many runs ended in a fault.
    """

    def __init__(self, machine: Machine, seed: int, watch: Callable[[Supervisor], Monitor] | None = None) -> None:
        self._machine, self._watch = scripted_machine(machine), watch
        self._random = random.Random(seed).random
        model = self._machine.model
        conditions = [
            *expressions_of(model),
            *(one for stated in model.properties for one in conditions_of(stated.claim)),
        ]
        asked = {part.signal.name for one in conditions for part in parts_of(one) if isinstance(part, SignalValue)}
        self._events = sorted(model.events or ())
        self._outcomes = {
            state.name: state.activity.activity.outcomes
            for state in model.states
            if state.activity is not None and state.activity.activity.outcomes
        }
        self.values = {name: worth_trying(name) for name in sorted(asked)}
        self.steps = 0
        self.faults = 0
        self._places: dict[Any, _Place] = {}
        self._order: list[_Place] = []
        self._last: _Place | None = None

    def violated(self, runs: int, among: Collection[str] | None = None, rounds: int = 3) -> set[str]:
        """The names of the properties that some of so many runs violate.

        Args:
            runs: how many.
            among: the properties that are watched; by default all.
            rounds: how many rounds a run adds on average to the one that it continues.
        """
        self._watched = [one for one in self._machine.model.properties if among is None or one.name in among]
        self._scoped = any(one.scope is not None for one in self._watched)
        self._found: set[str] = set()
        self._places.clear()
        self._order = []
        for _ in range(runs):
            try:
                self._run(1 + int(2 * rounds * self._random()))
            except MachineFault:
                self.faults += 1
                self._found.add(NO_FAULT)
                if self._last is not None:
                    self._last.continued += FAULT_COSTS
        return self._found

    def _pick(self, some: Any) -> Any:
        return some[int(self._random() * len(some))]

    def _begun(self) -> _Going:
        """A new run, or an earlier one where it was."""
        if self._order and self._random() > 0.1:
            place = min((self._pick(self._order) for _ in range(3)), key=lambda one: one.continued)
            place.continued += 1
            self._last = place
            saved = replace(place.run, state=copy(place.run.state))
            run: Supervisor = Supervisor(self._machine, saved)
            return _Going(run, Script(dict(place.signals)), list(place.memories), place.rounds, saved.time)
        self._last = None
        script = Script({name: self._pick(values) for name, values in self.values.items()})
        run = self._machine.start(facts=script)
        return _Going(run, script, [begin(one, run.time) for one in self._watched], 0, run.time)

    def _run(self, rounds: int) -> None:
        going = self._begun()
        going.monitor = None if self._watch is None else self._watch(going.run)
        chance, pick = self._random, self._pick
        calm = pick((0.0, 0.3, 0.8, 0.95))
        if not going.rounds:
            self._step(going, going.time, self._heard(calm))
        for _ in range(min(rounds, MOST_ROUNDS - going.rounds)):
            if going.run.outcome is not None:
                return
            going.rounds += 1
            if chance() < 0.4:
                if not self._step(going, going.time + LONGEST_TICK, ()):
                    self._pause(going)
                continue
            self._act(going, calm)
            if chance() > calm:
                for name, values in self.values.items():
                    if chance() < 0.5:
                        going.script.signals[name] = pick(values)
            wait = pick((0.0, LONGEST_TICK, LONGEST_TICK, LONGEST_TICK, 0.05, chance() * LONGEST_TICK))
            self._step(going, going.time + wait, self._heard(calm))
        if going.run.outcome is None and going.rounds < MOST_ROUNDS:
            self._keep(going)

    def _step(self, going: _Going, time: float, events: Sequence[str | Occurrence]) -> bool:
        """A step with its monitors; whether it did anything."""
        self.steps += 1
        step = going.run.step(time, events, going.script)
        if going.monitor is not None:
            going.monitor.look(going.script, step)
        moved = took_something(step.raw)
        self._look(going, time, step.entered if moved and self._scoped else ())
        return moved

    def _look(self, going: _Going, time: float, entered: Collection[str] = ()) -> None:
        going.time = time
        holds, memories = holding(going.run, going.script), going.memories
        for number, one in enumerate(self._watched):
            memories[number], wrong = look(one, memories[number], time, holds, entered)
            if wrong:
                self._found.add(one.name)

    def _pause(self, going: _Going) -> None:
        """Continue with the last step before something is due: those until then do nothing."""
        run, time = going.run, going.time
        ends = (deadline(*one) for one in zip(self._watched, going.memories, strict=True))
        until = min((one for one in (run.due, *ends) if one is not None and one > time), default=inf)
        room = until - time - NEAR
        if until == inf or self._random() < 0.2:
            room = min(room, self._random() * 3.0)
        if run.outcome is None and run.due > time and room >= LONGEST_TICK:
            self._look(going, time + int(room / LONGEST_TICK) * LONGEST_TICK)

    def _keep(self, going: _Going) -> None:
        """Let later runs continue here, if this place is like no other one, or sometimes instead of the other one."""
        saved = going.run._run()  # as `Machine.restore` would have it, without a way through text
        state = saved.state
        about = tuple(None if one is None else one == -inf for one in going.memories)
        key = (state.configuration.names, tuple(map(repr, state.values)), tuple(sorted(state.timers)), about)
        if key not in self._places and len(self._places) >= MOST_PLACES:
            del self._places[self._pick(list(self._places))]
        elif key in self._places and self._random() < 0.7:
            return
        kept = replace(saved, time=going.time, state=copy(state))
        self._places[key] = _Place(kept, tuple(going.memories), dict(going.script.signals), going.rounds)
        self._order = list(self._places.values())

    def _heard(self, calm: float) -> Sequence[str | Occurrence]:
        if not self._events or self._random() < 0.3 + calm / 2:
            return ()
        return [self._carrying(self._pick(self._events)) for _ in range(self._pick((1, 1, 2)))]

    def _carrying(self, event: str) -> str | Occurrence:
        if self._machine.model.data_of(event) is None:
            return event
        number, far = self._pick((-1, 0, 1, 2, 3, 4)), self._pick((0.0, 0.1, 0.3, 0.5, 1.0, 2.0, -1.0))
        return Occurrence(event, {"number": number, "far": far})

    def _act(self, going: _Going, calm: float) -> None:
        """Let activities report, some of them."""
        run, script = going.run, going.script
        script.reports = {
            name: self._pick(self._outcomes[name])
            for name in run.configuration
            if name in self._outcomes and self._random() > 0.5 + calm / 2
        }
        if script.reports:
            run.act(script)
            script.reports = {}


def worth_trying(name: str) -> list[object]:
    """Values of a signal on which something may depend."""
    match name:
        case "ahead":
            near = [math.nextafter(one, side) for one in (0.0, 0.3, 1.0) for side in (-math.inf, math.inf)]
            return [0.0, 0.3, 1.0, 0.5, 2.0, -1.0, *near, math.nan, math.inf]
        case "steps":
            return [-1, 0, 1, 2, 3, 5]
        case "light":
            return [Light.RED, Light.GREEN]
    return [False, True]
