"""The input of the checks: a machine, as far as it could be compiled, and the facts about it that are uncertain."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from typing import NamedTuple

from hsm.model.chart import Model, State, StateKind
from hsm.model.diagnostics import Place
from hsm.model.expressions import Expression
from hsm.model.values import dataclass

PSEUDO = (StateKind.SHALLOW_HISTORY, StateKind.DEEP_HISTORY)
"""The kinds of pseudostates."""


@dataclass(frozen=True, slots=True)
class Stay:
    """A ``stay`` line: no transition should fire while its condition holds, or never if it has none.

    Attributes:
        condition: None without one, or where it is invalid.
        place: where it is written.
        always: it has no condition.
    """

    condition: Expression | None
    place: Place
    always: bool


class Unused(NamedTuple):
    """Something that is declared and never used.

    Attributes:
        kind: ``import``, ``parameter``, ``variable``, ``event``, ``outside event`` or ``raised event``.
        name: its name.
        place: where it is declared.
    """

    kind: str
    name: str
    place: Place


@dataclass(frozen=True, slots=True)
class AnalysisInput:
    """One file's machine for the checks; only what is written in this file is reported.

    Attributes:
        file: the file's name.
        model: the machine; where the file has errors, without what could not be understood.
        stays: the ``stay`` lines of each state, by its index.
        doubtful: names that may be declared on lines that could not be read; nothing is reported about those.
        leading_anywhere: some transition may lead anywhere, because its target is not known.
        uncertain: transitions of which something is not known, by index.
        awaiting_unknown: states that may wait for more than is known, by index.
        erroneous: states whose own declaration is invalid.
        reporting_unknown: states in which something reports outcomes that are not known.
        unused: what is declared and never used.
    """

    file: str
    model: Model
    stays: Mapping[int, tuple[Stay, ...]]
    doubtful: Container[str] = frozenset()
    leading_anywhere: bool = False
    uncertain: frozenset[int] = frozenset()
    awaiting_unknown: frozenset[int] = frozenset()
    erroneous: frozenset[int] = frozenset()
    reporting_unknown: frozenset[int] = frozenset()
    unused: tuple[Unused, ...] = ()

    def own_states(self) -> Iterator[State]:
        """The states that are written in this file, without the machine itself and history states."""
        for state in self.model.states[1:]:
            if state.kind in PSEUDO or state.index in self.erroneous:
                continue
            if state.place is not None and state.place.file == self.file:
                yield state
