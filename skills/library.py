"""The library that the motion skills are declared in; importing ``skills.activities`` fills it."""

from hsm.registry import Library

LIBRARY = Library("skills")
