"""The selections of a step that only moves, as paths through decision trees.

A *look* is the selection of transitions for one trigger, an event or the conditions. For a configuration it
is a decision tree, a generated function (``hsm.engine.trees``). A *leaf* is where it ends
(``hsm.engine.configuration``): it knows which guards were decided and how, what was taken, and the truth of every
condition on the way. So a step records its leaf and the values of those signals that are not truth values; its record
and the coverage are computed from these on demand. The next look of the step is a tree that grows at the leaf where the
previous one ended, once steps have come that way a few times.

``SlowPath`` is raised if there is more to do; the step then runs in full (``hsm.engine.execution``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from typing import Any

from hsm.model.values import dataclass

WARM = 20
"""After this many full steps at a leaf a tree grows there: to make one takes as long."""

Found = tuple[Any, ...]
"""A leaf, and the values of the signals that it carries, in their order."""

Look = Callable[[Any, Sequence[Any], Found], Found]
"""Takes the facts, the variables and the leaf so far; returns the next leaf."""


class SlowPath(Exception):  # noqa: N818 - not an error
    """There is more to do than to move."""


class Interrupted(Exception):  # noqa: N818 - the error is its cause
    """A signal or an operation failed; the argument is the local variables of the function."""


@dataclass(frozen=True, slots=True)
class Known:
    """What is known at a place in a tree.

    Attributes:
        truths: conditions that were decided, by their code.
        flags: signals that were decided as conditions, by slot.
        carried: the other signals that were evaluated, by slot.
        path: the path through the conditions of the guard that is being decided.
        marks: the guards that were decided: the transition and the path through its conditions.
        picked: the transitions that the look has picked so far.
    """

    truths: Mapping[str, bool] = field(default_factory=dict[str, bool])
    flags: Mapping[int, bool] = field(default_factory=dict[int, bool])
    carried: tuple[int, ...] = ()
    path: int = 0
    marks: tuple[tuple[int, int], ...] = ()
    picked: tuple[int, ...] = ()
