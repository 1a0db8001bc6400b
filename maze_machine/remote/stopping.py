"""Where a simulation pauses by itself: in a state, at a transition, where a condition becomes true."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from hsm import MachineError
from hsm.engine.monitoring import Holds, holding_at
from hsm.testing.scenarios.breaks import transitions_of_line
from hsm.testing.scenarios.reading import parse_expectation
from hsm.testing.scenarios.scenarios import ConditionHolds, ExpectationClause, InState, Performs
from hsm.testing.scenarios.script import Performed
from maze_machine.drive.mission import Mission
from maze_machine.drive.tick import Tick
from maze_machine.errors import UsageError

Reached = Callable[[Tick], bool]
"""Whether a tick is one to pause after; called with each tick."""


def stopping_point(text: str, mission: Mission) -> Reached:
    """A place to pause at.

    Args:
        text: ``line 12`` or ``door:12`` for the transitions written there, or what an ``expect`` line may say of one
            moment: ``in_door``, ``turns == 2 and not space.left``, ``doing ring``.
        mission: the run.

    Raises:
        UsageError: it cannot be read, or is known only within a step.
    """
    model = mission.machine.model
    try:
        there = transitions_of_line(text, model)
        if there is not None:
            return lambda tick: any(one.index in there for one in tick.report.transitions)
        expected = parse_expectation(text, model, mission.library, "break")
    except MachineError as error:
        found = error.diagnostics[0]
        raise UsageError(found.message, found.suggestion or "") from None
    except ValueError as error:
        raise UsageError(str(error)) from None
    if expected.within is not None:
        raise UsageError("remove `within`: a run stops at one moment")
    for one in expected.claims:
        if not one.lasts:
            raise UsageError(f"`{one.text}` is over within a step", "name a state, a line or a condition")
    return _Coming(mission, expected.claims)


class _Coming:
    """Whether claims hold that did not hold in the tick before."""

    def __init__(self, mission: Mission, claims: tuple[ExpectationClause, ...]) -> None:
        self._machine, self._claims, self._before = mission.machine, claims, False

    def __call__(self, tick: Tick) -> bool:
        holds = holding_at(self._machine, tick.variables, tick.configuration, tick.facts)
        now = all(_met(one.content, tick, holds) for one in self._claims)
        came, self._before = now and not self._before, now
        return came


def _met(content: object, tick: Tick, holds: Holds) -> bool:
    match content:
        case InState(state, negated):
            return (state in tick.configuration) != negated
        case ConditionHolds(condition):
            return holds(condition) is True
        case Performs(negated=negated):
            return any(map(content.matches, _running(tick))) != negated
    return False


def _running(tick: Tick) -> Iterator[Performed]:
    """The activities of the active states, with their arguments."""
    model, indices = tick.report.machine.model, tick.report.machine.indices
    for state in tick.configuration:
        call = model.states[indices[state]].activity
        if call is not None:
            yield Performed(call.activity.name, tuple(tick.report.arguments.get(state, ())))
