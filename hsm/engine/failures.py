"""What has failed in a step, and selections that take it into account."""

from __future__ import annotations

from collections import deque
from typing import Any, Protocol

from hsm.engine.compiled import CompiledChart
from hsm.engine.configuration import Picked, Plan, Selector
from hsm.engine.evaluation import Evaluation, SignalFault
from hsm.engine.generated import NONE, Block, Occasion
from hsm.engine.limits import reason_of
from hsm.engine.run_state import PendingFault, RunState, fault_event
from hsm.model.chart import Cancel, Defer, On, Send
from hsm.model.events import Event, matches
from hsm.model.expressions import SignalValue
from hsm.model.messages import STORE, ScxmlEvent


class FallibleStep(Protocol):
    """A step in which something may fail.

    Attributes:
        chart: the chart.
        state: the state of its run, as far as the step has come.
        facts: the argument of signals and actions.
        memo: the signals evaluated.
        hits: the paths through guards that were taken, for coverage.
        queue: events of the chart's own that are to be handled.
    """

    chart: CompiledChart
    state: RunState
    facts: object
    memo: dict[Any, Any]
    hits: set[tuple[int, int]]
    queue: deque[Event | ScxmlEvent | PendingFault | Send | Cancel]


class Failures:
    """What has failed in one step.

    Args:
        step: the step.

    Attributes:
        error: the exception of a guard that was not reported yet, or None.
        left_out: exit actions that failed, which are not run again in the step.
    """

    def __init__(self, step: FallibleStep) -> None:
        self._step = step
        self.error: BaseException | None = None
        self.left_out: set[Block] = set()
        self._undone: set[int] = set()
        self._signals: dict[Any, BaseException] = {}
        self._reported: set[Any] = set()
        self._found: list[PendingFault] = []

    def is_empty(self) -> bool:
        """Whether nothing has failed so far."""
        return self.error is None and not self._signals and not self._undone

    def take(self) -> list[PendingFault]:
        """The faults that were found since the last call."""
        found, self._found = self._found, []
        return found

    def undo(self, plan: Plan, block: Block) -> None:
        """Record that a microstep was undone; what failed is not tried again in the step. Events are still deferred."""
        transitions = self._step.chart.model.transitions
        self._undone.update(one for one in plan.transitions if not isinstance(transitions[one].trigger, Defer))
        if block.role is Occasion.EXIT:
            self.left_out.add(block)

    def handler(self, fault: PendingFault, plan: Plan) -> int | None:
        """The transition that handles a failed action.

        It belongs to the state of the action, even if that is not entered yet, else to a state of the failed
        transitions, else to a state around these; inner states come before the states around them.
        """
        topology, model = self._step.chart.topology, self._step.chart.model
        origin = fault.event.origin
        around = list(topology.up(origin))
        sources = [model.transitions[index].source for index in plan.transitions]
        others = [state for one in sources if one not in around for state in topology.up(one)]
        evaluation = self.evaluation()
        for state in reversed(list(dict.fromkeys(reversed([*around, *others])))):
            for index in model.states[state].transitions:
                trigger = model.transitions[index].trigger
                waits = isinstance(trigger, On) and matches(trigger, fault.event, origin, origin)
                if not waits or index in self._undone:
                    continue
                decision = self._step.chart.generator.decision(index)
                try:
                    held, path = decision.follow(evaluation.condition)
                except Exception:
                    continue
                if decision.conditions:
                    self._step.hits.add((index, path))
                if held:
                    return index
        return None

    def evaluation(self) -> Evaluation:
        """The values of expressions at this moment; a signal that has failed fails again."""
        state = self._step.state
        return self._step.chart.generator.evaluation(
            self._step.memo, state.values, state.configuration.active, self._ask
        )

    def pick(self, selector: Selector, due: frozenset[int] | None) -> Picked:
        """The result of a selector after a fault in this step.

        A guard that needs a failed signal counts as false, and a transition that was undone is not tried again.
        """
        generator, evaluation = self._step.chart.generator, self.evaluation()
        found: list[int] = []
        for chain in selector.chains:
            for index in chain.candidates:
                if index in self._undone or (due is not None and index not in due):
                    continue
                decision = generator.decision(index)
                try:
                    held, path = decision.follow(evaluation.condition)
                except Exception as error:
                    self.report(index, error)
                    continue
                finally:
                    self.error = None
                if decision.conditions:
                    self._step.hits.add((index, path))
                if held:
                    if index not in found:
                        found.append(index)
                    break
        return (tuple(found) if len(found) > 1 else found[0]) if found else NONE

    def _ask(self, call: SignalValue) -> Any:
        """Evaluate a signal for the first time; the first such signal is the one that has just failed."""
        generator, values = self._step.chart.generator, self._step.state.values
        key = generator.key(call, values)
        error = self._signals.get(key)
        if error is None and self.error is not None:
            error, self.error = self.error, None
        if error is None:
            try:
                value = self._step.memo[key] = call.signal.function(self._step.facts, *generator.given(call, values))
            except Exception as raised:
                error = raised
            else:
                return value
        self._signals[key] = error
        raise SignalFault(call, error)

    def report(self, transition: int, error: Exception) -> None:
        """Announce a failed guard, once for each state and cause in a step."""
        declared = self._step.chart.model.transitions[transition]
        place, cause, reason = declared.place, error, f"the guard failed: {reason_of(error)}"
        known: Any = (declared.source, transition)
        if isinstance(error, SignalFault):
            known = (declared.source, self._step.chart.generator.key(error.call, self._step.state.values), None)
            place, reason = error.call.place or place, str(error)
            cause = error.__cause__ if isinstance(error.__cause__, Exception) else error
        if STORE in self._step.memo:
            self._step.queue.append(ScxmlEvent("error.execution", "platform", reason))
        elif known not in self._reported:
            self._reported.add(known)
            self._found.append(PendingFault(fault_event(declared.source), reason, place, cause))

    def of_action(self, block: Block, error: Exception) -> PendingFault:
        """The fault of a block of actions that failed."""
        place = block.place_of(error) or self._step.chart.model.states[block.state].place
        return PendingFault(fault_event(block.state), f"an action failed: {reason_of(error)}", place, error)
