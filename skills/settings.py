"""Skills' section of a robot profile: gains, distances and margins.

Lengths and speeds are given for the default robot and grow with the robot's radius and its largest speed, unless a
profile sets them. Values that are compared with the laser's noise do not grow: the dead zone and the tolerances.
"""

from __future__ import annotations

from transport.section import Length, Positive, Settings, Speed


class MotionSettings(Settings):
    """Feedback that every driving skill shares."""

    heading_gain: Positive = 2.5
    """Rate of rotation for an error of the heading, 1/s."""
    lateral_gain: Positive = 1.5
    """Sideways velocity for an error of the position, 1/s."""
    lateral_speed: Speed = 0.25
    """Largest sideways velocity of a correction, m/s."""
    settle: Positive = 1.2
    """A base that cannot move sideways slants so that it would be where it should be after this time, s."""
    to_spot_gain: Positive = 4.0
    """Velocity of a base on two wheels for the way that is left to where it turns, 1/s."""
    to_spot_speed: Speed = 0.4
    """Its largest velocity there, m/s."""
    dead_zone: Positive = 0.02
    """Errors of the position below this are left alone, m."""
    look_ahead: Length = 0.5
    """How far in front the walls that guide the robot are looked at, m."""
    standoff: Length = 0.2
    """Free way ahead of the robot's centre at which it has no speed left, m."""
    slow_gain: Positive = 1.5
    """Speed that is allowed for every metre of free way ahead, 1/s."""
    needed: Length = 0.1
    """What is ahead holds up a robot on two wheels only where it should be at least so far aside, m."""
    arrival: Speed = 0.05
    """The robot comes to rest from this speed, m/s."""


class FollowWallSettings(Settings):
    """The virtual spring between the robot and the walls on its sides."""

    distance: Length = 0.5
    """Distance from the robot's centre to the wall that it follows, where there is room, m."""
    corridor: Length = 1.55
    """A passage up to this width is a corridor, in whose middle the robot drives unless it follows a wall, m."""
    keep_off: Length = 0.4
    """Driving straight on, a wall on one side is kept at least this far from the robot's centre, m."""
    reach: Length = 1.2
    """A wall farther to the side than this does not guide the robot, m."""
    beyond: Length = 0.4
    """A wall is lost where nothing is nearer than the distance to keep and this, m."""


class PassageSettings(Settings):
    """The gap between the walls in which the robot drives."""

    reach: Length = 1.5
    """Points farther away than this do not bound it, m."""
    alongside: Length = 0.15
    """How far in front of an obstacle the walls on the sides are taken for the passage's, m."""
    aside: Length = 0.3
    """A gap farther aside than this from the robot's middle is another way, not the robot's passage, m."""
    spare: Length = 0.05
    """A gap must leave this on either side of the robot, m."""


class OpeningSettings(Settings):
    """An opening beside the robot, and the corners about which it turns."""

    near_corner: Length = 0.15
    """What lies farther ahead than this belongs to the far side of the opening, m."""
    smallest: Length = 0.45
    """What is narrower than this is not an opening for the robot, m."""
    same_wall: Length = 0.2
    """How far aside from the wall beside the robot its continuation may lie, m."""
    into: Length = 1.0
    """How far aside the bounds of the opening are looked for, m."""
    behind: Length = 0.5
    """What lies farther back than this is not the wall beside the robot, m."""
    least_speed: Speed = 0.1
    """The robot comes to its middle with this speed, m/s."""
    beside: Length = 0.1
    """What is nearer to the robot's line than this is not beside it, m."""
    aside: Length = 0.7
    """What is farther from the robot's line than this is not the corner about which it has turned, m."""


class TargetSettings(Settings):
    """Driving to a target past obstacles."""

    arrival: Speed = 0.08
    """The robot arrives at this speed, m/s."""
    near: Length = 0.5
    """Within this of the target the walls push the less the nearer it is, so that one beside a wall can be reached,
    m."""
    faced: Length = 0.3
    """Nearer than this the direction to the target says little, and a robot that can keeps its heading, m."""
    horizon: Length = 1.2
    """How far a robot on two wheels looks along a direction, m."""


class RotateSettings(Settings):
    """Turning on the spot."""

    rate: Positive = 1.0
    """Rate of rotation, rad/s."""
    gain: Positive = 3.0
    """Rate of rotation for the angle that is left, 1/s."""
    tolerance: Positive = 0.03
    """The turn is over when less than this is left, rad."""
    room: Length = 0.04
    """Distance that every corner of the robot keeps from the walls while it turns, m."""
    patience: Positive = 4.0
    """A turn without progress for this long is blocked, s."""


class ArcSettings(Settings):
    """Turning while driving on, along a circle in a frame of its own."""

    smallest_radius: Length = 0.2
    """Radius of the tightest turn, m."""
    largest_radius: Length = 0.6
    """Radius of the widest turn, m."""
    gain: Positive = 2.0
    """Velocity for a distance from the path, 1/s."""
    turn_gain: Positive = 5.0
    """Rate of rotation for the angle that is left, 1/s."""
    tolerance: Positive = 0.05
    """The turn is over when less than this is left, rad."""


class ExploreSettings(Settings):
    """Choosing where to drive on the map."""

    outward: Positive = 1.0
    """The way from there to the outside, as far as it is not known to be shut, counts this many times."""
    change: Positive = 2.0
    """Another place than the one chosen must be better by this much, s."""
    patience: Positive = 3.5
    """With no such place left the robot waits this long, s: a door that opens shows on the map a little later."""


class RingSettings(Settings):
    """Ringing at a door and passing it."""

    settle: Positive = 0.3
    """Time that the robot stands still before it rings, s."""
    slack: Length = 0.15
    """A way this much deeper than when the bell was rung is an opening, m."""


class SafetySettings(Settings):
    """The guard of every command."""

    margin: Length = 0.12
    """Distance that the robot's outline keeps from anything that the laser sees, where there is room, m."""
    least_margin: Length = 0.05
    """The same in passages that leave less room, m."""
    turn_away: Length = 0.04
    """Of that distance a robot that cannot move sideways may lose this much by a turn away from a wall beside it, m."""
    spare: Length = 0.03
    """In a narrow passage the margin is what a robot in its middle has on either side, less this, m."""
    foresee: Length = 0.35
    """Up to so far ahead of the robot's centre a passage may be narrower, m: where it can stop, and the margin there.
    Much farther ahead a turning robot would take the wall that it turns away from for one side of a narrow passage."""
    clear: Length = 0.2
    """Distance from the robot's outline that is enough room to continue, m."""
    reach: Length = 1.0
    """Points farther away than this are ignored, m."""
    push: Speed = 0.1
    """Velocity with which the robot moves away from what is nearer than the margin, m/s."""


class SkillSettings(Settings):
    """All settings of the motion skills."""

    motion: MotionSettings = MotionSettings()
    """Feedback that every driving skill shares."""
    wall: FollowWallSettings = FollowWallSettings()
    """Following walls."""
    passage: PassageSettings = PassageSettings()
    """The gap that the robot drives in."""
    opening: OpeningSettings = OpeningSettings()
    """Openings and corners on one side."""
    target: TargetSettings = TargetSettings()
    """Driving to a target."""
    rotate: RotateSettings = RotateSettings()
    """Turning on the spot."""
    arc: ArcSettings = ArcSettings()
    """Turning while driving."""
    door: RingSettings = RingSettings()
    """Opening doors."""
    explore: ExploreSettings = ExploreSettings()
    """Choosing where to drive on the map."""
    safety: SafetySettings = SafetySettings()
    """Keeping off the walls."""
