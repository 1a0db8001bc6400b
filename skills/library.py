"""The library that the motion skills are declared in; importing ``skills.activities`` fills it."""

from __future__ import annotations

from dataclasses import replace

from hsm.model.registry import Library, Parameter
from hsm.model.types import QUANTITY_NAMES, Quantity
from skills.settings import SkillSettings
from transport.description import RobotDescription

LIBRARY = Library("skills")


def library(settings: SkillSettings, robot: RobotDescription | None = None) -> Library:
    """The motion skills of a robot: the declarations of ``LIBRARY``, their classes bound to it and its gains.

    An activity's class has them as the class attributes ``settings`` and ``robot``, those of the default robot in
    ``LIBRARY`` itself. Lengths and speeds that are left out of a call are given for the default robot and grow with the
    robot.

    Args:
        settings: the gains of the robot's motion skills.
        robot: the robot; by default PICO.
    """
    import skills.activities  # noqa: F401, PLC0415  declares the activities

    robot = robot or RobotDescription()
    configured = Library(LIBRARY.name)
    configured.include(LIBRARY)
    for name, declared in LIBRARY.activities.items():
        if isinstance(declared.factory, type):
            attributes = {"settings": settings, "robot": robot, "__doc__": declared.factory.__doc__}
            bound = type(declared.factory.__name__, (declared.factory,), attributes)
            parameters = tuple(_fitted(parameter, robot) for parameter in declared.parameters)
            configured.activities[name] = replace(declared, factory=bound, parameters=parameters)
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
