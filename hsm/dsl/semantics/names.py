"""Sets of names that may contain unknown names: the error value of the compiler.

A line that cannot be read, or that uses an unknown name, may mean anything. What depends on it is a set with unknown
names: it contains every name, and any set that includes its names is unknown as well. So the compiler reports no
diagnostic that only follows from another one.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import field

from hsm.model.values import dataclass


@dataclass(slots=True)
class Names:
    """A set of names.

    Attributes:
        known: the names that are known.
        unknown: whether there may be any others.
    """

    known: set[str] = field(default_factory=set)
    unknown: bool = False

    def __contains__(self, name: object) -> bool:
        return self.unknown or name in self.known

    def add(self, name: str) -> None:
        """Put a name in."""
        self.known.add(name)

    def update(self, names: Iterable[str] | Names) -> None:
        """Put names in, unknown ones included."""
        if isinstance(names, Names):
            self.unknown |= names.unknown
            names = names.known
        self.known.update(names)

    def discard(self, name: str) -> None:
        """Take a name out, if it is known."""
        self.known.discard(name)

    def add_unknown(self) -> None:
        """Something belongs here, but it is not known what."""
        self.unknown = True
