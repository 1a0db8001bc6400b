"""What a machine remembers and does not read again: variables and history states whose values need no distinction.

A value is dead where every way onward sets it before it is read. Ways are those between states, whatever is sensed; a
flag that keeps its value excludes the transitions whose conditions it contradicts. So dead values are found without
taking a step, and places that differ in nothing else become one.

Source: Aho, Lam, Sethi and Ullman, "Compilers: principles, techniques, and tools" (2006), section 9.2.5.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from typing import Any

from hsm.engine.evaluation import BINARY
from hsm.engine.machine import Machine
from hsm.model.chart import Action, After, Assign, Emit, Every, Held, Raise, Send, StateKind, Transition, When
from hsm.model.expressions import Binary, Expression, Literal, Unary, VariableValue
from hsm.model.properties import Property, conditions_of
from hsm.model.rewriting import parts_of
from hsm.model.topology import HISTORY
from hsm.model.types import Boolean, Enumeration
from hsm.model.values import dataclass
from hsm.testing.proofs.conditions import COMPARISONS
from hsm.testing.proofs.microsteps import counters
from hsm.testing.proofs.points import Remembered
from hsm.testing.proofs.values import DEAD, Exact, Value


@dataclass(frozen=True, slots=True)
class _Way:
    """What a transition may do.

    Attributes:
        targets: history states among them.
        enters: all states that it may enter, at least.
        conditions: all of them hold where it is taken.
        sets: what its own actions set.
    """

    source: int
    targets: tuple[int, ...]
    enters: frozenset[int]
    conditions: tuple[Expression, ...]
    sets: Mapping[str, Sequence[Expression]]


@dataclass(slots=True)
class _Use:
    """Where a variable is read and set.

    Attributes:
        read: states that may read it while they are active.
        read_on_entry: states that may read it when they are entered.
        set_on_entry: states that set it when they are entered, before they or the states inside read it.
    """

    read: set[int] = field(default_factory=set)
    read_on_entry: set[int] = field(default_factory=set)
    set_on_entry: set[int] = field(default_factory=set)


class Liveness:
    """Which variables and history states of a machine are read again.

    Args:
        machine: the machine.
        stated: its properties, which read variables as well.
    """

    def __init__(self, machine: Machine, stated: Sequence[Property]) -> None:
        model = machine.model
        self._states = model.states
        self._topology = machine.topology
        self._slots = machine.generator.variables
        self._counters = counters(model)
        self._ways: dict[int, list[_Way]] = {}
        for transition in model.transitions:
            self._ways.setdefault(transition.source, []).append(self._way(transition))
        self._uses = {one.name: _Use(set_on_entry={one.scope} if one.scope else set()) for one in model.variables}
        for one in model.variables:
            self._note(one.initial, one.scope, on_entry=True)
        self._find_uses(model.transitions)
        for stating in stated:
            scope = 0 if stating.scope is None else machine.indices[stating.scope]
            for condition in conditions_of(stating.claim):
                self._note(condition, scope)
        self._histories = {
            one.index: one.parent for one in self._states if one.kind in HISTORY and self._only_from_outside(one.index)
        }
        plain = {one.name for one in model.variables if isinstance(one.type, Boolean | Enumeration)}
        self._flags = sorted(plain, key=lambda name: self._slots[name])
        self._dead: dict[tuple[frozenset[int], tuple[Any, ...]], tuple[frozenset[int], frozenset[int]]] = {}

    def buried(
        self, active: frozenset[int], values: tuple[Value, ...], history: Remembered
    ) -> tuple[tuple[Value, ...], Remembered]:
        """Values and what is remembered, without what is dead.

        Args:
            active: the active states.
            values: the variables, by slot.
            history: what each history state remembers.
        """
        flags = tuple(_content(values[self._slots[name]]) for name in self._flags)
        found = self._dead.get((active, flags))
        if found is None:
            found = self._dead[active, flags] = self._found(active, dict(zip(self._flags, flags, strict=True)))
        slots, gone = found
        if slots:
            values = tuple(DEAD if slot in slots else value for slot, value in enumerate(values))
        return values, tuple(one for one in history if one[0] not in gone) if gone else history

    # Where variables are read and set.

    def _way(self, transition: Transition) -> _Way:
        conditions = list[Expression]()
        if isinstance(transition.trigger, When | Held):
            conditions.append(transition.trigger.condition)
        if transition.guard is not None:
            conditions.append(transition.guard)
        sets: dict[str, list[Expression]] = {}
        for action in transition.actions:
            if isinstance(action, Assign):
                sets.setdefault(action.variable, []).append(action.value)
        source, targets = transition.source, transition.targets
        enters = frozenset(state for target in targets for state in self._entered(source, target))
        return _Way(source, targets, enters, tuple(conditions), sets)

    def _entered(self, source: int, target: int) -> Iterator[int]:
        """All states that a transition to a target may enter, at least."""
        declared = self._states[target]
        top = declared.parent if declared.kind in HISTORY else target
        yield from self._states[top].subtree
        for state in self._topology.ancestors(top):
            parallel = self._states[state].kind is StateKind.PARALLEL
            if state == 0 or (self._topology.inside(source, state) and not parallel):
                return
            yield from self._states[state].subtree if parallel else (state,)

    def _find_uses(self, transitions: Sequence[Transition]) -> None:
        for one in transitions:
            trigger = one.trigger
            if isinstance(trigger, When | Held):
                self._note(trigger.condition, one.source)
            if isinstance(trigger, After | Every):
                self._note(trigger.duration, one.source, on_entry=True)
            if isinstance(trigger, Held | Every):
                self._note(trigger.duration, one.source)
            if one.guard is not None:
                self._note(one.guard, one.source)
            self._note_actions(one.actions, one.source)
        for state in self._states:
            self._note_actions(state.exit, state.index)
            early = {name for name, use in self._uses.items() if state.index in use.read_on_entry}
            for action in state.entry:
                self._note_actions((action,), state.index, on_entry=True)
                if isinstance(action, Assign) and action.variable not in early:
                    use = self._uses[action.variable]
                    if state.index not in use.read_on_entry and action.variable not in _read(action.value):
                        use.set_on_entry.add(state.index)
            self._note_actions(state.initial_actions, state.index, on_entry=True)

    def _note_actions(self, actions: Iterable[Action], state: int, *, on_entry: bool = False) -> None:
        for action in actions:
            match action:
                case Assign(variable, value):
                    # Counting neither fails nor has any other effect, so alone it is not a use of the count.
                    own = variable if variable in self._counters else ""
                    self._note(value, state, on_entry=on_entry, own=own)
                case Raise(arguments=arguments) | Send(arguments=arguments) | Emit(arguments=arguments):
                    for one in arguments:
                        self._note(one, state, on_entry=on_entry)

    def _note(self, expression: Expression, state: int, *, on_entry: bool = False, own: str = "") -> None:
        for name in _read(expression):
            use = self._uses.get(name)
            if use is not None and name != own:
                (use.read_on_entry if on_entry else use.read).add(state)

    def _only_from_outside(self, history: int) -> bool:
        """Whether only transitions from outside the state around a history state lead to it."""
        around = self._states[self._states[history].parent]
        ways = (one for ways in self._ways.values() for one in ways if history in one.targets)
        return not any(one.source in around.subtree for one in ways) and not any(
            history in one.initial for one in self._states
        )

    # What is dead.

    def _found(self, active: frozenset[int], flags: dict[str, Any]) -> tuple[frozenset[int], frozenset[int]]:
        """The slots of the dead variables, and the dead history states."""
        known = self._lasting(active, {name: value for name, value in flags.items() if value is not None})
        slots = (self._slots[name] for name, use in self._uses.items() if not self._is_read(name, use, active, known))
        gone = (one for one, around in self._histories.items() if not self._is_used(one, around, active, known))
        return frozenset(slots), frozenset(gone)

    def _lasting(self, active: frozenset[int], known: dict[str, Any]) -> dict[str, Any]:
        """The flags that keep their values for ever."""
        while known:
            changed = {name for name in known for state in active if _assigned(name, self._states[state].exit)}
            for way in self._onward(active, known, frozenset(), ""):
                for name, values in way.sets.items():
                    if name in known and any(_value(one, {}) != known[name] for one in values):
                        changed.add(name)
                changed.update(name for name in known for state in way.enters if self._sets_inside(name, state))
            if not changed:
                break
            known = {name: value for name, value in known.items() if name not in changed}
        return known

    def _sets_inside(self, name: str, state: int) -> bool:
        """Whether entering a state, or leaving it later, sets a variable."""
        declared = self._states[state]
        actions = (*declared.entry, *declared.initial_actions, *declared.exit)
        return state in self._uses[name].set_on_entry or _assigned(name, actions)

    def _is_read(self, name: str, use: _Use, active: frozenset[int], known: Mapping[str, Any]) -> bool:
        if not use.read.isdisjoint(active):
            return True
        setting = frozenset(use.set_on_entry)
        for way in self._onward(active, known, setting, name):
            for state in way.enters:
                read = state in use.read or state in use.read_on_entry
                if read and not self._anew(way, state, setting):
                    return True
        return False

    def _is_used(self, history: int, around: int, active: frozenset[int], known: Mapping[str, Any]) -> bool:
        if around in active:
            return False
        return any(history in way.targets for way in self._onward(active, known, frozenset({around}), ""))

    def _onward(
        self, active: frozenset[int], known: Mapping[str, Any], setting: frozenset[int], name: str
    ) -> Iterator[_Way]:
        """All ways that may be taken before a variable is set, by an action or by entering one of some states."""
        seen = set(active)
        pending = list(active)
        while pending:
            for way in self._ways.get(pending.pop(), ()):
                if any(_value(one, known) is False for one in way.conditions):
                    continue
                if name and name in way.sets and name not in _read(way.sets[name][0]):
                    continue
                yield way
                fresh = [one for one in way.enters if one not in seen and not self._anew(way, one, setting)]
                seen.update(fresh)
                pending += fresh

    def _anew(self, way: _Way, state: int, setting: frozenset[int]) -> bool:
        """Whether a transition that enters a state enters one of some others first."""
        around = (self._states[one].subtree for one in setting)
        return any(state in one and way.source not in one for one in around)


def _read(expression: Expression) -> Iterator[str]:
    return (part.name for part in parts_of(expression) if isinstance(part, VariableValue))


def _assigned(name: str, actions: Iterable[Action]) -> bool:
    return any(isinstance(one, Assign) and one.variable == name for one in actions)


def _content(value: Value) -> Any:
    return value.value if isinstance(value, Exact) else None


def _value(expression: Expression, known: Mapping[str, Any]) -> Any:
    """The value of an expression as far as some variables determine it; None where they do not."""
    match expression:
        case Literal(value):
            return value
        case VariableValue(name):
            return known.get(name)
        case Unary("not", operand):
            held = _value(operand, known)
            return None if held is None else not held
        case Binary("and" | "or" as operator, left, right):
            sides = [_value(left, known), _value(right, known)]
            decisive = operator == "or"
            if any(one is decisive for one in sides):
                return decisive
            return None if None in sides else not decisive
        case Binary(operator, left, right) if operator in COMPARISONS:
            first, second = _value(left, known), _value(right, known)
            return None if first is None or second is None else bool(BINARY[operator](first, second))
    return None
