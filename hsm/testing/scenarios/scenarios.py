"""Scenarios as values: what is given, what happens, what is expected."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import field
from typing import Any

from hsm.model.diagnostics import Place
from hsm.model.expressions import Expression
from hsm.model.values import dataclass
from hsm.testing.scenarios.script import Performed, SignalKey

SignalValues = Mapping[str | SignalKey, Any]
"""Values of signals, by name or by name and arguments."""


@dataclass(frozen=True, slots=True)
class Stimulus:
    """One step of the machine, or several while time passes.

    Attributes:
        after: seconds that pass before the step; None for one tick.
        signals: signals that change.
        reports: outcomes by the name of an activity or of the state whose activity it is.
        events: events from outside.
        place: where it is written.
    """

    after: float | None = None
    signals: SignalValues = field(default_factory=dict)
    reports: Mapping[str, str] = field(default_factory=dict)
    failing: frozenset[str] = frozenset()
    events: tuple[str, ...] = ()
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class InState:
    """A state is active, or is not."""

    state: str
    negated: bool = False


@dataclass(frozen=True, slots=True)
class Performs:
    """An activity runs, or an action was called in the last step; or is not, was not.

    Attributes:
        name: of the activity or action.
        arguments: what it is given; None for anything.
        action: an action, not an activity.
        negated: it is not so.
    """

    name: str
    arguments: Mapping[int, Any] | None = None
    action: bool = False
    negated: bool = False

    def matches(self, performed: Performed) -> bool:
        """Whether a running activity or a called action matches; arguments that are not known do not."""
        given, known = (self.arguments or {}).items(), performed.arguments
        return performed.name == self.name and all(
            index < len(known) and close(known[index], value) for index, value in given
        )


@dataclass(frozen=True, slots=True)
class Raises:
    """The machine raised an event in the last step, or did not.

    Attributes:
        event: its name.
        negated: it did not.
        sent: it sent it to other machines.
    """

    event: str
    negated: bool = False
    sent: bool = False


@dataclass(frozen=True, slots=True)
class ConditionHolds:
    """A condition over variables, parameters and signals is true."""

    condition: Expression


@dataclass(frozen=True, slots=True)
class ExpectationClause:
    """One thing that is expected, with its text."""

    content: InState | Performs | Raises | ConditionHolds
    text: str

    @property
    def lasts(self) -> bool:
        """Whether it can hold at any moment: a state, a condition or an activity, not what is over within a step."""
        match self.content:
            case Raises() | Performs(action=True):
                return False
        return True


@dataclass(frozen=True, slots=True)
class Expectation:
    """What is expected to hold now, or to come to hold.

    Attributes:
        claims: all of them.
        within: seconds within which they come to hold together; None for now.
        place: where it is written.
    """

    claims: tuple[ExpectationClause, ...]
    within: float | None = None
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Scenario:
    """A test of a machine.

    Attributes:
        name: its title.
        parameters: the machine's parameters that differ from the defaults, in SI units.
        given: signals before the start.
        steps: what happens and what is expected, in order.
        place: the place of its title.
        covers: the requirements that it covers, each with the place of its name.
    """

    name: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    given: SignalValues = field(default_factory=dict)
    steps: tuple[Stimulus | Expectation, ...] = ()
    place: Place | None = None
    covers: Mapping[str, Place | None] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Requirement:
    """What is required of a machine.

    Attributes:
        name: its name, as in ``R1``.
        text: what is required, in words.
        place: where it is stated.
    """

    name: str
    text: str
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Suite:
    """The scenarios of one file.

    Attributes:
        file: its name.
        machine: name of the machine that is tested.
        tick: seconds from one step to the next.
        scenarios: in the order of the file.
        requirements: those that the file states.
        covered: the requirements that properties of the machine cover, by the property's name.
    """

    file: str
    machine: str
    tick: float
    scenarios: tuple[Scenario, ...]
    requirements: tuple[Requirement, ...] = ()
    covered: Mapping[str, Mapping[str, Place | None]] = field(default_factory=dict)


def close(one: Any, other: Any) -> bool:
    """Whether two values are equal except for rounding."""
    if isinstance(one, float) or isinstance(other, float):
        both_nan = one != one and other != other  # noqa: PLR0124 - only NaN differs from itself
        return both_nan or math.isclose(one, other, rel_tol=1e-9, abs_tol=1e-9)
    return bool(one == other)
