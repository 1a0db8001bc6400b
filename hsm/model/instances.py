"""Instances and members: a machine copied into another one, as a state with a name of its own.

An instance shares its robot and its events with the machine around it; a member has its own of both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from hsm.model.chart import (
    Action,
    ActivityCall,
    Assign,
    Call,
    Cancel,
    Emit,
    Model,
    On,
    Raise,
    Send,
    State,
    StateKind,
    Transition,
    Trigger,
    Variable,
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
from hsm.model.members import Owned
from hsm.model.properties import Property, with_conditions
from hsm.model.rewriting import about_signals, with_expressions
from hsm.model.values import dataclass


@dataclass(frozen=True, slots=True)
class InstanceCopy:
    """A copy of a machine's parts, renamed and renumbered.

    Attributes:
        root: what was the machine's root, to be merged into the instance's state.
        states: all other states.
        transitions: all transitions.
        derived: what parameters are made of that are made of others, by their names in the machine.
        variables: all variables, set when the instance's state is entered (inner instances: on their own entry).
        properties: what must hold of it, about the instance's state.
        assumptions: what it assumes while that is active.
    """

    root: State
    states: tuple[State, ...]
    transitions: tuple[Transition, ...]
    derived: Mapping[str, Expression]
    variables: tuple[Variable, ...]
    properties: tuple[Property, ...]
    assumptions: tuple[Property, ...]


def instantiate(
    model: Model, name: str, state_offset: int, transition_offset: int, *, member: bool = False
) -> InstanceCopy:
    """Copy a machine.

    Args:
        model: the machine.
        name: the instance's name, put before the name of each state, variable and parameter.
        state_offset: the index that the machine's root becomes.
        transition_offset: the index that its first transition becomes.
        member: its signals, activities, actions and events are its own and have its name as a prefix.
    """
    events = (model.events or frozenset()) if member else frozenset()
    outcomes = {one for state in model.states if state.activity for one in state.activity.activity.outcomes}
    reported = outcomes | {"done", "fault"} | {one.own_name for one in model.states if one.kind is StateKind.FINAL}
    copier = _Copier(f"{name}.", state_offset, transition_offset, Owned(name) if member else None, events, reported)
    states = tuple(map(copier.state, model.states))
    return InstanceCopy(
        states[0],
        states[1:],
        tuple(map(copier.transition, model.transitions)),
        {parameter: copier.expression(made_of) for parameter, made_of in model.derived.items()},
        tuple(map(copier.variable, model.variables)),
        tuple(map(copier.property, model.properties)),
        tuple(map(copier.assumption, model.assumptions)),
    )


@dataclass(frozen=True, slots=True)
class _Copier:
    prefix: str
    states: int
    transitions: int
    owned: Owned | None
    events: frozenset[str]
    reported: set[str]

    def state(self, state: State) -> State:
        """A state with its new name and numbers."""
        return replace(
            state,
            index=state.index + self.states,
            name=self.prefix + state.name,
            parent=state.parent + self.states,
            children=self._shifted(state.children),
            last=state.last + self.states,
            initial=self._shifted(state.initial),
            initial_actions=self._actions(state.initial_actions),
            entry=self._actions(state.entry),
            exit=self._actions(state.exit),
            activity=self._activity(state.activity),
            transitions=tuple(index + self.transitions for index in state.transitions),
        )

    def transition(self, transition: Transition) -> Transition:
        """A transition with its new numbers."""
        return replace(
            transition,
            index=transition.index + self.transitions,
            source=transition.source + self.states,
            targets=self._shifted(transition.targets),
            trigger=self._trigger(transition.trigger),
            guard=None if transition.guard is None else self.expression(transition.guard),
            actions=self._actions(transition.actions),
        )

    def variable(self, variable: Variable) -> Variable:
        """A variable with its new name, set when its state is entered."""
        return replace(
            variable,
            name=self.prefix + variable.name,
            initial=self.expression(variable.initial),
            scope=variable.scope + self.states,
        )

    def assumption(self, stated: Property) -> Property:
        """An assumption with its new name; one about signals alone also applies while the instance is not active."""
        copied = self.property(stated)
        return replace(copied, scope=None) if stated.scope is None and about_signals(stated.claim) else copied

    def property(self, stated: Property) -> Property:
        """A property with its new name, about the instance or about an instance within it."""
        return replace(
            stated,
            name=self.prefix + stated.name,
            claim=with_conditions(stated.claim, self.expression),
            scope=self.prefix + stated.scope if stated.scope is not None else self.prefix.removesuffix("."),
        )

    def _shifted(self, indices: tuple[int, ...]) -> tuple[int, ...]:
        return tuple(index + self.states for index in indices)

    def _trigger(self, trigger: Trigger) -> Trigger:
        if isinstance(trigger, On) and self.owned is not None:
            return replace(trigger, names=tuple(one for name in trigger.names for one in self._heard(name)))
        return with_expressions(trigger, self.expression)

    def _heard(self, name: str) -> tuple[str, ...]:
        """The names of the events of a member: events have its name as a prefix, outcomes of its states do not."""
        if name == "*":
            return (f"{self.prefix}*",)
        own = (name,) if name in self.reported or name not in self.events else ()
        return (*own, f"{self.prefix}{name}") if name in self.events else own

    def _activity(self, call: ActivityCall | None) -> ActivityCall | None:
        if call is None:
            return None
        activity = call.activity if self.owned is None else self.owned.activity(call.activity)
        return replace(call, activity=activity, arguments=tuple(map(self.expression, call.arguments)))

    def _actions(self, actions: tuple[Action, ...]) -> tuple[Action, ...]:
        return tuple(map(self._action, actions))

    def _action(self, action: Action) -> Action:
        match action:
            case Assign():
                return replace(action, variable=self.prefix + action.variable, value=self.expression(action.value))
            case Call():
                declared = action.action if self.owned is None else self.owned.action(action.action)
                return replace(action, action=declared, arguments=tuple(map(self.expression, action.arguments)))
            case Send():
                arguments = tuple(map(self.expression, action.arguments))
                label = None if action.label is None else self._event(action.label)
                return replace(action, event=self._event(action.event), label=label, arguments=arguments)
            case Raise() | Emit():
                arguments = tuple(map(self.expression, action.arguments))
                return replace(action, event=self._event(action.event), arguments=arguments)
            case Cancel():
                return replace(action, label=self._event(action.label))
            case _:
                return action

    def _event(self, name: str) -> str:
        """The name of an event: a member's has its name."""
        return name if self.owned is None else self.prefix + name

    def expression(self, expression: Expression) -> Expression:
        """An expression with its new names."""
        match expression:
            case EventValue(name):
                return replace(expression, name=self._event(name))
            case VariableValue(name):
                return replace(expression, name=self.prefix + name)
            case Active(state):
                return replace(expression, state=self.prefix + state)
            case SignalValue(signal, arguments):
                signal = signal if self.owned is None else self.owned.signal(signal)
                return replace(expression, signal=signal, arguments=tuple(map(self.expression, arguments)))
            case Unary(operand=operand):
                return replace(expression, operand=self.expression(operand))
            case Binary(left=left, right=right):
                return replace(expression, left=self.expression(left), right=self.expression(right))
            case Choice(condition, then, otherwise):
                condition, then, otherwise = map(self.expression, (condition, then, otherwise))
                return replace(expression, condition=condition, then=then, otherwise=otherwise)
            case Literal():
                return expression
