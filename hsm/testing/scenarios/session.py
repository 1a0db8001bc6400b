"""A machine without its robot, driven interactively: every accepted line is a line of a scenario."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import groupby, repeat
from typing import Any

from hsm.engine.machine import Machine
from hsm.engine.snapshots import SnapshotError
from hsm.interchange.reports import transition_text
from hsm.model.diagnostics import MachineError
from hsm.model.faults import MachineFault
from hsm.model.registry import Library
from hsm.model.types import Type
from hsm.model.unparse import trigger_text, value_text
from hsm.model.values import dataclass
from hsm.testing.scenarios.breaks import Break, transitions_of_line
from hsm.testing.scenarios.driver import TICK, Driver
from hsm.testing.scenarios.prospects import Prospect, prospects
from hsm.testing.scenarios.reading import parse_assignment, parse_expectation, parse_suite
from hsm.testing.scenarios.running import await_claims, performed_text, unmet_claims
from hsm.testing.scenarios.scenarios import Expectation, Scenario, Stimulus
from hsm.testing.scenarios.script import scripted_machine
from hsm.testing.scenarios.watching import property_watch

_LINES = ("given", "when", "after", "expect")
"""The words that begin the lines of a scenario."""
_SET = "set"
"""The word that begins a line that sets a variable, which no scenario can do."""
_SAME = 1e-9
"""Times that are so near to each other are the same, s."""
_TICK = f"after {TICK} s"
"""One tick as a line."""


class SessionError(Exception):
    """A line that cannot be executed; the message says why."""


@dataclass(frozen=True, slots=True)
class Moment:
    """The state of a run, and the events since the previous moment.

    Attributes:
        time: seconds since the start.
        states: the active states, in document order.
        doing: what the activities of active states are asked to do.
        variables: variables and parameters by name, as text.
        taken: the transitions that were taken, with their lines.
        called: the actions that were called.
        raised: the events that the machine raised.
        violated: the properties that did not hold in a step of it, with what they say.
        outcome: the final state that ended the run, or None.
    """

    time: float
    states: tuple[str, ...]
    doing: tuple[str, ...]
    variables: Mapping[str, str]
    taken: tuple[str, ...]
    called: tuple[str, ...]
    raised: tuple[str, ...]
    violated: tuple[str, ...]
    outcome: str | None


@dataclass(slots=True)
class _Seen:
    """The results of a line."""

    taken: list[str] = field(default_factory=list)
    called: list[str] = field(default_factory=list)
    raised: list[str] = field(default_factory=list)
    violated: dict[str, None] = field(default_factory=dict)


class _Break(Exception):  # noqa: N818 - how a wait ends early
    """A condition to stop at holds."""


class Session:
    """One run of a machine, driven by the lines of a scenario, with undo.

    Attributes:
        machine: the machine's name.
        lines: the lines that were accepted, in order.
        driver: the run itself.
    """

    def __init__(
        self,
        machine: Machine,
        library: Library[Any, Any],
        parameters: Mapping[str, Any] | None = None,
        *,
        watch: Callable[[Driver], None] = lambda _: None,
    ) -> None:
        """Start a run.

        Args:
            machine: the machine.
            library: what it was checked against.
            parameters: its parameters, in SI units.
            watch: called after each step, also where the run is played again in order to go back.

        Raises:
            SessionError: it cannot start.
        """
        self._machine = scripted_machine(machine)
        self._model = machine.model
        self.machine = machine.model.name
        self._library = library
        self._parameters = dict(parameters or {})
        self._types: dict[str, Type] = {one.name: one.type for one in self._model.parameters}
        self._types.update((one.name, one.type) for one in self._model.variables)
        self.lines: list[str] = []
        self._break: Break | None = None
        self._held = False  # whether the condition to stop at held after the last step
        self._seen = _Seen()
        self._watching = watch
        self._ends: list[float] = []  # when each line was done
        self.driver = self._started()

    @property
    def moment(self) -> Moment:
        """Where the run is."""
        driver, seen = self.driver, self._seen
        return Moment(
            driver.time,
            tuple(sorted(driver.configuration, key=driver.machine.indices.__getitem__)),
            tuple(f"{state}: {performed_text(driver, state)}" for state in driver.doing),
            {name: value_text(value, self._types.get(name)) for name, value in driver.variables.items()},
            tuple(seen.taken),
            tuple(seen.called),
            tuple(seen.raised),
            tuple(seen.violated),
            driver.outcome,
        )

    def do(self, line: str) -> Moment:
        """Execute one line of a scenario.

        Args:
            line: such as ``when door.near, not space.front``, ``when rotate reports done``, ``after 2 s``,
                ``when event go``, ``expect driving`` or ``given door.near``, which begins again with that; or
                ``set turns = 2``, which gives a variable a value at once.

        Raises:
            SessionError: it cannot be read, what it expects does not hold, or the run has ended.
        """
        text = line.strip()
        if _word(text) == "given":
            given = [one for one in self.lines if one.startswith("given")]
            rest = [one for one in self.lines if not one.startswith("given")]
            self._replay([*given, text, *rest])
            return self.moment
        self._seen = _Seen()
        if _word(text) == _SET:
            self._assign(text)
        else:
            for step in self._read([text]).steps:
                text = self._perform(step, text)
        return self._done(text)

    def check(self, line: str) -> None:
        """Parse a line without executing it.

        Raises:
            SessionError: it cannot be read.
        """
        self._read([line.strip()])

    def tick(self) -> Moment:
        """Let one tick pass."""
        self._seen = _Seen()
        return self._done(self._perform(Stimulus(TICK), _TICK))

    def back(self, count: int = 1) -> Moment:
        """Undo lines: the run is repeated without them.

        Raises:
            SessionError: there are not that many.
        """
        if count > len(self.lines):
            raise SessionError(f"there {'is' if len(self.lines) == 1 else 'are'} {len(self.lines)} to take back")
        self._replay(self.lines[: len(self.lines) - count])
        return self.moment

    def back_to(self, time: float) -> Moment:
        """Undo everything after a time.

        Args:
            time: seconds since the start.

        Raises:
            SessionError: what remains cannot be done again.
        """
        self._replay(self.lines[: bisect_right(self._ends, time + _SAME)])
        rest = time - self.driver.time
        return self.do(f"after {rest:.10g} s") if rest > _SAME else self.moment

    def stop_when(self, condition: str | None) -> None:
        """Stop waits where a condition becomes true.

        Args:
            condition: what an ``expect`` line may say, such as ``in_door`` or ``turns == 2``; or ``line 12`` for the
                transitions that are written there, ``door:12`` for those of an imported file; None to take it back.

        Raises:
            SessionError: it cannot be read, or there is no transition in that line.
        """
        if condition is None:
            self._break = None
            return
        try:
            there = transitions_of_line(condition, self._model)
        except ValueError as error:
            raise SessionError(str(error)) from None
        if there is not None:
            taken = there
            self._break = Break(lambda driver: any(one.index in taken for one in driver.last.transitions), lasts=False)
            return
        expected = self.condition(condition)
        self._break = Break(lambda driver: not unmet_claims(driver, expected.claims), lasts=True)
        self._held = self._break.met(self.driver)

    def condition(self, text: str) -> Expectation:
        """What an ``expect`` line says.

        Raises:
            SessionError: it cannot be read.
        """
        try:
            return parse_expectation(text, self._model, self._library, "session")
        except MachineError as error:
            raise _unreadable(error) from None

    def why(self, state: str | None = None) -> list[str]:
        """The verdicts about the transitions that the last step considered, and about those of the active states.

        Args:
            state: only those of this state, by its own name or its full one.

        Raises:
            SessionError: there is no such state.
        """
        states = self._machine.model.states
        names = [one.name for one in states[1:]]
        if state is not None:
            full = [one for one in names if one == state or one.rpartition(".")[2] == state]
            if not full:
                raise SessionError(f"there is no state `{state}`; the states: {', '.join(names)}")
        looked = [
            one for one in self.driver.last.verdicts if state is None or states[one.transition.source].name in full
        ]
        if not looked:
            return ["the state is not active, or it has no transitions"]
        return [
            f"line {one.transition.place.line if one.transition.place else '-'}: "
            f"{trigger_text(one.transition.trigger, one.transition.guard)}: {one.reason}"
            for one in looked
        ]

    def prospects(self) -> list[Prospect]:
        """For each transition of the active states: what makes it fire next, or why nothing does.

        Raises:
            SessionError: it cannot be tried.
        """
        try:
            return prospects(self.driver)
        except SnapshotError as error:
            raise SessionError(str(error)) from None

    def microsteps(self) -> list[Moment]:
        """The run after each microstep of the last step."""
        seen, moments = self._seen, list[Moment]()
        for step, variables in self.driver.microsteps():
            taken = step.microsteps[-1].transitions
            states = sorted(step.configuration, key=self.driver.machine.indices.__getitem__)
            texts = {name: value_text(value, self._types.get(name)) for name, value in variables.items()}
            lines = tuple(transition_text(self._model, one) for one in taken)
            moments.append(replace(self.moment, states=tuple(states), variables=texts, taken=lines, doing=()))
        if moments:
            moments[-1] = replace(self.moment, taken=moments[-1].taken, called=tuple(seen.called))
        return moments

    def scenario(self, name: str) -> str:
        """The session as a scenario: what was done and, at the end, where that led.

        Raises:
            SessionError: a variable was set by hand.
        """
        by_hand = [one for one in self.lines if _word(one) == _SET]
        if by_hand:
            raise SessionError(f"`{by_hand[0]}` cannot be part of a scenario; `back` takes lines back")
        moment = self.moment
        states = self._machine.model.states
        expected = ", ".join(one for one in moment.states if not states[self._machine.indices[one]].children)
        done = list(_together(self.lines))
        body = [*done, f"expect {expected}"] if expected else done
        return f"scenario {name}\n" + "".join(f"    {line}\n" for line in body)

    # How it is done.

    def _done(self, line: str) -> Moment:
        self.lines.append(line)
        self._ends.append(self.driver.time)
        return self.moment

    def _started(self, given: Mapping[Any, Any] | None = None, parameters: Mapping[str, Any] | None = None) -> Driver:
        values = {**self._parameters, **(parameters or {})}
        self._look = property_watch(self._model.properties)
        try:
            return Driver(self._machine, values, given, watch=self._watch)
        except (MachineFault, ValueError, TypeError) as error:
            raise SessionError(str(error)) from None

    def _replay(self, lines: Sequence[str]) -> None:
        """Restart and execute lines; if one fails, restore the previous state."""
        stop = self._break
        before = self.driver, self.lines, self._ends, self._seen
        scenario = self._read([one for one in lines if _word(one) != _SET])
        steps = iter(scenario.steps)
        try:
            self._break, self.lines, self._ends, self._seen = None, list(lines), [], _Seen()
            self.driver = self._started(scenario.given, scenario.parameters)
            for line in lines:
                self._seen = _Seen()
                if _word(line) == _SET:
                    self._assign(line)
                elif _word(line) != "given":
                    self._perform(next(steps), "")
                self._ends.append(self.driver.time)
        except SessionError:
            self.driver, self.lines, self._ends, self._seen = before
            self._break = stop
            raise
        self._break = stop
        self._held = stop is not None and stop.lasts and stop.met(self.driver)

    def _read(self, lines: Sequence[str]) -> Scenario:
        for line in lines:
            if _word(line) not in _LINES:
                raise SessionError(f"a line begins with {', '.join(_LINES)}; `help` lists the other commands")
        # A scenario needs an expectation; the one added here is dropped again.
        last = f"expect {self._model.states[1].name}"
        text = f"test {self._model.name}\nscenario session\n" + "".join(f"    {line}\n" for line in (*lines, last))
        try:
            suite = parse_suite(text, self._model, self._library, "session")
        except MachineError as error:
            raise _unreadable(error) from None
        (scenario,) = suite.scenarios
        return replace(scenario, steps=scenario.steps[:-1])

    def _assign(self, line: str) -> None:
        """Do a line that sets a variable."""
        try:
            name, value = parse_assignment(line.removeprefix(_SET), self._model, self._library, "session")
        except MachineError as error:
            raise _unreadable(error) from None
        try:
            self.driver.assign(name, value)
        except SnapshotError as error:
            raise SessionError(str(error)) from None

    def _perform(self, step: Stimulus | Expectation, text: str) -> str:
        """Execute a step; return the line for it, which is shorter if a wait was stopped."""
        driver = self.driver
        if driver.outcome is not None and isinstance(step, Stimulus):
            raise SessionError(f"the machine has ended, as {driver.outcome}; `back` takes lines back")
        began = driver.time
        try:
            if isinstance(step, Expectation):
                if unmet := await_claims(driver, step):
                    raise SessionError(f"not true: {', '.join(one.text for one in unmet)}")
                return text
            driver.perform(step)
        except _Break:
            waited = driver.time - began
            whole = isinstance(step, Stimulus) and waited >= (step.after or 0.0) - _SAME
            return text if whole else f"after {waited:.10g} s"
        except LookupError as error:
            raise SessionError(str(error.args[0])) from None
        except MachineFault as error:
            raise SessionError(str(error)) from None
        return text

    def _watch(self, driver: Driver) -> None:
        """After each step: remember what was done, and stop a wait at the break."""
        self._seen.taken += [transition_text(self._model, one) for one in driver.last.transitions]
        self._seen.called += [one.name for one in driver.calls]
        self._seen.raised += driver.raised
        texts = {one.name: one.text for one in self._model.properties}
        self._seen.violated.update((f"{name}: {texts[name]}", None) for name in self._look(driver))
        self._watching(driver)
        if self._break is not None and driver.time > 0:
            before, self._held = self._held, self._break.met(driver)
            if self._held and not (before and self._break.lasts):
                raise _Break


def _word(line: str) -> str:
    """What a line begins with."""
    return line.partition(" ")[0]


def _unreadable(error: MachineError) -> SessionError:
    found = error.diagnostics[0]
    return SessionError(found.message + (f"; {found.suggestion}" if found.suggestion else ""))


def _together(lines: Iterable[str]) -> Iterator[str]:
    """The lines with ticks that follow one another as one wait."""
    for line, same in groupby(lines):
        count = len(list(same))
        if line == _TICK:
            yield f"after {count * TICK:.10g} s"
        else:
            yield from repeat(line, count)
