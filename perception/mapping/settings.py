"""The map's section of perception's settings."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from transport.section import Grows, Settings

Share = Annotated[float, Field(ge=0, le=1)]
Count = Annotated[int, Field(ge=1, le=1000)]
Magnitude = Annotated[float, Field(ge=1e-6, le=1000, allow_inf_nan=False)]
"""A deviation, a gate, a factor: its square and its inverse are numbers."""
Cell = Annotated[float, Field(ge=0.01, le=1, allow_inf_nan=False)]
"""A width of cells, m; with smaller ones a map would not fit into memory."""
Step = Annotated[float, Field(ge=0.002, le=3.2, allow_inf_nan=False)]
"""An angle between directions that are tried one by one, rad."""
Reach = Annotated[float, Field(ge=0.01, le=10, allow_inf_nan=False)]
"""A distance within which every cell about the robot counts, m."""
Sight = Annotated[float, Field(ge=0.01, le=100, allow_inf_nan=False)]
"""How far readings are used, m."""


class CloudSettings(Settings):
    """A scan as points with normals."""

    spacing: Cell = 0.05
    """Hits nearer to each other than this are averaged, m."""
    reach: Sight = 25.0
    """Hits farther than this are left out, m: their place depends too much on the heading."""
    jump: Magnitude = 0.12
    """Neighbouring points farther apart than this are on two walls, m."""
    steep: Magnitude = 5.0
    """Unless they are at most this many times as far apart as their beams are: walls that the beams graze."""
    max_missing: Annotated[int, Field(ge=0)] = 3
    """This many beams without a hit do not interrupt a wall."""
    neighbours: Count = 3
    """A normal is that of the line through this many points to each side."""
    range_noise: Magnitude = 0.006
    """Standard deviation of a reading, m."""
    least_noise: Magnitude = 0.001
    """And of a point's place across its wall, at least, m."""
    crooked: Magnitude = 0.3
    """Points deviate from that line by at most this much of how far they extend along it."""


class MatchSettings(Settings):
    """Matching a scan with what was seen before."""

    reach: Reach = 0.3
    """Points farther than this from the map's walls are not matched at first, m."""
    closest: Magnitude = 0.1
    """And at the end, m."""
    cell: Cell = 0.1
    """Points of the map in one cell of this width are one, m."""
    same_way: Share = 0.8
    """Least cosine of the angle between the normals of two matched points."""
    along: Magnitude = 0.15
    """Along a wall its nearest known point may be so far from where a point is, m."""
    rounds: Count = 12
    """Neighbours are looked up this often, at most."""
    paired: Magnitude = 0.02
    """Neighbours stay the same while the scan moves less than this, m and rad."""
    settled: Magnitude = 0.0005
    """A step shorter than this, m and rad, is the last."""
    first_scale: Magnitude = 10.0
    """Deviations are at first assumed to be this many times the noise of the readings; later they are measured."""
    correlated: Magnitude = 4.0
    """This many points of a scan show as much as one point that is independent of all others."""
    common: Magnitude = 0.3
    """All points together may be off by this much of their root mean square deviation, for no map is exact."""
    common_lever: Magnitude = 3.0
    """And in heading as if that error were so far away, m."""
    weak: Magnitude = 0.01
    """Where the walls fix a place along one axis by less than this share of what they fix it along the other, the
    normals' noise is most of it."""
    least_points: Count = 15
    """A match has at least this many points."""


class SearchSettings(Settings):
    """The wide search for where a scan fits."""

    cell: Cell = 0.05
    """Width of a cell of the grid, m."""
    blur: Cell = 0.07
    """Standard deviation of the points' places in the grid, m."""
    block: Count = 5
    """The coarse search goes in steps of this many cells."""
    turn: Step = math.radians(2.5)
    """Angle between two headings tried, rad."""
    points: Count = 90
    """Points of the scan that are tried, at most."""
    apart: Magnitude = 0.6
    """Another place farther than this from the best one, m, is another answer."""
    distinct: Share = 0.9
    """Another answer with at least this share of the best score makes the search ambiguous."""


class GraphSettings(Settings):
    """The pose graph."""

    rounds: Count = 12
    """Most Gauss-Newton steps."""
    settled: Magnitude = 0.001
    """A step shorter than this, m and rad, ends them."""
    tolerance: Magnitude = 0.01
    """In each, the linear equations are solved until the residual has shrunk so far."""
    most_steps: Count = 100
    """Or for this many conjugate-gradient steps."""
    doubtful: Magnitude = 12.0
    """A loop whose squared deviation, in standard deviations, is larger than this loses weight."""


class DriftSettings(Settings):
    """How far odometry drifts: a random walk, its variances in proportion to the way."""

    way: Magnitude = 0.1
    """Deviation of the position after a way of one metre, m."""
    turn_place: Magnitude = 0.03
    """Deviation of the position after a turn of one radian, m."""
    way_turn: Magnitude = 0.1
    """Deviation of the heading after a way of one metre, rad."""
    turn: Magnitude = 0.1
    """Deviation of the heading after a turn of one radian, rad."""
    least: Magnitude = 0.002
    """Deviation of a step that is none, m and rad."""


class TrackSettings(Settings):
    """Following the pose from scan to scan, and when a scan is kept."""

    every: Count = 2
    """With good odometry, a scan is matched every this many ticks; otherwise in each tick."""
    good: Magnitude = 0.005
    """Odometry is good where the last match corrected it by less than this, m."""
    good_turn: Magnitude = 0.003
    """And by less than this, rad."""

    way: Magnitude = 0.4
    """A scan is kept as a keyframe after this much way, m."""
    turn: Magnitude = math.radians(25)
    """Or after this much turn, rad."""
    fresh: Share = 0.5
    """Or, once between two such keyframes, where a smaller share of the scan was known: a door has opened."""
    recent: Count = 15
    """Scans are matched with this many keyframes, the last ones."""
    neighbours: Count = 4
    """If the map is continued from a keyframe, the scan is matched with it and this many before and after it."""
    sure: Share = 0.75
    """With a smaller share of the scan on known walls the wide search is made, too."""
    better: Share = 0.1
    """Its answer is taken if the share is larger by this much."""
    least: Share = 0.4
    """A match with a smaller share is accepted only where it agrees with odometry: much may be new in sight."""
    gate: Magnitude = 16.0
    """It agrees if it deviates from odometry by at most this, squared, in standard deviations."""
    new: Share = 0.15
    """And with a share that is smaller still no match is accepted; odometry alone is followed."""
    across: Reach = 0.6
    """Half the width of the wide search, m."""
    around: Reach = 0.4
    """And in heading, rad, where odometry has measured the step; where it has not, all headings are searched."""
    blind_across: Reach = 1.0
    """And its half width, m, where odometry has not measured the step."""


class LoopSettings(Settings):
    """Finding places again."""

    pieces: Count = 3
    """This many pieces of the work on loops are done in a tick."""
    gap: Count = 20
    """Keyframes fewer than this many apart make no loop."""
    reach: Sight = 4.0
    """A keyframe nearer than this, m, may show the same place."""
    most_reach: Sight = 5.0
    """This much is added to it, m, at most, where the pose is uncertain."""
    stretch: Count = 15
    """Of keyframes within this many of each other only the nearest is tried."""
    candidates: Count = 3
    """This many are tried, at most."""
    around: Count = 4
    """A scan is matched with the keyframe and this many before and after it."""
    near: Magnitude = 0.15
    """Deviation of the pose, m, up to which a match needs no wide search."""
    most_across: Reach = 6.0
    """Half the width of the wide search, m, at most."""
    most_around: Reach = 0.8
    """And in heading, rad, at most."""
    share: Share = 0.55
    """Share of the scan that must lie on known walls."""
    place_known: Magnitude = 0.1
    """The match must give the place as well as this, standard deviation in m: in a bare corridor it does not."""
    heading_known: Magnitude = 0.05
    """And the heading as well as this, rad."""
    gate: Magnitude = 16.0
    """Squared deviation from what the graph says, in standard deviations, at most."""
    caution: Magnitude = 2.0
    """Standard deviations of what the graph says are taken this many times as large."""
    agreeing: Magnitude = 0.15
    """Two loops confirm each other if they agree within this, m."""
    agreeing_way: Magnitude = 0.02
    """And this much more for each keyframe between them, m."""
    agreeing_turn: Magnitude = 0.05
    """And within this, rad."""
    waiting: Count = 8
    """They are at most this many keyframes apart."""
    worth: Magnitude = 0.05
    """A loop that moves the pose by at least this, m, has the graph solved at once."""
    worth_turn: Magnitude = 0.01
    """Or by this, rad."""
    every: Count = 40
    """After this many loops it is solved in any case."""


class FreeSpaceSettings(Settings):
    """The grid of where the robot can drive."""

    cell: Cell = 0.1
    """Width of a cell, m."""
    reach: Sight = 10.0
    """How far to look, m."""
    body: Reach = 0.35
    """So far about its origin it is free, for the robot could turn there, m."""
    before: Magnitude = 0.1
    """The last part of a beam before its hit does not count as free, m."""
    every: Count = 5
    """After this many ticks a scan is drawn, the first that is matched then; one that shows something new, at once."""
    gain: Count = 2
    """The increment of a cell for a beam that passes through it."""
    loss: Count = 3
    """The decrement of a cell for a beam that ends in it."""
    most: Annotated[int, Field(ge=1, le=100)] = 4
    """The largest absolute value of a cell's belief."""


class PlanSettings(Settings):
    """The shortest ways over the grid."""

    room: Magnitude = 0.9
    """The robot's origin keeps this many of its radii from cells with a wall, middle to middle, at least."""
    ease: Magnitude = 0.5
    """Nearer to a wall than this, a path costs more, m."""
    dear: Magnitude = 3.0
    """At a wall by this many times."""
    rim_room: Magnitude = 1.12
    """The rim of what has been seen counts where there is this much room, in radii."""
    least_rim: Count = 3
    """A frontier has at least this many cells: no robot fits through a smaller one."""
    before_door: Magnitude = 0.6
    """The way to a dead end that may be a door ends so far before it, m."""


class ReckoningSettings(Settings):
    """What odometry's errors can explain: a robot that is farther off was carried."""

    most_step: Annotated[Magnitude, Grows(speed=1)] = 0.2
    """A step of odometry from tick to tick longer than this, m, is not a movement: it is not known how far it was."""
    most_turn: Magnitude = 0.4
    """Nor is one that turns by more, rad."""
    place: Magnitude = 0.1
    """The robot may be off by this much, m,"""
    place_way: Share = 0.06
    """and by this much more for each metre of way, m,"""
    turn: Magnitude = 0.1
    """and in heading by this much, rad,"""
    turn_way: Magnitude = 0.03
    """and by this much more for each metre of way, rad,"""
    turn_turn: Share = 0.05
    """and for each radian of turn,"""
    slips: Magnitude = 3.0
    """and by this many times what scans have lately had to correct, for wheels that slip."""
    fading: Share = 0.9
    """With each scan an older correction counts this much of what it did."""


class PlaceSettings(Settings):
    """Whether the robot knows where it is on the map, and finding it again where it does not."""

    hits: Count = 300
    """About this many hits of a scan are laid on the grid."""
    least_hits: Count = 20
    """With fewer a scan says nothing."""
    direction: Step = math.radians(5)
    """Hits within this angle are one direction, rad."""
    widest: Magnitude = math.radians(120)
    """A sector up to this wide may look otherwise than the map does, rad: a door has shut, or something has come."""
    agreeing: Share = 0.6
    """Share of the hits that lie on walls of the grid where the place is known: some of what is in sight may be new."""
    contradicted: Share = 0.03
    """And at most this share lie where it is free."""
    hidden: Share = 0.3
    """And at most this share where nothing is known, behind a wall: past a corner a beam may graze one."""
    found: Share = 0.8
    """Share of the hits that lie on walls of the grid where a lost robot may be."""
    found_contradicted: Share = 0.01
    """And at most this share lie where it is free: at the right place there are none."""
    found_hidden: Share = 0.03
    """And at most this share where nothing is known, behind a wall."""
    unchanged: Share = 0.65
    """Or this share of the scan lies on the walls of the last keyframes,"""
    unchanged_walls: Share = 0.85
    """or this share of the hits on walls of the grid,"""
    elsewhere: Share = 0.97
    """and without that one sector this share of the directions agrees with the grid."""
    convincing: Count = 3
    """After a doubt, this many scans that fit one after the other make the place known."""
    patience: Count = 14
    """After this many that do not fit, one after the other, the robot is lost."""
    doubts: Count = 40
    """And after a doubt of this many scans, of which some fit and some do not."""
    blind: Magnitude = 0.15
    """Without scans the place is doubtful once it deviates by this much, m."""
    headings: Count = 144
    """The circle is divided into this many headings that are tried."""
    likely: Share = 0.7
    """Of these at least this share of the best one's fit of the walls' directions."""
    most_headings: Count = 48
    """And at most this many."""
    points: Count = 60
    """Points of the scan that are tried on each cell."""
    pieces: Count = 2
    """This many pieces of the search are done in a tick."""
    blocks: Count = 120
    """The best blocks of cells are examined cell by cell."""
    candidates: Count = 16
    """The best places are matched in full."""
    hypotheses: Count = 8
    """Of these at most this many are followed."""
    keyframes: Count = 12
    """A scan is matched with this many keyframes, the nearest ones."""
    looks: Count = 6
    """A place is accepted after this many scans that fit,"""
    way: Magnitude = 3.5
    """after this much way, m: the only place left was a wrong one for 2.7 m at most,"""
    walls: Magnitude = 9.0
    """and after this length of wall on the map that the first of them has not shown, m,"""
    no_rival: Magnitude = 0.3
    """and when no other place farther than this from it, m, fits as well."""


class MappingSettings(Settings):
    """The map."""

    cloud: CloudSettings = CloudSettings()
    """Scans as points with normals."""
    match: MatchSettings = MatchSettings()
    """Matching scans."""
    search: SearchSettings = SearchSettings()
    """The wide search."""
    drift: DriftSettings = DriftSettings()
    """How far odometry drifts."""
    track: TrackSettings = TrackSettings()
    """Following the pose."""
    loops: LoopSettings = LoopSettings()
    """Finding places again."""
    graph: GraphSettings = GraphSettings()
    """The pose graph."""
    free_space: FreeSpaceSettings = FreeSpaceSettings()
    """The grid."""
    reckoning: ReckoningSettings = ReckoningSettings()
    """What odometry's errors can explain."""
    place: PlaceSettings = PlaceSettings()
    """Whether the place on the map is known."""
    plan: PlanSettings = PlanSettings()
    """Ways over it."""
