"""The library that the motion skills are declared in; importing ``skills.activities`` fills it."""

from __future__ import annotations

from dataclasses import replace

from hsm.model.registry import Library
from skills.settings import SkillSettings

LIBRARY = Library("skills")


def library(settings: SkillSettings) -> Library:
    """The motion skills with a robot's gains: the declarations of ``LIBRARY``, their classes bound to ``settings``.

    An activity's class has its gains as the class attribute ``settings``, the defaults in ``LIBRARY`` itself.
    """
    import skills.activities  # noqa: F401, PLC0415  declares the activities

    configured = Library(LIBRARY.name)
    configured.include(LIBRARY)
    for name, declared in LIBRARY.activities.items():
        if isinstance(declared.factory, type):
            bound = type(declared.factory.__name__, (declared.factory,), {"settings": settings})
            configured.activities[name] = replace(declared, factory=bound)
    return configured
