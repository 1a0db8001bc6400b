"""Steering: what to ask of a base so that the robot goes where a skill wants it; one law for each kind of base.

A skill says where the robot should be, the law which velocity brings it there. No skill writes a sideways velocity of
its own.
"""

from skills.steering.law import Seeker, Steering, steering_of
from skills.steering.path import OnPath

__all__ = ["OnPath", "Seeker", "Steering", "steering_of"]
