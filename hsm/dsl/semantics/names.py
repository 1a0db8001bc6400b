"""Sets of names that may contain unknown names: the error value of the compiler.

A line that cannot be read, or that uses an unknown name, may mean anything. What depends on it is a set with unknown
names: it contains every name, and any set that includes its names is unknown as well. So the compiler reports no
diagnostic that only follows from another one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
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

    def __bool__(self) -> bool:
        return self.unknown or bool(self.known)

    def __contains__(self, name: object) -> bool:
        return self.unknown or name in self.known

    def has_part_of(self, name: str) -> bool:
        """Whether it contains a name, or the owner of what has that name."""
        return name in self or self.has_owner_of(name)

    def has_owner_of(self, name: str) -> bool:
        """Whether it contains a name before a dot in a name: what an unknown owner has is unknown, too."""
        return any(one in self for one in _owners(name))

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

    def add_probable(self, name: str | None) -> None:
        """Put in the name that was probably meant; None where it is not known which."""
        if name is None:
            self.add_unknown()
        else:
            self.add(name)

    def add_unknown(self) -> None:
        """Something belongs here, but it is not known what."""
        self.unknown = True


def _owners(name: str) -> Iterator[str]:
    """The names that a name with dots begins with, the longest first."""
    while name := name.rpartition(".")[0]:
        yield name
