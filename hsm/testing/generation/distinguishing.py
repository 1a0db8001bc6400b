"""Steps that may distinguish a machine from a mutant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from hsm.testing.exploration.exploring import ExploredMoment, ExploredStep, Explorer
from hsm.testing.mutation.operators import Mutant


def distinguishing_steps(
    explorer: Explorer, changed: Explorer, mutant: Mutant, moment: ExploredMoment
) -> Iterator[tuple[ExploredStep, bool]]:
    """Steps that reach a mutation, each with whether its result differs on the mutant.

    A signal that only one of the two machines uses is free for the other. So each step of one is also taken by the
    other, with the same values for the signals that the first has used and free values for the rest.

    Args:
        explorer: makes steps of the machine.
        changed: makes steps of the changed machine.
        mutant: what was changed.
        moment: where the steps begin.
    """
    parameters = len(mutant.model.parameters)
    for one, other in ((explorer, changed), (changed, explorer)):
        for edge in one.successors(_on(one, moment)):
            if edge.fault is None and _comes_by(mutant, edge):
                for twin in other.continued(_on(other, moment), edge.input):
                    yield replace(edge, input=twin.input), _outcome(twin, parameters) != _outcome(edge, parameters)


def _on(explorer: Explorer, moment: ExploredMoment) -> ExploredMoment:
    """The same moment of another machine with the same states and variables, and with parameters of its own."""
    state = moment.state
    configuration = explorer.machine.configuration(state.configuration.leaves)
    values = [*explorer.parameters, *state.values[len(explorer.parameters) :]]
    return replace(moment, state=replace(state, configuration=configuration, values=values))


def _comes_by(mutant: Mutant, edge: ExploredStep) -> bool:
    """Whether a step reaches the mutation."""
    if mutant.transitions:
        looked_at = {*edge.transitions, *edge.paths}
        return edge.input.wait.early or not looked_at.isdisjoint(mutant.transitions)
    return mutant.state == 0 or mutant.state in edge.entered or mutant.state in edge.exited


def _outcome(edge: ExploredStep, parameters: int) -> tuple[object, ...]:
    """The result of a step, without the values of parameters, which come first."""
    leaves, values, *rest = edge.target.key()
    return edge.fault, leaves, values[parameters:], rest, tuple(edge.transitions)
