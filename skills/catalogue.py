"""All that skills offer to machines, by name: motion skills, chance, and what the strategies must remember."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from hsm.model.registry import Activity, Library
from perception.facts import Facts
from skills.activities.advance import Advance
from skills.activities.align import Align
from skills.activities.arc import Arc
from skills.activities.cross_space import CrossSpace
from skills.activities.door import Ring
from skills.activities.drive import Drive
from skills.activities.drive_to import DriveTo
from skills.activities.follow_wall import FollowWall
from skills.activities.make_room import MakeRoom
from skills.activities.move import Move
from skills.activities.pass_corner import PassCorner
from skills.activities.reach_corner import LeaveJunction, ReachCorner
from skills.activities.rotate import Rotate
from skills.activities.stop import Stop
from skills.chance import chance
from skills.library import LIBRARY
from skills.settings import SkillSettings
from skills.strategies import marks
from transport.messages import Command

ACTIVITIES: tuple[type[Activity[Facts, Command]], ...] = (
    Advance,
    Align,
    Arc,
    CrossSpace,
    Drive,
    DriveTo,
    FollowWall,
    LeaveJunction,
    MakeRoom,
    Move,
    PassCorner,
    ReachCorner,
    Ring,
    Rotate,
    Stop,
)
"""What a machine may do."""

SIGNALS: tuple[Callable[..., Any], ...] = (
    chance,
    marks.junction_marks,
    marks.junction_leads_out,
    marks.junction_new,
)
"""What it may ask, beside perception's signals."""

ACTIONS: tuple[Callable[..., Any], ...] = (marks.junction_arrive, marks.junction_mark)
"""What it may note."""


def library(settings: SkillSettings) -> Library[Facts, Command]:
    """What is listed here with a robot's gains.

    An activity's class has its gains as the class attribute ``settings``; here each is bound to those of the robot.
    """
    activities = {one.factory: one for one in LIBRARY.activities.values()}
    signals = {one.function: one for one in LIBRARY.signals.values()}
    actions = {one.function: one for one in LIBRARY.actions.values()}
    configured: Library[Facts, Command] = Library(LIBRARY.name, enumerations=dict(LIBRARY.enumerations))
    for factory in ACTIVITIES:
        bound = type(factory.__name__, (factory,), {"settings": settings})
        configured.activities[activities[factory].name] = replace(activities[factory], factory=bound)
    configured.signals.update((signals[one].name, signals[one]) for one in SIGNALS)
    configured.actions.update((actions[one].name, actions[one]) for one in ACTIONS)
    return configured
