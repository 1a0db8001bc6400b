"""Skills' section of a robot profile: gains, distances and margins."""

from __future__ import annotations

from transport.section import Positive, Settings


class MotionSettings(Settings):
    """Feedback that every driving skill shares."""

    heading_gain: Positive = 2.5
    """Rate of rotation for an error of the heading, 1/s."""
    lateral_gain: Positive = 1.5
    """Sideways velocity for an error of the position, 1/s."""
    lateral_speed: Positive = 0.25
    """Largest sideways velocity of a correction, m/s."""
    settle: Positive = 1.2
    """A base that cannot move sideways slants so that it would be where it should be after this time, s."""
    dead_zone: Positive = 0.02
    """Errors of the position below this are left alone, m."""
    look_ahead: Positive = 0.5
    """How far in front the walls that guide the robot are looked at, m."""
    slow_gain: Positive = 1.5
    """Speed that is allowed for every metre of free way ahead, 1/s."""


class FollowWallSettings(Settings):
    """The virtual spring between the robot and the walls at its sides."""

    distance: Positive = 0.5
    """Distance from the robot's centre to the wall that it follows, where there is room, m."""
    corridor: Positive = 1.55
    """A passage up to this width is a corridor, in whose middle the robot drives unless it follows a wall, m."""
    keep_off: Positive = 0.4
    """Driving straight on, a wall at a side is kept at least this far from the robot's centre, m."""
    reach: Positive = 1.2
    """A wall farther to the side than this does not guide the robot, m."""


class RotateSettings(Settings):
    """Turning on the spot."""

    rate: Positive = 1.0
    """Rate of rotation, rad/s."""
    gain: Positive = 3.0
    """Rate of rotation for the angle that is left, 1/s."""
    tolerance: Positive = 0.03
    """The turn is over when less than this is left, rad."""
    room: Positive = 0.04
    """Distance that every corner of the robot keeps from the walls while it turns, m."""
    patience: Positive = 4.0
    """A turn that makes no headway for this long is blocked, s."""


class ArcSettings(Settings):
    """Turning while driving on, along a circle in a frame of its own."""

    smallest_radius: Positive = 0.2
    """Radius of the tightest turn, m."""
    largest_radius: Positive = 0.6
    """Radius of the widest turn, m."""
    gain: Positive = 2.0
    """Velocity for a distance from the path, 1/s."""
    turn_gain: Positive = 5.0
    """Rate of rotation for the angle that is left, 1/s."""
    tolerance: Positive = 0.05
    """The turn is over when less than this is left, rad."""


class RingSettings(Settings):
    """Ringing at a door and passing it."""

    settle: Positive = 0.3
    """Time that the robot stands still before it rings, s."""
    slack: Positive = 0.15
    """A way this much deeper than when the bell was rung is an opening, m."""


class SafetySettings(Settings):
    """The last word on every command."""

    margin: Positive = 0.12
    """Distance that the robot's outline keeps from anything that the laser sees, where there is room, m."""
    least_margin: Positive = 0.05
    """The same in passages that leave less room, m."""
    turn_away: Positive = 0.04
    """Of that distance a robot that cannot move sideways may lose so much by a turn away from a wall beside it, m."""
    spare: Positive = 0.03
    """In a narrow passage the margin is what a robot in its middle has at either side, less this, m."""
    reach: Positive = 1.0
    """Points farther away than this are left out of account, m."""
    push: Positive = 0.1
    """Velocity with which the robot moves away from what is nearer than the margin, m/s."""


class SkillSettings(Settings):
    """Everything tunable of the motion skills."""

    motion: MotionSettings = MotionSettings()
    """Feedback that every driving skill shares."""
    wall: FollowWallSettings = FollowWallSettings()
    """Following walls."""
    rotate: RotateSettings = RotateSettings()
    """Turning on the spot."""
    arc: ArcSettings = ArcSettings()
    """Turning while driving."""
    door: RingSettings = RingSettings()
    """Opening doors."""
    safety: SafetySettings = SafetySettings()
    """Keeping off the walls."""
