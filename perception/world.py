"""The world model: the memory of perception between ticks."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from perception.compass import Compass
from perception.door import Door
from perception.exit import NO_LANE, Lane, RobotInLane, extent_along, next_lane
from perception.mapping.confidence import Knowledge
from perception.mapping.surveyor import Surveyor
from perception.marks import Marks
from perception.odometry import Displacement, corrected, is_restart, moved, step_between
from perception.places import NotedPlace
from perception.settings import PerceptionSettings
from perception.sweep import ScanPoints
from transport.arithmetic import atan2, cos_sin, distance_between
from transport.description import Point
from transport.messages import Odometry, Pose


def to_world(pose: Pose, point: Point) -> Point:
    """A point of the robot's frame in the frame in which ``pose`` is the robot's."""
    cosine, sine = cos_sin(pose.heading)
    return (pose.x + point[0] * cosine - point[1] * sine, pose.y + point[0] * sine + point[1] * cosine)


def to_robot(pose: Pose, point: Point) -> Point:
    """The inverse of ``to_world``."""
    cosine, sine = cos_sin(pose.heading)
    dx, dy = point[0] - pose.x, point[1] - pose.y
    return (dx * cosine + dy * sine, dy * cosine - dx * sine)


LOST, FOUND = "lost", "found"
"""The events of a robot that no longer knows where it is on its map, and of one that knows it again."""
BEYOND = 1.0
"""How far beyond the exit of an earlier attempt the robot drives the next time, m."""


@dataclass(frozen=True, slots=True)
class DoorPlace:
    """The place of a door in the world model's frame.

    Attributes:
        right: end at the right hand of someone who faces it from inside, m.
        left: the other end, m.
    """

    right: Point
    left: Point

    @property
    def centre(self) -> Point:
        """The middle, m."""
        return ((self.right[0] + self.left[0]) / 2, (self.right[1] + self.left[1]) / 2)

    @property
    def facing(self) -> float:
        """Heading of a robot that faces it squarely, rad."""
        return atan2(self.right[0] - self.left[0], self.left[1] - self.right[1])


@dataclass(slots=True)
class WorldModel:
    """The memory of a robot over the ticks of one run.

    The origin of its frame is the start of the run; its axes are parallel to the walls once the compass knows them.
    Until a map is begun, positions are dead reckoning: steps of the odometry along a heading whose drift the compass
    corrects. From then on the map gives the positions.

    Attributes:
        settings: perception's thresholds.
        pose: the robot in the world model's frame.
        travelled: length of the path so far, m.
        turned: sum of all turns so far, rad, counter-clockwise, not wrapped.
        step: the last tick's movement.
        restarts: how often the odometry began again.
        lane: the strip between walls that the robot is in.
        outside_ticks: the number of consecutive ticks in which the scan has shown the robot outside.
        doors: the doors tried so far, in order.
        marks: the junctions that the robot has marked.
        surveyor: keeps the map; None before one is begun.
        dead_ends: the dead ends seen since then that may be doors, in order.
        dismissed: the dead ends at which the robot has been.
        way_out: a place outside, straight on from where an earlier attempt has left the maze, m; None if none has.
        marked: the place that a machine has marked last, or None.
        events: the events of this tick for the machine: `lost` or `found`.
    """

    settings: PerceptionSettings
    pose: Pose = field(default_factory=Pose)
    travelled: float = 0.0
    turned: float = 0.0
    step: Displacement = field(default_factory=Displacement)
    restarts: int = 0
    lane: Lane = NO_LANE
    outside_ticks: int = 0
    doors: list[DoorPlace] = field(default_factory=list)
    marks: Marks = field(init=False)
    surveyor: Surveyor | None = None
    dead_ends: list[DoorPlace] = field(default_factory=list)
    dismissed: list[DoorPlace] = field(default_factory=list)
    way_out: Point | None = None
    marked: NotedPlace | None = None
    events: tuple[str, ...] = ()
    _odometry: Pose | None = None
    _aligned: bool = False
    _axis: float = 0.0

    def __post_init__(self) -> None:
        self.marks = Marks(self.settings.marks.same_place)

    def from_the_start(self) -> WorldModel:
        """The world model of a robot that begins again near the start of the run, with about the same heading.

        It knows the junctions of this run and, if there is a map, the map and the way out. Everything else is reset,
        because doors have shut again.
        """
        again = WorldModel(self.settings)
        again.marks = Marks(self.marks.tolerance, known=self.marks.places)
        if self.surveyor is not None:
            again.surveyor, again._aligned = self.surveyor.from_the_start(), self._aligned
            again.marks.places.surveyor = again.surveyor
            again.dead_ends = list(self.dead_ends)
            again.way_out = to_world(self.pose, (BEYOND, 0.0))
        return again

    def move(self, odometry: Odometry) -> None:
        """Dead reckoning: process the newest odometry."""
        before, after = self._odometry, odometry.pose
        step = step_between(before, after) if before else Displacement()
        restarted = is_restart(step, self.settings.odometry)
        if restarted:
            self.restarts += 1
            step = Displacement()
        if math.isfinite(after.x + after.y + after.heading):
            self._odometry = after
        if self.surveyor:
            self.surveyor.move(None if restarted else Pose(step.forward, step.left, step.turn))
        self.step = step
        self.travelled += step.length
        self.turned += step.turn
        self.pose = moved(self.pose, step)

    @property
    def reckoned(self) -> bool:
        """Whether the pose is dead reckoning: there is no map, or the robot is lost on it."""
        return self.surveyor is None or self.surveyor.knowledge is Knowledge.LOST

    def align(self, compass: Compass) -> None:
        """Correct a reckoned heading by the compass; the first known compass gives the frame its axes."""
        if not compass.known:
            return
        if self._aligned:
            heading = corrected(self.pose.heading, compass, self.settings.compass.world_angle, self.settings.odometry)
            self.pose = Pose(self.pose.x, self.pose.y, heading)
            return
        self._aligned = True
        correction = math.remainder(-compass.misalignment - self.pose.heading, self.settings.compass.world_angle)
        x, y = to_world(Pose(heading=correction), (self.pose.x, self.pose.y))
        self.pose = Pose(x, y, self.pose.heading + correction)

    def begin_map(self, sweep: ScanPoints) -> Surveyor:
        """Begin a map where the robot is, with what it sees there, unless there is one; returns what keeps it."""
        if self.surveyor is None:
            self.surveyor = Surveyor(self.settings.mapping, self.pose)
            self.surveyor.see(sweep)
            self.marks.places.surveyor = self.surveyor
        return self.surveyor

    @classmethod
    def on_map(
        cls, settings: PerceptionSettings, surveyor: Surveyor, dead_ends: list[DoorPlace], way_out: Point | None
    ) -> WorldModel:
        """The world model of a robot that begins on a map that was made before; its frame is the map's."""
        world = cls(settings, surveyor=surveyor, dead_ends=dead_ends, way_out=way_out)
        world.marks.places.surveyor = surveyor
        world._aligned = surveyor.supposed is not None
        return world

    def mark_place(self) -> None:
        """Keep the robot's place, to come back to it."""
        self.marked = self.marks.places.fixed(self.pose)

    @property
    def place_known(self) -> bool:
        """Whether the scan fits the map at the robot's estimated place; false without a map."""
        return self.surveyor is not None and self.surveyor.knowledge is Knowledge.KNOWN

    def survey(self, sweep: ScanPoints) -> None:
        """Add the scan to the map, if there is one.

        A lost robot's pose is dead reckoning from where it was last known, until it is found.
        """
        self.events = ()
        if self.surveyor is None:
            return
        was_lost = self.surveyor.knowledge is Knowledge.LOST
        self.surveyor.see(sweep)
        lost = self.surveyor.knowledge is Knowledge.LOST
        if lost != was_lost:
            self.events = (LOST,) if lost else (FOUND,)
        if not lost:
            self.pose = self.surveyor.pose

    def follow_lane(self, sweep: ScanPoints, footprint: tuple[Point, ...]) -> None:
        """Update the robot's lane with the scan."""
        misalignment, world_angle = self.misalignment, self.settings.compass.world_angle
        direction = cosine, sine = cos_sin(misalignment)
        moved = self.step.forward * cosine + self.step.left * sine
        axis = math.remainder(self.pose.heading + misalignment, math.tau)
        if abs(math.remainder(axis - self._axis, math.tau)) > world_angle / 2:
            self._axis, self.lane = axis, NO_LANE
        body = RobotInLane(*extent_along(footprint, direction), moved)
        self.lane = next_lane(self.lane, sweep, direction, body, self.settings.exit)
        self.outside_ticks = self.outside_ticks + 1 if self.lane.outside else 0

    @property
    def misalignment(self) -> float:
        """The turn that aligns the robot with the walls by dead reckoning, rad."""
        return math.remainder(-self.pose.heading, self.settings.compass.world_angle) if self._aligned else 0.0

    def place(self, door: Door) -> DoorPlace:
        """The place of a visible door in the world model's frame."""
        return DoorPlace(to_world(self.pose, door.right), to_world(self.pose, door.left))

    def remember_door(self, door: Door) -> None:
        """Note that a door has been tried; a known door moves to its present place and becomes the latest."""
        place = self.place(door)
        self.doors = [other for other in self.doors if not self._same(other, place)]
        self.doors.append(place)

    def has_tried(self, door: Door) -> bool:
        """Whether a door in sight has been tried."""
        place = self.place(door)
        return any(self._same(other, place) for other in self.doors)

    def notice_doors(self, doors: Iterable[Door]) -> None:
        """Note the visible dead ends that may be doors; a known one moves to its present place."""
        for door in doors:
            place = self.place(door)
            for index, other in enumerate(self.dead_ends):
                if self._same(other, place):
                    self.dead_ends[index] = place
                    break
            else:
                self.dead_ends.append(place)

    def dismiss_door(self, place: DoorPlace) -> None:
        """Note that the robot has been at a dead end."""
        self.dismissed.append(place)

    def untried_doors(self) -> list[DoorPlace]:
        """The dead ends that may be doors, have not been tried, and have not been visited."""
        done = [*self.doors, *self.dismissed]
        return [place for place in self.dead_ends if not any(self._same(other, place) for other in done)]

    def _same(self, one: DoorPlace, other: DoorPlace) -> bool:
        apart = distance_between(one.centre, other.centre)
        turned = abs(math.remainder(one.facing - other.facing, math.tau))
        return apart <= self.settings.door.same_place and turned <= math.pi / 4
