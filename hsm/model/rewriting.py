"""A model with some of its parts replaced: used for stand-ins for what a machine calls, and for mutants."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from hsm.model.chart import (
    Action,
    ActivityCall,
    After,
    Assign,
    Call,
    Emit,
    Every,
    Held,
    Model,
    Raise,
    Send,
    State,
    Transition,
    Trigger,
    When,
)
from hsm.model.expressions import Active, Binary, Choice, Expression, SignalValue, Unary, VariableValue
from hsm.model.properties import AlwaysHolds, Claim, Never

Rewrite = Callable[[Expression], Expression]


def rewrite_expression(expression: Expression, rewrite: Rewrite) -> Expression:
    """The expression with every node replaced, the innermost first."""
    match expression:
        case SignalValue(arguments=arguments) if arguments:
            expression = replace(expression, arguments=tuple(rewrite_expression(one, rewrite) for one in arguments))
        case Unary(operand=operand):
            expression = replace(expression, operand=rewrite_expression(operand, rewrite))
        case Binary(left=left, right=right):
            left, right = rewrite_expression(left, rewrite), rewrite_expression(right, rewrite)
            expression = replace(expression, left=left, right=right)
        case Choice(condition=condition, then=then, otherwise=otherwise):
            condition, then, otherwise = (rewrite_expression(one, rewrite) for one in (condition, then, otherwise))
            expression = replace(expression, condition=condition, then=then, otherwise=otherwise)
    return rewrite(expression)


def parts_of(expression: Expression) -> Iterator[Expression]:
    """All nodes of an expression, the outermost first."""
    yield expression
    match expression:
        case SignalValue(arguments=arguments):
            for one in arguments:
                yield from parts_of(one)
        case Unary(operand=operand):
            yield from parts_of(operand)
        case Binary(left=left, right=right):
            yield from parts_of(left)
            yield from parts_of(right)
        case Choice(condition=condition, then=then, otherwise=otherwise):
            for one in (condition, then, otherwise):
                yield from parts_of(one)


def about_signals(claim: Claim) -> bool:
    """Whether a claim restricts the signals of each step, whatever the machine does."""
    if not isinstance(claim, Never | AlwaysHolds):
        return False
    parts = list(parts_of(claim.condition))
    return any(isinstance(one, SignalValue) for one in parts) and not any(
        isinstance(one, VariableValue | Active) for one in parts
    )


def actions_of(model: Model) -> Iterator[Action]:
    """All actions of a machine."""
    for state in model.states:
        yield from (*state.entry, *state.exit, *state.initial_actions)
    for transition in model.transitions:
        yield from transition.actions


def with_expressions(trigger: Trigger, rewrite: Callable[[Expression], Expression]) -> Trigger:
    """A trigger with other expressions for its condition and its duration."""
    match trigger:
        case When(condition):
            return replace(trigger, condition=rewrite(condition))
        case Held(condition, duration):
            return Held(rewrite(condition), rewrite(duration))
        case After(duration) | Every(duration):
            return replace(trigger, duration=rewrite(duration))
        case _:
            return trigger


class Rewriter:
    """Makes a copy of a model; what is not overridden stays as it is.

    Args:
        expression: replaces each node of each expression.
        action: replaces each action, after its expressions are rewritten.
        activity: replaces the activity of a state, after its expressions are rewritten.
    """

    def __init__(
        self,
        expression: Rewrite = lambda one: one,
        action: Callable[[Action], Action] = lambda one: one,
        activity: Callable[[State, ActivityCall], ActivityCall] = lambda _, one: one,
    ) -> None:
        self._rewrite = expression
        self._replace_action = action
        self._replace_activity = activity

    def model(self, model: Model) -> Model:
        """The copy."""
        return replace(
            model,
            states=tuple(map(self.state, model.states)),
            transitions=tuple(map(self.transition, model.transitions)),
            variables=tuple(replace(one, initial=self.expression(one.initial)) for one in model.variables),
        )

    def state(self, state: State) -> State:
        """A state with its actions and its activity rewritten."""
        activity = state.activity
        if activity is not None:
            arguments = tuple(map(self.expression, activity.arguments))
            activity = self._replace_activity(state, replace(activity, arguments=arguments))
        return replace(
            state,
            initial_actions=self.actions(state.initial_actions),
            entry=self.actions(state.entry),
            exit=self.actions(state.exit),
            activity=activity,
        )

    def transition(self, transition: Transition) -> Transition:
        """A transition with its trigger, guard and actions rewritten."""
        return replace(
            transition,
            trigger=self.trigger(transition.trigger),
            guard=None if transition.guard is None else self.expression(transition.guard),
            actions=self.actions(transition.actions),
        )

    def trigger(self, trigger: Trigger) -> Trigger:
        """A trigger with its condition or duration rewritten."""
        return with_expressions(trigger, self.expression)

    def actions(self, actions: tuple[Action, ...]) -> tuple[Action, ...]:
        """Actions, each rewritten."""
        return tuple(map(self.action, actions))

    def action(self, action: Action) -> Action:
        """An action with its expressions rewritten."""
        match action:
            case Assign(value=value):
                action = replace(action, value=self.expression(value))
            case Call(arguments=arguments) | Raise(arguments=arguments) | Send(arguments=arguments):
                action = replace(action, arguments=tuple(map(self.expression, arguments)))
            case Emit(arguments=arguments):
                action = replace(action, arguments=tuple(map(self.expression, arguments)))
        return self._replace_action(action)

    def expression(self, expression: Expression) -> Expression:
        """An expression with every node replaced."""
        return rewrite_expression(expression, self._rewrite)


def expressions_of(model: Model) -> Iterator[Expression]:
    """Everything in a machine that is evaluated."""
    for state in model.states:
        if state.activity is not None:
            yield from state.activity.arguments
    for transition in model.transitions:
        match transition.trigger:
            case When(condition):
                yield condition
            case Held(condition, duration):
                yield condition
                yield duration
            case After(duration) | Every(duration):
                yield duration
        if transition.guard is not None:
            yield transition.guard
    for action in actions_of(model):
        match action:
            case Assign(value=value):
                yield value
            case Call(arguments=arguments) | Raise(arguments=arguments) | Send(arguments=arguments):
                yield from arguments
            case Emit(arguments=arguments):
                yield from arguments
