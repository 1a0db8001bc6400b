"""One tick's observation with all results of perception, computed on first use and only once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from perception.compass import Compass, compass_of
from perception.door import Door, find_doors, is_near, open_share, passage_of
from perception.exit import quantised
from perception.hough import HoughSpace, hough_compass, hough_space
from perception.junction import Junction, junction_of
from perception.landmarks import Landmark, find_landmarks
from perception.lines import LinePieces, Lines, find_lines, split
from perception.minimap import Minimap, minimap_of
from perception.nodes import Node, find_nodes
from perception.repulsion import Force, repulsion_of
from perception.settings import PerceptionSettings
from perception.space import Space, look, space_of
from perception.sweep import Floats, ScanPoints
from perception.walls import Centre, Wall, centre_of, clearance_of, nearest_wall, without_own_body
from perception.world import WorldModel, to_robot
from transport.arithmetic import cos_sin, norm
from transport.description import RobotDescription, fitted
from transport.messages import Observation, Pose


@dataclass(frozen=True)
class Facts:
    """The facts of a tick, for skills and for the signals of a machine.

    Attributes:
        observation: the tick's scan, odometry and door answer.
        robot: shape, limits and laser of the robot.
        settings: perception's thresholds.
        world: the memory of earlier ticks, already updated to this one.
    """

    observation: Observation
    robot: RobotDescription
    settings: PerceptionSettings
    world: WorldModel

    @cached_property
    def time(self) -> float:
        """The tick's time in seconds."""
        return self.observation.time

    @property
    def pose(self) -> Pose:
        """The robot in the world model's frame."""
        return self.world.pose

    @cached_property
    def sweep(self) -> ScanPoints:
        """The scan with its readings sorted into hits, free beams and unknown ones; the robot's own body is unknown."""
        return without_own_body(ScanPoints.of(self.observation.scan, self.robot.laser.mount), self.robot.footprint)

    @property
    def points(self) -> Floats:
        """The hits in the robot's frame, m, shape (n, 2)."""
        return self.sweep.points

    @cached_property
    def lines(self) -> Lines:
        """The straight walls in sight, in the robot's frame."""
        return find_lines(self.sweep, self.pieces, self.settings.lines)

    @cached_property
    def pieces(self) -> LinePieces:
        """The hits, split into pieces where they jump or bend."""
        return split(self.sweep, self.settings.lines)

    @cached_property
    def landmarks(self) -> tuple[Landmark, ...]:
        """The walls in sight in the form of 2015, in the robot's frame."""
        return find_landmarks(self.lines, self.settings.landmarks)

    @cached_property
    def nodes(self) -> tuple[Node, ...]:
        """The ends and corners of the walls in sight."""
        return find_nodes(self.sweep, self.pieces, self.settings.nodes)

    @cached_property
    def hough(self) -> HoughSpace:
        """The Hough transform of the hits in the trust area."""
        return hough_space(self.points, self.settings.hough)

    @cached_property
    def hough_compass(self) -> Compass:
        """The misalignment with the walls by the method of 2015, with the resolution of the Hough space."""
        return hough_compass(self.points, self.settings.hough, self.settings.compass.world_angle)

    @cached_property
    def minimap(self) -> Minimap:
        """The map around the robot, turned along the walls."""
        return minimap_of(self.sweep, self.aligned, self.misalignment, self.settings.minimap)

    @cached_property
    def compass(self) -> Compass:
        """The misalignment with the walls, from this scan alone."""
        return compass_of(self.lines, self.settings.compass)

    @cached_property
    def misalignment(self) -> float:
        """The turn that aligns the robot with the walls, rad: by the compass, otherwise by dead reckoning."""
        return self.compass.misalignment if self.compass.known else self.world.misalignment

    @cached_property
    def aligned(self) -> Floats:
        """The hits in a frame at the robot's place whose axes are parallel to the walls, m, shape (n, 2)."""
        return turned(self.points, -self.misalignment)

    @cached_property
    def space(self) -> Space:
        """Space to the left, ahead and to the right, along the walls."""
        return space_of(self.sweep, quantised(self.misalignment), self.settings.space)

    @cached_property
    def wall_left(self) -> Wall:
        """The nearest wall on the left."""
        return nearest_wall(self.lines, math.pi / 2, self.settings.wall)

    @cached_property
    def wall_right(self) -> Wall:
        """The nearest wall on the right."""
        return nearest_wall(self.lines, -math.pi / 2, self.settings.wall)

    @cached_property
    def centre(self) -> Centre:
        """Where the robot is between the walls of a corridor."""
        return centre_of(self.lines, self.misalignment, self.settings.centre)

    @property
    def centre_error(self) -> float:
        """Distance of the corridor's middle to the left of the robot, m; zero if there is no corridor."""
        return self.centre.error

    @cached_property
    def junction(self) -> Junction:
        """Everything known about the junction that the robot is in or about to enter."""
        return junction_of(self.sweep, self.lines, self.misalignment, self.robot, self.settings.junction)

    @cached_property
    def clearance(self) -> float:
        """Distance from the robot's outline to the nearest hit, m; infinity if nothing is seen."""
        return clearance_of(self.points, self.robot.footprint)

    @cached_property
    def repulsion(self) -> Force:
        """The push of the walls."""
        return repulsion_of(self.sweep, self.settings.repulsion)

    @cached_property
    def exit_ahead(self) -> bool:
        """Whether nothing is in sight straight ahead along the corridor, as at an exit."""
        settings = self.settings
        reach = min(settings.exit.range, self.sweep.reach)
        beam = look(self.sweep, quantised(self.misalignment), settings.space.width, reach, settings.space.bad_share)
        return beam.free

    @cached_property
    def doors(self) -> tuple[Door, ...]:
        """All dead ends in sight that may be doors, the nearest first."""
        return find_doors(self.lines, self.robot, self.settings.door)

    @cached_property
    def door(self) -> Door | None:
        """The possible door ahead at which the robot may ring from here; None if there is none."""
        near = (door for door in self.doors if is_near(door, self.settings.door))
        return next((door for door in near if self._ends_at(door)), None)

    def _ends_at(self, door: Door) -> bool:
        """The depth check of 2015: on the minimap the way to a door is free and ends there."""
        depth = self.minimap.depth(door.bearing - self.misalignment, 0.0)
        reach = self.settings.minimap.half_size - self.settings.minimap.cell
        return abs(min(norm(*door.centre), reach) - min(depth, reach)) <= self.settings.door.depth_margin

    @cached_property
    def rung_door(self) -> Door | None:
        """The door tried last, in the robot's present frame; its place is remembered even if the door is open."""
        if not self.world.doors:
            return None
        place = self.world.doors[-1]
        return Door(to_robot(self.pose, place.right), to_robot(self.pose, place.left), math.inf)

    @cached_property
    def door_open_share(self) -> float:
        """How far the door tried last is open, 0 to 1: the share of the beams to it that go through."""
        door = self.rung_door
        return open_share(self.sweep, door.right, door.left, self.settings.door) if door else 0.0

    @cached_property
    def door_passable(self) -> bool:
        """Whether the robot can pass the door tried last if it drives straight through."""
        door = self.rung_door
        if door is None or not self.sweep.known_share:
            return False
        half_width = self.robot.half_width + self.settings.door.passage_margin
        lane = passage_of(turned(self.points, -door.facing), half_width)
        return lane >= door.distance + self.settings.door.opened_depth


def turned(points: Floats, angle: float) -> Floats:
    """Points turned about the origin, counter-clockwise by ``angle`` in rad."""
    cosine, sine = cos_sin(angle)
    x, y = points[:, 0], points[:, 1]
    rotated: Floats = np.empty_like(points)
    rotated[:, 0], rotated[:, 1] = cosine * x - sine * y, sine * x + cosine * y
    return rotated


class Perception:
    """Perception of one robot during one run: makes the facts of each tick and keeps the world model up to date."""

    def __init__(
        self, robot: RobotDescription, settings: PerceptionSettings | None = None, world: WorldModel | None = None
    ) -> None:
        """Args: the robot, the thresholds, by default for its size, and prior knowledge, by default none."""
        self.robot = robot
        self.settings = settings or fitted(PerceptionSettings(), robot)
        self.world = world or WorldModel(self.settings)

    def facts(self, observation: Observation) -> Facts:
        """Compute the facts of the next tick; call it once per tick, in order."""
        facts = Facts(observation, self.robot, self.settings, self.world)
        take_in(facts, self.world)
        return facts


def take_in(facts: Facts, world: WorldModel) -> None:
    """Update a world model with what a tick shows.

    Args:
        facts: of the tick; only what follows from its scan and odometry is read.
        world: the world model, that of the facts or another one of the same robot.
    """
    world.move(facts.observation.odometry)
    world.survey(facts.sweep)
    if world.reckoned:
        world.align(facts.compass)
    if world.surveyor and world.surveyor.sure:
        world.notice_doors(facts.doors)
    world.follow_lane(facts.sweep, facts.robot.footprint)
