"""The ``when`` lines of a machine as steps meet them: which notes about them some step may confirm.

The checks of a file decide these line by line, for any values. Here they are decided at every place within a step that
the graph of the whole machine comes to: with what its variables may be there, and with the states of other regions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field, replace

from hsm.engine.machine import Machine
from hsm.model.chart import Model, When
from hsm.model.diagnostics import Diagnostic, Place
from hsm.model.values import dataclass
from hsm.testing.proofs.diagrams import FALSE, Diagram
from hsm.testing.proofs.places import reached_places
from hsm.testing.proofs.points import Part, Point
from hsm.testing.proofs.points import Place as StepPlace
from hsm.testing.proofs.selections import Selections
from hsm.testing.scenarios.script import scripted_machine

OVERLAP = "N0701"
GAP = "N0702"


@dataclass(slots=True)
class Tables:
    """What steps may meet.

    Attributes:
        both: pairs of transitions that may be enabled together, the earlier one first.
        first: pairs of which the earlier one may be enabled without the other.
        second: pairs of which the later one may be.
        gaps: states of whose own lines none may be enabled.
    """

    both: set[tuple[int, int]] = field(default_factory=set)
    first: set[tuple[int, int]] = field(default_factory=set)
    second: set[tuple[int, int]] = field(default_factory=set)
    gaps: set[int] = field(default_factory=set)

    def confirmed(self, found: Iterable[Diagnostic], model: Model) -> Iterator[Diagnostic]:
        """Diagnostics without those about ``when`` lines that no step can meet.

        Args:
            found: the diagnostics.
            model: the machine.
        """
        lines = {one.place: one.index for one in model.transitions if isinstance(one.trigger, When)}
        states = {one.place: one.index for one in model.states}
        for one in found:
            if one.code == GAP and one.place in states and states[one.place] not in self.gaps:
                continue
            if one.code == OVERLAP and one.place in lines:
                related = tuple(other for other in one.related if self._meets(lines, other.place, one.place, model))
                if related:
                    yield one if related == one.related else replace(one, related=related)
                continue
            yield one

    def _meets(self, lines: Mapping[Place | None, int], earlier: Place, later: Place | None, model: Model) -> bool:
        pair = (lines.get(earlier, -1), lines[later])
        if model.transitions[pair[0]].source != model.transitions[pair[1]].source:
            return True
        return pair in self.both and pair in self.first and pair in self.second


def tables(machine: Machine | Model) -> Tables | None:
    """What the steps of a machine may meet, with the default values of its parameters; None where not all are known."""
    ready = scripted_machine(machine)
    model = ready.model
    if any(one.required for one in model.parameters):
        return None
    known = reached_places(ready, [one.default for one in model.parameters])
    if known is None:
        return None
    found, selections = Tables(), Selections(ready, known.graph.evaluator)
    for place, among in known.reached.items():
        if _looks(place):
            _note(found, selections, ready, place[1], among)
    return found


def _looks(place: StepPlace) -> bool:
    """Whether a step looks at the ``when`` lines at a place."""
    stage, point, queue = place
    waits = stage.moved or stage.recalled or stage.heard or queue
    return stage.part is Part.CONDITIONS and not waits and point.outcome is None


def _note(found: Tables, selections: Selections, machine: Machine, point: Point, among: Diagram) -> None:
    """Note what a step meets at one place with some signals."""
    both, configuration = selections.diagrams.both, machine.configuration(point.leaves)
    if configuration.when is None:
        return
    if configuration.always is not None:
        quiet = dict(selections.choices(configuration.always, point)).get(None, FALSE)
        among = both(among, quiet)
    transitions = machine.model.transitions
    seen = {index for chain in configuration.when.chains for index in chain.candidates}
    for state in {transitions[index].source for index in seen}:
        own = sorted(index for index in seen if transitions[index].source == state)
        guards = {index: selections.guard(index, point) for index in own}
        left = among
        for number, later in enumerate(own):
            for earlier in own[:number]:
                one, other, pair = guards[earlier], guards[later], (earlier, later)
                for kind, truths in (
                    (found.both, (one.true, other.true)),
                    (found.first, (one.true, other.false)),
                    (found.second, (one.false, other.true)),
                ):
                    if pair not in kind and both(both(among, truths[0]), truths[1]) != FALSE:
                        kind.add(pair)
            left = both(left, guards[later].false)
        if left != FALSE:
            found.gaps.add(state)
