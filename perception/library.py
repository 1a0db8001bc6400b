"""The library that perception's signals are declared in; importing ``perception.signals`` fills it."""

from hsm.model.registry import Library
from perception.facts import Facts
from transport.messages import Command

LIBRARY: Library[Facts, Command] = Library("perception")
