"""The library ``transitions`` as a second engine, for machines in the subset that both engines share.

The shared subset: states within states, final states at the top, events with guards, actions, assignments. Everything
else (parallel states, history, time, conditions, activities, completion) is refused with a diagnostic.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from transitions.extensions import HierarchicalMachine
from transitions.extensions.nesting import NestedState, NestedTransition

from hsm.engine.generated import Occasion
from hsm.engine.inputs import parameter_values
from hsm.model.chart import Action, Cancel, On, Raise, Send, State, StateKind, Transition
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic, MachineError, Place
from hsm.model.topology import HISTORY

if TYPE_CHECKING:
    from hsm.engine.compiled import CompiledChart

DEPTH = 60
"""States nested deeper than this are too much for the recursion in ``transitions``."""


class BackendState(NestedState):
    """A state; paths are written with a slash, which no name contains."""

    separator = "/"


class BackendTransition(NestedTransition):
    """A transition with actions between the exits and the entries, where ``transitions`` itself runs none."""

    def __init__(self, *arguments: Any, between: Callable[..., None], **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._between = between

    def _change_state(self, event_data: Any) -> None:
        state_tree, leave, enter = self._resolve_transition(event_data)
        for function in leave:
            function()
        self._between(*event_data.args)
        self._update_model(event_data, state_tree)
        for function in enter:
            function()


class TransitionsMachine(HierarchicalMachine):
    """A machine of this project as a live ``HierarchicalMachine``.

    Events are sent as ``model.trigger(name, facts)``; the facts are what guards and actions are given. ``model.state``
    is the path of the active atomic state.

    Attributes:
        machine: the compiled machine that it was made from.
        variables: the values of variables and parameters by their full names.
    """

    state_cls = BackendState
    transition_cls = BackendTransition

    def __init__(self, machine: CompiledChart, model: object, parameters: Mapping[str, Any]) -> None:
        self.machine = machine
        generator = machine.generator
        self._values = generator.first_values(parameter_values(machine.model, parameters))
        self._set_out = [generator.entry(state) for state in machine.model.states]
        self._paths = {_path(machine, state): state.index for state in machine.model.states}
        root = machine.model.states[0]
        super().__init__(
            model=model if model is not None else HierarchicalMachine.self_literal,
            states=[self._state(machine.model.states[child]) for child in root.children],
            initial=_path(machine, self._entered()[-1]),
            queued=True,
            auto_transitions=False,
            ignore_invalid_triggers=True,
        )
        # Those of the root come last: it lies around all states.
        for transition in sorted(machine.model.transitions, key=lambda one: (one.source == 0, one.index)):
            self._add(transition)
        # This engine runs the entry actions of the initial states, `transitions` does not.
        for state in (root, *self._entered()):
            self._run(self._set_out[state.index])

    @property
    def variables(self) -> dict[str, Any]:
        """The values of variables and parameters by their full names."""
        return dict(zip(self.machine.generator.own_variables, self._values, strict=False))

    def active(self, model: Any = None) -> frozenset[str]:
        """Full names of all active states of a model (the only one by default)."""
        leaf = self._paths[(model or self.models[0]).state]
        states = self.machine.model.states
        return frozenset(states[index].name for index in self.machine.topology.up(leaf) if index)

    def _entered(self) -> list[State]:
        """The initial states, from the outside in."""
        states = self.machine.model.states
        found: list[State] = [states[0]]
        while found[-1].initial:
            found.append(states[found[-1].initial[0]])
        return found[1:]

    def _state(self, state: State) -> dict[str, Any]:
        states = self.machine.model.states
        leave = self.machine.generator.actions(state.index, Occasion.EXIT, state.exit)
        made: dict[str, Any] = {
            "name": state.name,
            "on_enter": [partial(self._run, self._set_out[state.index])],
            "on_exit": [partial(self._run, leave)],
        }
        if state.children:
            made["children"] = [self._state(states[child]) for child in state.children]
            made["initial"] = states[state.initial[0]].name
        return made

    def _add(self, transition: Transition) -> None:
        machine = self.machine
        states = machine.model.states
        run = machine.generator.actions(transition.source, Occasion.TRANSITION, transition.actions)
        # The root is not a state of `transitions`: its transitions belong to each state at the top, after their own.
        tops = [states[child] for child in states[0].children if states[child].kind is not StateKind.FINAL]
        sources = [states[transition.source]] if transition.source else tops
        guard = None if transition.guard is None else machine.generator.arguments((transition.guard,))
        assert isinstance(transition.trigger, On), "nothing else is in the shared subset"
        for name in transition.trigger.names:
            for source in sources:
                self.add_transition(
                    name,
                    _path(machine, source),
                    _path(machine, states[transition.targets[0]]) if transition.targets else None,
                    conditions=None if guard is None else [partial(self._holds, guard)],
                    before=None if transition.targets else [partial(self._run, run)],
                    between=partial(self._run, run),
                )

    def _holds(self, guard: Any, facts: object = None, *_: Any) -> bool:
        leaf = self._paths[self.models[0].state]
        return bool(guard(facts, {}, self._values, frozenset(self.machine.topology.up(leaf)))[0])

    def _run(self, block: Any, facts: object = None, *_: Any) -> None:
        if block is None:
            return
        raised: list[Any] = []
        block.run(facts, {}, self._values, frozenset(), raised, {}, 0.0)
        for event in raised:
            self.models[0].trigger(event, facts)


def to_transitions(
    machine: CompiledChart, model: object | None = None, parameters: Mapping[str, Any] | None = None
) -> TransitionsMachine:
    """A machine on the library ``transitions``, live: events are sent as ``model.trigger(name, facts)``.

    Args:
        machine: the machine.
        model: the object that gets the state and the triggers; by default the result itself.
        parameters: values by name, in SI units.

    Raises:
        MachineError: the machine uses features outside the shared subset; the error lists all of them.
        ValueError: a parameter is unknown, or one without a default is missing.
    """
    beyond = list(_beyond(machine))
    if beyond:
        raise MachineError(beyond)
    return TransitionsMachine(machine, model, parameters or {})


def _path(machine: CompiledChart, state: State) -> str:
    names = [machine.model.states[index].name for index in machine.topology.up(state.index) if index]
    return BackendState.separator.join(reversed(names))


def _beyond(machine: CompiledChart) -> Iterator[Diagnostic]:
    """The features outside the shared subset."""
    if machine.topology.depth > DEPTH:
        yield _refusal(f"states nested more than {DEPTH} deep", machine.model.states[0].place)
        return
    if machine.model.store is not None:
        yield _refusal("a data model", machine.model.states[0].place)
        return
    for state in machine.model.states:
        for reason in _state_beyond(machine, state):
            yield _refusal(f"state `{state.name}`: {reason}", state.place)
    for transition in machine.model.transitions:
        for reason in _transition_beyond(machine, transition):
            name = machine.model.states[transition.source].name
            yield _refusal(f"a transition of `{name}`: {reason}", transition.place)


def _refusal(reason: str, place: Place | None) -> Diagnostic:
    return finding("E0921", place, f"`transitions` does not support this: {reason}")


def _state_beyond(machine: CompiledChart, state: State) -> Iterator[str]:
    if state.kind is StateKind.PARALLEL:
        yield "it is parallel"
    if state.kind in HISTORY:
        yield "it is a history"
    if state.kind is StateKind.FINAL and state.parent:
        yield "it completes the state around it"
    if state.activity is not None:
        yield "it has an activity"
    if state.initial_actions:
        yield "its initial transition has actions"
    if state.kind is StateKind.COMPOUND and (len(state.initial) != 1 or state.initial[0] not in state.children):
        yield "its initial state is not one of its own"
    yield from _actions_beyond(machine, state.index, (*state.entry, *state.exit))


def _transition_beyond(machine: CompiledChart, transition: Transition) -> Iterator[str]:
    if not isinstance(transition.trigger, On):
        yield "it has no event"
    elif transition.trigger.prefix and any("*" in name or "." in name for name in transition.trigger.names):
        yield "it matches events by the first parts of their names"
    if len(transition.targets) > 1:
        yield "it has several targets"
    elif transition.targets and not _leaves_alike(machine, transition):
        yield "it exits and enters different states in `transitions`"
    names = transition.trigger.names if isinstance(transition.trigger, On) else ()
    if any(machine.model.data_of(name) is not None for name in names):
        yield "its event carries data"
    yield from _actions_beyond(machine, transition.source, transition.actions)


def _leaves_alike(machine: CompiledChart, transition: Transition) -> bool:
    """Whether both engines leave the same states, whichever are active.

    ``transitions`` leaves what lies in the innermost active state around the target, this engine what lies in the
    transition's domain, which does not depend on the states active within the source.
    """
    topology, target = machine.topology, transition.targets[0]
    if topology.states[target].kind in HISTORY:
        return False
    domain = topology.domain(transition)
    around = list(topology.ancestors(target))
    last = topology.states[transition.source].last
    for leaf in range(transition.source, last + 1):
        if topology.atomic(leaf) and topology.states[leaf].kind in (StateKind.ATOMIC, StateKind.FINAL):
            active = set(topology.up(leaf))
            if next(state for state in around if state in active) != domain:
                return False
    return True


def _actions_beyond(machine: CompiledChart, state: int, actions: tuple[Action, ...]) -> Iterator[str]:
    if any(isinstance(action, Raise) and action.arguments for action in actions):
        yield "an action raises an event that carries data"
    elif any(isinstance(action, Send | Cancel) for action in actions):
        yield "an action raises an event after a delay"
    elif (block := machine.generator.actions(state, Occasion.ENTRY, actions)) is not None and block.watches:
        yield "an action reads which states are active"
