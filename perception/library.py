"""The library that perception's signals are declared in; importing ``perception.signals`` fills it."""

from hsm.model.registry import Library

LIBRARY = Library("perception")
