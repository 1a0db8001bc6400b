"""The one library that a machine for these robots is checked against and runs with."""

from __future__ import annotations

import perception.library
import perception.signals
import skills.library
from controller.machines import SHIPPED
from hsm.registry import Library
from skills.settings import SkillSettings


def robot_library(settings: SkillSettings | None = None) -> Library:
    """Everything that a maze robot's machine may name: perception's signals, motion skills, the door bell, events.

    What a machine imports is looked for among the shipped machines, too.

    Args:
        settings: the gains of the robot's motion skills; by default those of PICO.
    """
    library = Library("maze robot", folders=[SHIPPED])
    library.include(perception.library.LIBRARY)
    library.include(skills.library.library(settings or SkillSettings()))
    return library
