"""Steering: the velocity of a base that brings the robot where a skill wants it; one law for each kind of base.

A skill determines where the robot should be, and the law computes the velocity. No skill sets a sideways velocity
itself.
"""

from skills.steering.law import Seeker, Steering, steering_of
from skills.steering.path import OnPath

__all__ = ["OnPath", "Seeker", "Steering", "steering_of"]
