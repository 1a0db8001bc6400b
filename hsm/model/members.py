"""Members: machines of one run that have a robot each, and the names under which the whole knows their libraries.

What a member named ``red`` calls ``space.left`` is ``red.space.left`` in the whole, and asks the facts of that robot:
the facts of a run with members are a mapping from their names.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

from hsm.model.registry import (
    ActionDeclaration,
    Activity,
    ActivityDeclaration,
    Library,
    Outcome,
    SignalDeclaration,
    stop_activity,
)

_D = TypeVar("_D", SignalDeclaration, ActionDeclaration, ActivityDeclaration)


class MemberActivity:
    """An activity of a member: it is given the facts of that member alone."""

    def __init__(self, member: str, inner: Activity[Any, Any]) -> None:
        self._member = member
        self._inner = inner

    def tick(self, facts: Mapping[str, Any]) -> Any | Outcome:
        """Do the part of one step."""
        return self._inner.tick(facts[self._member])

    def stop(self) -> None:
        """Notify it that its state is left, if it has a method for that."""
        stop_activity(self._inner)


class Owned:
    """What a member may name, under the names of the whole; the same declaration gives the same result.

    Args:
        member: the member's name.
    """

    def __init__(self, member: str) -> None:
        self._member = member
        self._made: dict[tuple[type, str], Any] = {}

    def signal(self, declared: SignalDeclaration) -> SignalDeclaration:
        """A signal of this member."""
        return self._once(declared, function=self._asking(declared.function))

    def action(self, declared: ActionDeclaration) -> ActionDeclaration:
        """An action of this member."""
        return self._once(declared, function=self._asking(declared.function))

    def activity(self, declared: ActivityDeclaration) -> ActivityDeclaration:
        """An activity of this member; what it holds is this member's."""

        def begin(*arguments: Any) -> MemberActivity:
            return MemberActivity(self._member, declared.factory(*arguments))

        holds = tuple(f"{self._member}.{one}" for one in declared.holds)
        return self._once(declared, factory=begin, holds=holds)

    def _asking(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def ask(facts: Mapping[str, Any], *arguments: Any) -> Any:
            return function(facts[self._member], *arguments)

        return ask

    def _once(self, declared: _D, **changes: Any) -> _D:
        """The declaration under its name in the whole, made once."""
        key = (type(declared), declared.name)
        if key not in self._made:
            self._made[key] = replace(declared, name=f"{self._member}.{declared.name}", **changes)
        made: _D = self._made[key]
        return made


def library_of_members(library: Library[Any, Any], members: Iterable[str]) -> Library[Any, Any]:
    """What a machine with members may name: the library of each, under its name.

    Args:
        library: what each of them may name.
        members: their names; without any, the library stays as it is.
    """
    names = tuple(members)
    if not names:
        return library
    found: Library[Any, Any] = Library(library.name, events=dict(library.events), constants=dict(library.constants))
    found.enumerations, found.folders = dict(library.enumerations), list(library.folders)
    for owned in map(Owned, names):
        for signal in map(owned.signal, library.signals.values()):
            found.signals[signal.name] = signal
        for activity in map(owned.activity, library.activities.values()):
            found.activities[activity.name] = activity
        for action in map(owned.action, library.actions.values()):
            found.actions[action.name] = action
    return found
