"""Perception's section of a robot profile: thresholds and sizes.

Lengths are given for the default robot and grow with the robot's radius, unless a profile says them. What is measured
against the laser's noise does not grow, nor do the odometry's steps.
"""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from perception.mapping.settings import MappingSettings
from transport.section import Grows, Length, NotNegative, Positive, Settings

Share = Annotated[float, Field(ge=0, le=1)]
Count = Annotated[int, Field(ge=1, le=100_000)]
Step = Annotated[float, Field(ge=0.002, le=1.6, allow_inf_nan=False)]
"""Of a grid, m or rad: a finer one would take more memory than there is."""
Cell = Annotated[Step, Grows(size=1)]
"""A step, m, that grows with the radius of the robot."""
Reach = Annotated[float, Field(gt=0, le=10, allow_inf_nan=False), Grows(size=1)]
"""How far a grid goes, m; it grows with the radius of the robot."""
LengthOrZero = Annotated[NotNegative, Grows(size=1)]
"""A length, m, that may be zero and grows with the radius of the robot."""


class LineSettings(Settings):
    """Extraction of straight walls."""

    split: Positive = 0.03
    """A piece is split where a hit is farther than this from its chord, m: three times the noise."""
    merge: Positive = 0.001
    """Neighbours are put together again if their hits deviate from one line by at most that much more than from two, m
    (root mean square)."""
    nearest: Length = 0.2
    """Walls are at least so far from the sensor, m: neighbouring hits too far apart for that belong to two walls."""
    jump: Positive = 0.05
    """This much farther apart than that, m."""
    max_missing: Annotated[int, Field(ge=0)] = 3
    """This many beams without a hit do not interrupt a wall."""
    min_hits: Annotated[int, Field(ge=3)] = 5
    """A wall has at least this many hits."""
    min_length: Length = 0.1
    """A wall is at least this long, m."""
    max_residual: Positive = 0.03
    """Root mean square distance of a wall's hits from its line, at most, m."""


class CompassSettings(Settings):
    """Misalignment with the walls."""

    world_angle: Positive = math.pi / 2
    """Walls meet at multiples of this angle, rad."""
    spread: Positive = math.radians(6)
    """Walls within this angle of each other agree, rad."""
    min_length: Length = 0.4
    """Total length of the walls that must agree before anything is said, m."""
    min_confidence: Share = 0.4
    """Share of the walls' weight that must agree before anything is said."""
    range_noise: Positive = 0.006
    """Standard deviation of a reading, m; uniform noise of 1 cm has 0.58 cm."""


class HoughSettings(Settings):
    """The Hough transform of 2015."""

    area: Reach = 2.0
    """Half the width of the trust area, m."""
    step: Step = math.radians(1)
    """Angle between two columns of the grid, rad."""
    cell: Step = 0.02
    """Distance between two lines of the grid, m."""
    min_share: Share = 0.08
    """A wall has at least this share of the hits in the trust area."""
    apart: Length = 0.2
    """Parallel walls are at least so far apart, m."""


class LandmarkSettings(Settings):
    """Landmarks in the form of 2015."""

    min_hits: Count = 20
    """A landmark has at least this many hits; 2015 asked for 100 of 1000."""
    max_gap: Length = 0.3
    """A longer gap ends a wall, m: less than what a robot fits through."""
    same_angle: Positive = math.radians(4)
    """Pieces turned less than this from each other may be one wall, rad."""
    same_distance: Positive = 0.04
    """Their distances from the robot may differ by this, m."""


class NodeSettings(Settings):
    """Ends and corners of walls (2017)."""

    arm: Length = 0.15
    """Distance of the two neighbours for the right-angle test, m."""
    pythagoras: Positive = 0.15
    """How far the neighbours' distance may be from what Pythagoras gives, as a share of it."""
    apart: Length = 0.1
    """Connected nodes are at least so far apart, m."""
    min_hits: Count = 5
    """A run of fewer hits has no nodes."""


class MinimapSettings(Settings):
    """The map around the robot."""

    half_size: Reach = 1.5
    """From the robot to the map's border, m."""
    cell: Cell = 0.05
    """Width of a cell, m."""


class SpaceSettings(Settings):
    """Space to the left, ahead and to the right, by beams of some width (2017)."""

    width: Positive = math.radians(10)
    """Angle over which a beam looks, rad."""
    side: Length = 0.9
    """There is space to a side when nothing is nearer than this, m from the robot's origin."""
    front: Length = 0.55
    """There is space ahead when nothing is nearer than this, m from the robot's origin."""
    bad_share: Share = 0.05
    """Share of a beam's readings that may be bad: this many of the shortest are skipped."""


class ExitSettings(Settings):
    """Whether the robot has left the maze."""

    range: Length = 10.0
    """Nothing may be in the robot's lane within this distance, m; more than the largest open space's length."""
    beside: Length = 0.35
    """What bounds the lane is at most so far before or behind the robot's origin, m."""
    max_half_width: Length = 1.5
    """And at most so far to a side, m."""
    widening: LengthOrZero = 0.1
    """The lane reaches so far into the walls, m; more than the noise and an offset of the walls."""
    margin: NotNegative = 0.02
    """How far the robot's rear must be past the end of the walls, m; more than the noise."""
    known_share: Share = 0.9
    """Share of the readings that must be known."""
    ticks: Count = 3
    """For this many ticks in a row."""


class WallSettings(Settings):
    """The nearest wall on one side."""

    half_angle: Positive = math.radians(60)
    """The wall's nearest point is within this angle of straight left or right, rad."""
    min_length: Length = 0.2
    """Shorter pieces are not followed, m."""


class CentreSettings(Settings):
    """The middle of the corridor."""

    behind: LengthOrZero = 0.1
    """The walls are sought from so far behind the robot's origin, m."""
    ahead: Length = 1.0
    """To this far ahead of it, m: a limited depth, so that a bend behind an opening does not pull."""
    min_overlap: Length = 0.15
    """This much of a wall must lie within that stretch, m."""
    parallel: Positive = math.radians(12)
    """How far a wall of the corridor may be from parallel, rad."""
    max_half_width: Length = 1.0
    """A wall farther than this to a side is not a wall of the corridor, m."""


class RepulsionSettings(Settings):
    """The artificial potential field (2017)."""

    gain: Annotated[Positive, Grows(size=2, speed=1)] = 0.02
    """Scale of the force, m^3/s: with it the force reads as a velocity in m/s."""
    width_correction: LengthOrZero = 0.15
    """Taken off every distance for the robot's own size, m."""
    influence: Length = 1.5
    """Hits farther than this do not repel, m."""
    front: Positive = math.radians(60)
    """The whole angle ahead that makes the force along x, rad; the other beams make the force along y."""


class DoorSettings(Settings):
    """Door areas by the rules: a dead end between side walls."""

    min_width: Length = 0.5
    """Shortest dead-end wall, m."""
    max_width: Length = 1.5
    """Longest dead-end wall, m."""
    min_side: Length = 0.3
    """Shortest side wall, m."""
    margin: LengthOrZero = 0.06
    """Tolerance on these sizes, m."""
    corner_gap: Length = 0.1
    """The end of a wall and the beginning of the next within this distance are one corner, m."""
    square: Positive = math.radians(15)
    """How far a corner may be from a right angle, rad."""
    range: Length = 1.3
    """The door opens for a robot of which no part is farther from it than this, m."""
    rule_range: Positive = 1.3
    """Nor from farther away by the rules, however large the robot is, m."""
    range_margin: NotNegative = 0.01
    """How far inside the rule's area the robot shall be before it counts as near, m."""
    ahead: Positive = math.radians(30)
    """A door is ahead when its direction is within this angle of straight on, rad."""
    depth_margin: Length = 0.15
    """On the minimap the way to a door ends at most this far before or after it, m."""
    same_place: Length = 0.5
    """Two doors nearer than this are the same one, m; more than dead reckoning drifts in a run."""
    passage_margin: LengthOrZero = 0.05
    """Free space wanted on each side of the robot for passing an open door, m."""
    inner_share: Share = 0.8
    """The inner share of a door's width is looked at for its opening; beams at its edges meet the walls beyond it."""
    seen_depth: Length = 0.08
    """A beam that goes so far beyond the door's place goes through it, m."""
    opened_depth: Length = 0.3
    """Free space wanted beyond an open door, m."""


class JunctionSettings(Settings):
    """Junctions: into which ways the robot's box fits."""

    clearance: LengthOrZero = 0.05
    """The box is wider than the robot by this on each side, m; more than the noise."""
    depth: Length = 0.25
    """How deep the box must fit beyond the wall, m: less than a door area's side walls, more than an offset."""
    edge: Length = 0.08
    """What is nearer than this beyond the wall's line belongs to the wall, m."""
    ahead: Length = 0.9
    """A way to a side that begins farther ahead than this belongs to a later junction, m."""
    behind: LengthOrZero = 0.3
    """Walls that end farther behind the robot than this are past, m."""
    beside: Length = 0.2
    """The end of a wall across is beside the robot up to here, m; farther ahead the corridor becomes narrow there."""
    assumed_wall: Length = 0.75
    """Where no wall is seen on one side, it is taken to be this far away, m."""
    max_wall: Length = 1.6
    """A wall farther than this to a side does not bound the corridor, m."""
    max_offset: Length = 0.25
    """Two walls of a side may be offset by this, m."""
    box_reach: Length = 0.15
    """The ends of a gap's walls are this near to it, m."""
    max_width: Length = 2.2
    """A way wider than this is an open space, m."""
    recess: Length = 0.6
    """A way that ends within this depth is a recess, m."""
    max_recess_width: Length = 1.7
    """A recess wider than this is not a way but a recessed wall, m: wider than any door."""
    open_half_angle: Positive = math.radians(40)
    """Half of the angle ahead that is empty in an open space, rad."""
    open_range: Length = 3.0
    """To this distance, m."""
    door_depth: Length = 1.3
    """A way that ends within this depth may be a door, m."""


class MarkSettings(Settings):
    """Marks at junctions."""

    same_place: Length = 0.35
    """Two junctions nearer than this are the same one, m; more than dead reckoning drifts in a run."""


class OdometrySettings(Settings):
    """Dead reckoning."""

    heading_gain: Share = 0.3
    """Share of the compass's correction that is taken in each tick."""
    max_correction: Positive = math.radians(20)
    """A compass that disagrees more than this is not followed, rad."""
    max_jump: Positive = 0.5
    """A step of the odometry longer than this, m, or turning by more than this times two, rad, is a restart."""


class PerceptionSettings(Settings):
    """Thresholds and sizes of perception, one section for each skill."""

    lines: LineSettings = LineSettings()
    """Straight walls."""
    compass: CompassSettings = CompassSettings()
    """Misalignment with the walls."""
    hough: HoughSettings = HoughSettings()
    """The Hough transform."""
    landmarks: LandmarkSettings = LandmarkSettings()
    """Landmarks."""
    nodes: NodeSettings = NodeSettings()
    """Nodes."""
    minimap: MinimapSettings = MinimapSettings()
    """The map around the robot."""
    space: SpaceSettings = SpaceSettings()
    """Space to the left, ahead and to the right."""
    exit: ExitSettings = ExitSettings()
    """Leaving the maze."""
    wall: WallSettings = WallSettings()
    """The nearest wall on one side."""
    centre: CentreSettings = CentreSettings()
    """The middle of the corridor."""
    repulsion: RepulsionSettings = RepulsionSettings()
    """The artificial potential field."""
    door: DoorSettings = DoorSettings()
    """Door areas."""
    junction: JunctionSettings = JunctionSettings()
    """Junctions."""
    marks: MarkSettings = MarkSettings()
    """Marks at junctions."""
    odometry: OdometrySettings = OdometrySettings()
    """Dead reckoning."""
    mapping: MappingSettings = MappingSettings()
    """The map."""
