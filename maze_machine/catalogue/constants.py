"""The constants of a robot that a machine can derive its lengths and speeds from."""

from __future__ import annotations

from hsm.model.registry import Library
from hsm.model.types import QUANTITY_NAMES, Quantity
from perception.facts import Facts
from skills.settings import SkillSettings
from transport.description import RobotDescription
from transport.messages import Command

_QUANTITIES: dict[str, Quantity] = {name: quantity for quantity, name in QUANTITY_NAMES.items()}


def robot_constants(robot: RobotDescription, settings: SkillSettings) -> Library[Facts, Command]:
    """The constants of a robot."""
    library: Library[Facts, Command] = Library("robot")
    length, speed, turn_rate = (_QUANTITIES[name] for name in ("length", "speed", "turn_rate"))
    library.constant("robot.radius", length, robot.radius, "Radius of the circle that the robot sweeps when it turns.")
    library.constant("robot.half_width", length, robot.half_width, "Half the width of the robot.")
    library.constant("robot.margin", length, settings.safety.margin, "Distance that the robot keeps from the walls.")
    library.constant("robot.speed", speed, robot.limits.speed, "Largest speed of the robot.")
    library.constant("robot.turn_rate", turn_rate, robot.limits.turn_rate, "Largest rate of rotation of the robot.")
    library.constant("laser.range", length, robot.laser.range_max, "Longest valid reading of the laser.")
    return library
