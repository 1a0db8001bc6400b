"""The library that perception's signals are declared in; importing ``perception.signals`` fills it."""

from hsm.registry import Library

LIBRARY = Library("perception")
