"""Where the looks of a step end that only moves: what was seen on the way, made once and shared by all runs.

A *look* is the search for transitions that one trigger, an event or the conditions, can fire. For a configuration it is
a decision tree, a generated function (``hsm.engine.trees``). A *leaf* is where it ends: it knows which guards were
decided and how, what was taken, and the truth of every condition on the way. So a step leaves behind its leaf and the
values of those signals that are no truth values; its record and the coverage are worked out from these when somebody
asks. The next look of the step is a tree that grows at the leaf where the one before ended, once steps have come that
way a few times.

``SlowPath`` is raised where there is more to do; the step is then done in full (``hsm.engine.execution``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

if TYPE_CHECKING:
    from hsm.engine.configuration import Configuration, Picked, Plan

WARM = 20
"""So many steps are done in full at a leaf before a tree grows there: to make one takes as long."""

Found = tuple[Any, ...]
"""A leaf, and the values of the signals that it carries, in their order."""

Look = Callable[[Any, Sequence[Any], Found], Found]
"""Takes the facts, the variables and what was found so far; gives what is found now."""


class SlowPath(Exception):  # noqa: N818 - not an error
    """There is more to do than to move."""


class Interrupted(Exception):  # noqa: N818 - the error is its cause
    """A signal or an operation failed; the argument is the local variables of the function."""


class Looked(NamedTuple):
    """One look that is over.

    Attributes:
        event: what was looked for; None for conditions.
        configuration: where.
        plan: what was taken; None where nothing was.
    """

    event: str | None
    configuration: Configuration
    plan: Plan | None


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


class Grower(Protocol):
    """Makes the trees of a machine, and knows its signals."""

    def grow(self, leaf: Leaf, event: str | None) -> Look:
        """The next look after a leaf: for an event, for conditions, or the rest of one that was cut."""

    def keys(self, slots: Sequence[int], values: Sequence[Any]) -> Iterator[Any]:
        """Where the values of signals are kept within a step, given the variables."""


class Leaf:
    """Where a look ended, or was cut because its function is large enough.

    Attributes:
        grower: makes the trees.
        known: what is known here.
        looked: the looks that are over.
        after: the configuration now.
        grown: how many trees grow from the same root as this leaf; one list for all of its leaves.
        move: the event, or None for conditions, and what was picked for it, before steps go on from here.
        rest: makes the rest of a look that was cut.
        go: the rest of a look that was cut, or else the next look for conditions; None where the step is over.
        found: the leaf as what is found, where it carries no values.
    """

    __slots__ = ("_events", "_visits", "after", "found", "go", "grower", "grown", "known", "looked", "move", "rest")

    def __init__(
        self,
        grower: Grower,
        after: Configuration,
        known: Known | None = None,
        looked: tuple[Looked, ...] = (),
        grown: list[int] | None = None,
        *,
        move: tuple[str | None, Picked] | None = None,
        rest: Callable[[Leaf], Look] | None = None,
    ) -> None:
        self.grower = grower
        self._visits = 0
        self.after = after
        self.known = known or Known()
        self.looked = looked
        self.grown = [0] if grown is None else grown
        self.move = move
        self.rest = rest
        self.found: Found = (self,)
        self.go: Look | None = self.advance
        self._events: dict[str, Look] = {}

    @property
    def plans(self) -> Iterator[Plan]:
        """The microsteps taken, in order."""
        return (one.plan for one in self.looked if one.plan is not None)

    def advance(self, facts: Any, values: Sequence[Any], found: Found) -> Found:
        """Make what goes on from here, and go on."""
        self.go = go = self.grow(None)
        return go(facts, values, found)

    def event(self, event: str) -> Look:
        """The next look for an event.

        Raises:
            SlowPath: there is none yet.
        """
        look = self._events.get(event)
        if look is None:
            look = self._events[event] = self.grow(event)
        return look

    def grow(self, event: str | None) -> Look:
        """The next look, once the leaf is warm.

        Raises:
            SlowPath: it is not, or what was picked does more than move.
        """
        self._visits += 1
        if self._visits <= WARM:
            raise SlowPath
        if self.move is not None:
            trigger, picked = self.move
            plan = self.after.moves.get(picked)
            if plan is None:
                raise SlowPath
            self.looked = (*self.looked, Looked(trigger, self.after, plan))
            self.after = plan.target
            self.move = None
        return self.grower.grow(self, event)

    def memo(self, found: Found, values: Sequence[Any]) -> dict[Any, Any]:
        """The signals evaluated on the way, by key.

        Args:
            found: this leaf with the values that it carries.
            values: the variables.
        """
        seen = {**self.known.flags, **dict(zip(self.known.carried, found[1:], strict=True))}
        return dict(zip(self.grower.keys(tuple(seen), values), seen.values(), strict=True))

    def interrupted(self, found: Found, values: Sequence[Any], names: Mapping[str, Any]) -> dict[Any, Any]:
        """The signals evaluated until the look after this leaf was interrupted, by key.

        Args:
            found: this leaf with the values that it carries.
            values: the variables.
            names: the local variables of the look, in which `s3` is the signal with slot 3.
        """
        fetched = {int(name[1:]): value for name, value in names.items() if name[0] == "s"}
        keys = self.grower.keys(tuple(fetched), values)
        return {**self.memo(found, values), **dict(zip(keys, fetched.values(), strict=True))}
