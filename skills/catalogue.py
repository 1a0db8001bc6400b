"""All names that skills offer to machines: motion skills, chance, and the memory of strategies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from hsm.model.registry import Activity, Library, Parameter
from hsm.model.types import QUANTITY_NAMES, Quantity
from perception.facts import Facts
from skills.activities.advance import Advance
from skills.activities.align import Align
from skills.activities.arc import Arc
from skills.activities.cross_space import CrossSpace
from skills.activities.door import Ring
from skills.activities.drive import Drive
from skills.activities.drive_to import DriveTo
from skills.activities.explore import Explore, GoToDoor
from skills.activities.follow_wall import FollowWall
from skills.activities.go_to import GoTo
from skills.activities.make_room import MakeRoom
from skills.activities.move import Move
from skills.activities.navigate_to_pose import NavigateToPose
from skills.activities.pass_corner import PassCorner
from skills.activities.reach_corner import LeaveJunction, ReachCorner
from skills.activities.rotate import Rotate
from skills.activities.stop import Stop
from skills.chance import chance
from skills.library import LIBRARY
from skills.settings import SkillSettings
from skills.strategies import marks, places
from transport.description import RobotDescription
from transport.messages import Command

ACTIVITIES: tuple[type[Activity[Facts, Command]], ...] = (
    Advance,
    Align,
    Arc,
    CrossSpace,
    Drive,
    DriveTo,
    Explore,
    FollowWall,
    GoTo,
    GoToDoor,
    LeaveJunction,
    MakeRoom,
    Move,
    NavigateToPose,
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
    places.map_known,
    places.map_doors,
    places.map_edges,
    places.map_unexplored,
    places.place_x,
    places.place_y,
    places.place_heading,
    places.place_visited,
    places.way_known,
    places.way_distance,
    places.way_time,
    places.way_turn,
    places.place_known,
    places.place_lost,
    places.place_deviation,
)
"""What it may ask, beside perception's signals."""

ACTIONS: tuple[Callable[..., Any], ...] = (
    marks.junction_arrive,
    marks.junction_mark,
    places.map_begin,
    places.place_mark,
)
"""What it may note."""


def library(settings: SkillSettings, robot: RobotDescription | None = None) -> Library[Facts, Command]:
    """What is listed here, for a robot.

    An activity's class has its robot and the robot's gains as the class attributes ``robot`` and ``settings``; here
    each is bound to them. Lengths and speeds that are left out of a call are given for the default robot and grow with
    the robot.

    Args:
        settings: the gains of the robot's motion skills.
        robot: the robot; by default PICO.
    """
    robot = robot or RobotDescription()
    activities = {one.factory: one for one in LIBRARY.activities.values()}
    signals = {one.function: one for one in LIBRARY.signals.values()}
    actions = {one.function: one for one in LIBRARY.actions.values()}
    configured: Library[Facts, Command] = Library(LIBRARY.name, enumerations=dict(LIBRARY.enumerations))
    for factory in ACTIVITIES:
        bound = type(factory.__name__, (factory,), {"settings": settings, "robot": robot, "__wrapped__": factory})
        declared = activities[factory]
        parameters = tuple(_fitted(parameter, robot) for parameter in declared.parameters)
        configured.activities[declared.name] = replace(declared, factory=bound, parameters=parameters)
    configured.signals.update((signals[one].name, signals[one]) for one in SIGNALS)
    configured.actions.update((actions[one].name, actions[one]) for one in ACTIONS)
    return configured


def _fitted(parameter: Parameter, robot: RobotDescription) -> Parameter:
    """A parameter whose default is that of a robot."""
    if parameter.required:
        return parameter
    match QUANTITY_NAMES.get(parameter.type) if isinstance(parameter.type, Quantity) else None:
        case "length":
            return replace(parameter, default=parameter.default * robot.relative_size)
        case "speed":
            return replace(parameter, default=parameter.default * robot.relative_speed)
        case _:
            return parameter
