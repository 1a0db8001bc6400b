"""The rules of a step, written a second time: SCXML's algorithm (W3C, appendix D) with the language's differences.

It follows the procedures of the recommendation and the text of ``docs/reference/language.md``. It shares nothing with
the engine but the declarations: no plans, no generated code, no caches. It is slow and easy to compare with the text.
The data of SCXML is left out.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from fractions import Fraction

from hsm.model.chart import (
    After,
    Assign,
    Call,
    Cancel,
    Defer,
    Emit,
    Every,
    Held,
    Model,
    On,
    Raise,
    Send,
    StateKind,
    Transition,
    TransitionKind,
    When,
)
from hsm.model.expressions import (
    Active,
    Binary,
    Choice,
    EventValue,
    Expression,
    Literal,
    SignalValue,
    Unary,
    VariableValue,
)

ENDLESS = 150
"""A step with more microsteps is taken for one without end."""
HISTORY = (StateKind.SHALLOW_HISTORY, StateKind.DEEP_HISTORY)


class UnhandledFaultError(Exception):
    """A fault that no transition handles."""


class EndlessError(UnhandledFaultError):
    """A step with too many microsteps."""


class SignalError(Exception):
    """A signal that failed."""


class ActionError(Exception):
    """An action that failed, with what it belongs to."""

    def __init__(self, state: int, exits: bool) -> None:
        self.state = state
        self.exits = exits


@dataclass(frozen=True)
class Happened:
    """An event: by name, or from a state.

    Attributes:
        names: what the state that it comes from and the states around it call it.
        origin: the state that it comes from; None for one from outside or raised.
        own: what that state alone calls it.
        data: what it carries, by the names of its parts.
    """

    names: tuple[str, ...]
    origin: int | None = None
    own: tuple[str, ...] = ()
    data: Mapping[str, object] = field(default_factory=dict)


@dataclass
class Memory:
    """What lasts from step to step."""

    active: set[int] = field(default_factory=set)
    values: dict[str, object] = field(default_factory=dict)
    history: dict[int, list[int]] = field(default_factory=dict)
    deadlines: dict[int, Fraction] = field(default_factory=dict)
    acted: set[int] = field(default_factory=set)
    delayed: list[tuple[Fraction, Happened, str | None]] = field(default_factory=list)
    deferred: list[Happened] = field(default_factory=list)
    over: set[int] = field(default_factory=set)
    outcome: str | None = None

    def copy(self) -> Memory:
        """Another one, which does not change with this one."""
        parts = {one.name: getattr(self, one.name) for one in fields(self)}
        return Memory(
            **{name: part if part is None or isinstance(part, str) else part.copy() for name, part in parts.items()}
        )


class PlainRun:
    """A run of a machine.

    Attributes:
        memory: where it is.
        done: for each microstep of the last step its transitions, and the states left and entered, in order.
        sent: the names of the events that the last step has sent to other machines.
    """

    def __init__(self, model: Model, facts: object) -> None:
        self.model = model
        self.states = model.states
        self.around: list[list[int]] = []
        for state in model.states:
            self.around.append([state.parent, *self.around[state.parent]] if state.index else [])
        self.memory = Memory()
        self._begin_step(Fraction(0), facts)
        self.memory.values = {
            one.name: self._value(one.initial) for one in model.variables if one.scope == 0 or one.exposed
        }
        to_enter: set[int] = set()
        defaults: set[int] = set()
        histories: dict[int, int] = {}
        self._targets_down(self.states[0].initial, 0, to_enter, defaults, histories)
        self._enter({0, *to_enter}, {0, *defaults}, histories)
        self._stabilise()
        self._drain()

    # One step.

    def step(self, time: Fraction, outcomes: Iterable[Happened], events: Iterable[Happened], facts: object) -> None:
        """React to inputs; after a fault that is not handled everything is as before."""
        before = self.memory.copy()
        self._begin_step(time, facts)
        try:
            self._step(outcomes, events)
        except UnhandledFaultError:
            self.memory = before
            raise

    def _begin_step(self, time: Fraction, facts: object) -> None:
        self.done: list[tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]] = []
        self.time, self.facts = time, facts
        self.internal: deque[Happened] = deque()
        self.external: deque[Happened] = deque()
        self.moved = False
        self.reported: set[tuple[int, str]] = set()
        self.found: list[Happened] = []
        self.undone: set[int] = set()
        self.skipped: set[int] = set()
        self.taken = 0
        self.sent: list[str] = []
        self.handled: Happened | None = None

    def _step(self, outcomes: Iterable[Happened], events: Iterable[Happened]) -> None:
        memory = self.memory
        if memory.outcome is not None:
            return
        arrived = sorted((one for one in memory.delayed if one[0] <= self.time), key=lambda one: one[0])
        memory.delayed = [one for one in memory.delayed if one[0] > self.time]
        self.external.extend(event for _, event, _ in arrived)
        self.external.extend(outcomes)
        self.external.extend(events)
        self._drain()
        due = {index for index, deadline in self.memory.deadlines.items() if deadline <= self.time}
        while self._goes_on(due):
            due &= {index for index, deadline in self.memory.deadlines.items() if deadline <= self.time}
        self._conditions()
        while self.memory.outcome is None:
            for index in range(len(self.model.transitions)):
                self._watch(index)
            found, self.found = self.found, []
            if not found:
                break
            for one in found:
                self._event(one)
            self._stabilise()
            self._drain()
            self._conditions()

    def _conditions(self) -> None:
        while self._goes_on(None):
            pass

    def _goes_on(self, due: set[int] | None) -> bool:
        """One selection for time-outs that are due or for conditions, with what follows; whether to go on."""
        if self.memory.outcome is not None:
            return False
        taken = self._select_and_take(None, due) or bool(self.internal)
        self._stabilise()
        self._drain()
        return taken

    def _stabilise(self) -> None:
        while self.internal and self.memory.outcome is None:
            self._event(self.internal.popleft())

    def _drain(self) -> None:
        while self.memory.outcome is None:
            if self.moved and self.memory.deferred:
                self.external.extendleft(reversed(self.memory.deferred))
                self.memory.deferred = []
            self.moved = False
            if self.internal:
                self._stabilise()
            elif self.external:
                self._event(self.external.popleft())
                self._stabilise()
            else:
                return

    def _event(self, event: Happened) -> None:
        outer, self.handled = self.handled, event
        taken = self._select_and_take(event, None)
        self.handled = outer
        if not taken and event.origin is not None and event.names == ("fault",):
            raise UnhandledFaultError

    def _watch(self, index: int) -> None:
        """Let a condition start or stop its clock at the end of a step."""
        line, memory = self.model.transitions[index], self.memory
        if not isinstance(line.trigger, Held) or line.source not in memory.active:
            return
        try:
            holds = self._value(line.trigger.condition)
        except SignalError as error:
            self._report(line.source, str(error))
            holds = False
        if not holds:
            memory.deadlines.pop(index, None)
            memory.acted.discard(index)
        elif index not in memory.deadlines and index not in memory.acted:
            memory.deadlines[index] = self.time + self._duration(line.trigger)

    # What is chosen.

    def _select_and_take(self, event: Happened | None, due: set[int] | None) -> bool:
        """One selection with its microstep; whether anything was taken."""
        enabled = self._enabled(event, due)
        while self.found:
            found, self.found = self.found, []
            for one in found:
                self._event(one)
            enabled = self._enabled(event, due) if self.memory.outcome is None else []
        if not enabled:
            return False
        chosen = self._without_conflicts(enabled)
        if event is not None and all(isinstance(one.trigger, Defer) for one in chosen):
            self.memory.deferred.append(event)
        self._microstep(chosen)
        return True

    def _enabled(self, event: Happened | None, due: set[int] | None) -> list[Transition]:
        found: list[Transition] = []
        for leaf in sorted(self.memory.active):
            if self.states[leaf].kind not in (StateKind.ATOMIC, StateKind.FINAL):
                continue
            for state in (leaf, *self._ancestors(leaf)):
                line = self._first(state, event, due)
                if line is not None:
                    if line not in found:
                        found.append(line)
                    break
        return found

    def _first(self, state: int, event: Happened | None, due: set[int] | None) -> Transition | None:
        for index in self.states[state].transitions:
            line = self.model.transitions[index]
            if index in self.undone or not self._triggered(line, event, due):
                continue
            try:
                if isinstance(line.trigger, When | Held) and not self._value(line.trigger.condition):
                    continue
                if line.guard is None or self._value(line.guard):
                    return line
            except SignalError as error:
                self._report(state, str(error))
        return None

    def _triggered(self, line: Transition, event: Happened | None, due: set[int] | None) -> bool:
        trigger = line.trigger
        if event is not None:
            return isinstance(trigger, On) and self._matches(trigger, line.source, event)
        if due is not None:
            return line.index in due
        return isinstance(trigger, When)

    def _matches(self, trigger: On, source: int, event: Happened) -> bool:
        if event.origin is None:
            name = event.names[0]
            every = (one.removesuffix("*") for one in trigger.names if one.endswith("*"))
            return name in trigger.names or any(name.startswith(one) for one in every)
        if isinstance(trigger, Defer):
            return False
        if event.origin == source and set(event.own) & set(trigger.names):
            return True
        around = event.origin == source or source in self._ancestors(event.origin)
        return around and bool(set(event.names) & set(trigger.names))

    def _report(self, state: int, what: str) -> None:
        if (state, what) not in self.reported:
            self.reported.add((state, what))
            self.found.append(Happened(("fault",), state))

    def _without_conflicts(self, enabled: list[Transition]) -> list[Transition]:
        kept: list[Transition] = []
        for line in enabled:
            preempted, removed = False, []
            for other in kept:
                if self._exit_set(line) & self._exit_set(other):
                    if other.source in self._ancestors(line.source):
                        removed.append(other)
                    else:
                        preempted = True
                        break
            if not preempted:
                kept = [one for one in kept if one not in removed] + [line]
        return kept

    def _exit_set(self, line: Transition) -> set[int]:
        if not line.targets:
            return set()
        domain = self._domain(line)
        return {one for one in self.memory.active if domain in self._ancestors(one)}

    def _domain(self, line: Transition) -> int:
        # Not SCXML's effective targets: a history has its own place, so that what is entered has been left.
        targets = list(line.targets)
        composite = line.source == 0 or self.states[line.source].children
        if (
            line.kind is TransitionKind.LOCAL
            and composite
            and all(line.source in self._ancestors(one) for one in targets)
        ):
            domain = line.source
        else:
            domain = self._common(line.source, targets)
        if domain in self.memory.active:
            return domain
        # The handler of a fault may belong to a state that could not be entered.
        return next(one for one in self._ancestors(domain) if one in self.memory.active and self._is_compound(one))

    def _common(self, source: int, targets: list[int]) -> int:
        """SCXML's ``findLCCA``."""
        around = (one for one in self._ancestors(source) if self._is_compound(one))
        return next((one for one in around if all(one in self._ancestors(target) for target in targets)), 0)

    def _is_compound(self, state: int) -> bool:
        return state == 0 or self.states[state].kind is StateKind.COMPOUND

    def _effective(self, targets: Iterable[int]) -> list[int]:
        found: list[int] = []
        for target in targets:
            if self.states[target].kind in HISTORY:
                remembered = self.memory.history.get(target)
                found += self._effective(remembered or self.states[target].initial)
            else:
                found.append(target)
        return found

    # What is done.

    def _microstep(self, lines: list[Transition]) -> None:
        self.taken += 1
        if self.taken > ENDLESS:
            raise EndlessError
        before, moved, queued, sent = self.memory.copy(), self.moved, len(self.internal), len(self.sent)
        try:
            self._take(lines)
        except ActionError as error:
            self.memory, self.moved = before, moved
            while len(self.internal) > queued:
                self.internal.pop()
            del self.sent[sent:]
            self._handle_failure(lines, error)

    def _handle_failure(self, lines: list[Transition], error: ActionError) -> None:
        self.undone |= {line.index for line in lines if not isinstance(line.trigger, Defer)}
        if error.exits:
            self.skipped.add(error.state)
        for state in self._searched(error.state, lines):
            for index in self.states[state].transitions:
                line = self.model.transitions[index]
                if isinstance(line.trigger, On) and "fault" in line.trigger.names and index not in self.undone:
                    try:
                        if line.guard is None or self._value(line.guard):
                            self._microstep([line])
                            return
                    except SignalError:
                        continue
        raise UnhandledFaultError

    def _searched(self, origin: int, lines: list[Transition]) -> list[int]:
        """Where a handler is looked for: inner states first, those of the action before those of the transitions."""
        starts = [origin, *(line.source for line in lines)]
        states = {state for start in starts for state in (start, *self._ancestors(start))}
        found: list[int] = []
        for start in starts:
            for state in (start, *self._ancestors(start)):
                inner = [one for one in states if state in self._ancestors(one)]
                if state not in found and set(inner) <= set(found):
                    found.append(state)
        return found

    def _take(self, lines: list[Transition]) -> None:
        memory = self.memory
        exits = sorted(set().union(*(self._exit_set(line) for line in lines)), reverse=True)
        domains = {line.index: self._domain(line) for line in lines if line.targets}
        self._remember(exits)
        for state in exits:
            if state not in self.skipped:
                self._execute(state, self.states[state].exit, exits=True)
            memory.active.discard(state)
            memory.over.discard(state)
            for index in self.states[state].transitions:
                memory.deadlines.pop(index, None)
                memory.acted.discard(index)
        for line in lines:
            self._execute(line.source, line.actions)
            if line.source in memory.active:
                self._rearm(line)
        to_enter: set[int] = set()
        defaults: set[int] = set()
        histories: dict[int, int] = {}
        for line in lines:
            for target in line.targets:
                self._down(target, to_enter, defaults, histories)
            for target in self._effective(line.targets):
                self._up(target, domains[line.index], to_enter, defaults, histories)
            if line.targets and self.states[domains[line.index]].kind is StateKind.PARALLEL:
                self._regions(domains[line.index], to_enter, defaults, histories)
        self.moved = self.moved or bool(exits or to_enter)
        self._enter(to_enter, defaults, histories)
        self.done.append((tuple(line.index for line in lines), tuple(exits), tuple(sorted(to_enter))))

    def _remember(self, exits: Iterable[int]) -> None:
        memory = self.memory
        for state in exits:
            for child in self.states[state].children:
                if self.states[child].kind is StateKind.DEEP_HISTORY:
                    leaves = (StateKind.ATOMIC, StateKind.FINAL)
                    memory.history[child] = sorted(
                        one
                        for one in memory.active
                        if state in self._ancestors(one) and self.states[one].kind in leaves
                    )
                elif self.states[child].kind is StateKind.SHALLOW_HISTORY:
                    memory.history[child] = sorted(one for one in memory.active if self.states[one].parent == state)

    def _rearm(self, line: Transition) -> None:
        """What a timed line of a state that was not left waits for next."""
        if isinstance(line.trigger, Every):
            length = self._duration(line.trigger)
            due = self.memory.deadlines[line.index]
            while due <= self.time:
                due += length
            self.memory.deadlines[line.index] = due
        elif isinstance(line.trigger, After | Held):
            self.memory.deadlines.pop(line.index, None)
            if isinstance(line.trigger, Held):
                self.memory.acted.add(line.index)

    def _enter(self, to_enter: set[int], defaults: set[int], histories: dict[int, int]) -> None:
        memory = self.memory
        for index in sorted(to_enter):
            state = self.states[index]
            memory.active.add(index)
            for one in self.model.variables:
                if one.scope == index and index:
                    memory.values[one.name] = self._value(one.initial)
            for number in state.transitions:
                trigger = self.model.transitions[number].trigger
                if isinstance(trigger, After | Every):
                    memory.deadlines[number] = self.time + self._duration(trigger)
            self._execute(index, state.entry)
            if index in defaults:
                self._execute(index, state.initial_actions)
            if index in histories:
                self._execute(index, self.states[histories[index]].initial_actions)
            if state.kind is StateKind.FINAL:
                if state.parent == 0:
                    memory.outcome = memory.outcome or state.own_name
                else:
                    self._complete(index)

    def _complete(self, final: int) -> None:
        around = self.states[final].parent
        self.internal.append(Happened((self.states[final].own_name,), around, ("done",)))
        outer = self.states[around].parent
        while self.states[outer].kind is StateKind.PARALLEL and self._is_final(outer):
            self.internal.append(Happened((), outer, ("done",)))
            outer = self.states[outer].parent

    def _is_final(self, state: int) -> bool:
        """SCXML's ``isInFinalState``."""
        children = [one for one in self.states[state].children if self.states[one].kind not in HISTORY]
        if self.states[state].kind is StateKind.PARALLEL:
            return all(self._is_final(one) for one in children)
        return any(self.states[one].kind is StateKind.FINAL and one in self.memory.active for one in children)

    def _down(self, state: int, to_enter: set[int], defaults: set[int], histories: dict[int, int]) -> None:
        """SCXML's ``addDescendantStatesToEnter``."""
        declared = self.states[state]
        if declared.kind in HISTORY:
            targets = self.memory.history.get(state)
            if not targets:
                histories[declared.parent] = state
                targets = list(declared.initial)
            self._targets_down(targets, declared.parent, to_enter, defaults, histories)
            return
        to_enter.add(state)
        if declared.kind is StateKind.COMPOUND:
            defaults.add(state)
            self._targets_down(declared.initial, state, to_enter, defaults, histories)
        elif declared.kind is StateKind.PARALLEL:
            self._regions(state, to_enter, defaults, histories)

    def _targets_down(
        self,
        targets: Iterable[int],
        around: int,
        to_enter: set[int],
        defaults: set[int],
        histories: dict[int, int],
    ) -> None:
        for target in targets:
            self._down(target, to_enter, defaults, histories)
        for target in targets:
            self._up(target, around, to_enter, defaults, histories)

    def _up(self, state: int, around: int, to_enter: set[int], defaults: set[int], histories: dict[int, int]) -> None:
        """SCXML's ``addAncestorStatesToEnter``."""
        for ancestor in self._ancestors(state):
            if ancestor == around or around not in self._ancestors(ancestor):
                return
            to_enter.add(ancestor)
            if self.states[ancestor].kind is StateKind.PARALLEL:
                self._regions(ancestor, to_enter, defaults, histories)

    def _regions(self, parallel: int, to_enter: set[int], defaults: set[int], histories: dict[int, int]) -> None:
        for child in self.states[parallel].children:
            if self.states[child].kind in HISTORY:
                continue
            if not any(child == one or child in self._ancestors(one) for one in to_enter):
                self._down(child, to_enter, defaults, histories)

    def _execute(self, state: int, actions: Iterable[object], *, exits: bool = False) -> None:
        for action in actions:
            try:
                self._one(action)
            except (SignalError, OSError) as error:
                raise ActionError(state, exits) from error

    def _one(self, action: object) -> None:
        match action:
            case Assign():
                self.memory.values[action.variable] = self._value(action.value)
            case Call():
                action.action.function(self.facts, *(self._value(one) for one in action.arguments))
            case Raise():
                self.internal.append(self._carrying(action.event, action.arguments))
            case Send():
                event = self._carrying(action.event, action.arguments)
                self.memory.delayed.append((self.time + Fraction(str(action.delay)), event, action.label))
            case Emit():
                event = self._carrying(action.event, action.arguments)
                self.sent.append(action.event)
                for name in action.receivers:
                    data = {name + part.removeprefix(action.event): value for part, value in event.data.items()}
                    self.memory.delayed.append((self.time, Happened((name,), data=data), None))
            case Cancel():
                self.memory.delayed = [one for one in self.memory.delayed if one[2] != action.label]
            case _:
                raise AssertionError(action)

    def _carrying(self, event: str, arguments: Iterable[Expression]) -> Happened:
        declared = self.model.data_of(event)
        names = [] if declared is None else [declared.variable(one) for one in declared.fields]
        return Happened((event,), data=dict(zip(names, map(self._value, arguments), strict=True)))

    # Values.

    def _duration(self, trigger: After | Every | Held) -> Fraction:
        return Fraction(str(self._value(trigger.duration)))

    def _value(self, expression: Expression) -> object:
        match expression:
            case Literal():
                return expression.value
            case SignalValue():
                arguments = [self._value(one) for one in expression.arguments]
                try:
                    return expression.signal.function(self.facts, *arguments)
                except OSError as error:
                    raise SignalError(f"{expression.signal.name}{arguments}") from error
            case EventValue():
                return self.handled.data[expression.name]
            case VariableValue():
                return self.memory.values[expression.name]
            case Active():
                return any(self.states[one].name == expression.state for one in self.memory.active)
            case Unary():
                return self._unary(expression)
            case Choice():
                return self._value(expression.then if self._value(expression.condition) else expression.otherwise)
            case Binary():
                return self._binary(expression)
        raise AssertionError(expression)

    def _unary(self, expression: Unary) -> object:
        value = self._value(expression.operand)
        match expression.operator:
            case "not":
                return not value
            case "-":
                return -value
        raise AssertionError(expression.operator)

    def _binary(self, expression: Binary) -> object:
        left = self._value(expression.left)
        if expression.operator == "and":
            return bool(left and self._value(expression.right))
        if expression.operator == "or":
            return bool(left or self._value(expression.right))
        right = self._value(expression.right)
        match expression.operator:
            case "==":
                return left == right
            case "<":
                return left < right
            case ">":
                return left > right
            case "+":
                return left + right
            case "-":
                return left - right
        raise AssertionError(expression.operator)

    def _ancestors(self, state: int) -> list[int]:
        return self.around[state]
