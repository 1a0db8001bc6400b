"""Where the skills are declared, each by its own module; ``skills.catalogue`` lists them all."""

from __future__ import annotations

from hsm.model.registry import Library
from perception.facts import Facts
from transport.messages import Command

LIBRARY: Library[Facts, Command] = Library("skills")
