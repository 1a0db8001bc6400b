"""Draw the figures of the page on perception from scans made by the simulator's lidar.

Run as ``python scripts/perception_figures.py``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from maze_machine.view import scans
from perception import Facts, Perception
from perception.hough import hough_lines
from perception.junction import Junction
from perception.nodes import wall_segments
from sim.lidar import Lidar
from transport.description import Point, RobotDescription
from transport.messages import Observation, Odometry, Pose, Scan

IMAGES = Path(__file__).parents[1] / "docs" / "images"
PICO = RobotDescription()
Walls = Sequence[tuple[float, float, float, float]]


def facts_in(walls: Walls, pose: Pose, seed: int = 1) -> Facts:
    """What PICO perceives at a pose between walls, with 1 cm of noise."""
    geometry = PICO.laser.geometry()
    ranges = Lidar(geometry).ranges(np.array(walls), pose)
    noise = np.random.default_rng(seed).uniform(-0.01, 0.01, len(ranges))
    scan = Scan(0, geometry, (ranges + noise).astype(np.float32))
    return Perception(PICO).facts(Observation(0, scan, Odometry.at(0, pose)))


def turned_footprint(misalignment: float) -> list[Point]:
    """The robot's outline in the frame that is turned along the walls."""
    cosine, sine = math.cos(misalignment), math.sin(misalignment)
    return [(x * cosine + y * sine, y * cosine - x * sine) for x, y in PICO.footprint]


CROSSING = [
    (-4, 0.5, 0.4, 0.5), (0.4, 0.5, 0.4, 3), (1.5, 3, 1.5, 0.6), (1.5, 0.6, 5, 0.6),
    (-4, -0.4, 0.1, -0.4), (0.1, -0.4, 0.1, -3), (1.3, -3, 1.3, -0.4), (1.3, -0.4, 5, -0.4),
]  # fmt: skip
OFFSET = [
    (-4, 0.5, 0.2, 0.5), (0.2, 0.5, 0.2, 3), (1.2, 3, 1.2, 0.5), (1.2, 0.5, 5, 0.5),
    (-4, -0.5, 0.6, -0.5), (0.6, -0.5, 0.6, -0.65), (0.6, -0.65, 5, -0.65),
]  # fmt: skip
DOOR = [(-3, 1.4, 0.6, 1.4), (0.6, 1.4, 0.6, 0.5), (0.6, 0.5, 1.0, 0.5), (1.0, 0.5, 1.0, -0.5), (1.0, -0.5, 0.6, -0.5),
        (0.6, -0.5, 0.6, -1.2), (0.6, -1.2, -3, -1.2)]  # fmt: skip
ROOMS = [
    (-2, -1.5, 1.5, -1.5), (1.5, -1.5, 1.5, -0.5), (1.5, 0.5, 1.5, 2), (1.5, 2, -2, 2), (3.5, -2, 3.5, 2.5),
    (1.5, -0.5, 2.4, -0.5), (0.6, 0.9, 0.6, 1.1), (0.6, 0.9, 0.8, 0.9),
]  # fmt: skip


def hough() -> None:
    """A scan beside its Hough space."""
    facts = facts_in(OFFSET, Pose(-0.2, 0.05, 0.12))
    settings = facts.settings.hough
    maxima = hough_lines(facts.hough, settings, facts.settings.compass.world_angle)
    figure = scans.hough_figure(
        facts.points,
        facts.hough.votes,
        (facts.hough.alphas, facts.hough.ps),
        [(line.alpha, line.p) for line in maxima],
        area=settings.area,
        footprint=PICO.footprint,
    )
    scans.save(figure, IMAGES / "perception-hough.png")


def minimap() -> None:
    """The minimap at a junction."""
    facts = facts_in(CROSSING, Pose(-0.2, 0.05, 0.15))
    footprint = turned_footprint(facts.misalignment)
    figure = scans.minimap_figure(facts.minimap.cells, facts.minimap.cell, facts.aligned, footprint)
    scans.save(figure, IMAGES / "perception-minimap.png")


def junction(name: str, walls: Walls, pose: Pose) -> None:
    """A junction with its distances."""
    facts = facts_in(walls, pose)
    found = facts.junction
    title = f"{found.kind.value.replace('_', ' ')}"
    figure = scans.junction_figure(
        facts.aligned, turned_footprint(facts.misalignment), spans_of(found), boxes_of(found, facts), title
    )
    scans.save(figure, IMAGES / f"perception-{name}.png")


def spans_of(found: Junction) -> dict[str, tuple[Point, Point]]:
    """The junction's distances as arrows."""
    spans = {"d1L": ((0.0, 0.0), (0.0, found.left_wall)), "d1R": ((0.0, 0.0), (0.0, -found.right_wall))}
    if not math.isnan(found.d2):
        side = found.left_wall + 0.15 if found.left.open else -found.right_wall - 0.15
        spans["d2"] = ((0.0, side / 2), (found.d2, side / 2))
        spans["d3"] = ((found.d2, side), (found.d2 + found.d3, side))
    if math.isfinite(found.end):
        spans["d4"] = ((0.0, -0.05), (found.end, -0.05))
    return spans


def boxes_of(found: Junction, facts: Facts) -> list[list[Point]]:
    """The boxes that fit into the ways to the sides."""
    depth, half = facts.settings.junction.depth, PICO.half_width + facts.settings.junction.clearance
    boxes = []
    for way, wall, side in ((found.left, found.left_wall, 1), (found.right, found.right_wall, -1)):
        if way.open:
            far, inner, outer = way.far - 0.02, side * wall, side * (wall + depth)
            boxes.append([(far - 2 * half, inner), (far, inner), (far, outer), (far - 2 * half, outer)])
    return boxes


def nodes() -> None:
    """The nodes of a door area."""
    facts = facts_in(DOOR, Pose(-0.1, 0.05, 0.08))
    places = {node.id: node.point for node in facts.nodes}
    walls = [(places[wall.first], places[wall.second]) for wall in wall_segments(facts.nodes)]
    figure = scans.node_figure(
        facts.points,
        PICO.footprint,
        [(node.id, node.kind.value, node.point) for node in facts.nodes],
        walls,
        (facts.door.right, facts.door.left) if facts.door else None,
    )
    scans.save(figure, IMAGES / "perception-nodes.png")


def landmarks() -> None:
    """The landmarks in a room."""
    facts = facts_in(ROOMS, Pose(-0.5, 0.2, 0.2))
    segments = [(wall.start, wall.end) for wall in facts.landmarks]
    figure = scans.landmark_figure(facts.points, PICO.footprint, segments, f"{len(segments)} landmarks", reach=3.0)
    scans.save(figure, IMAGES / "perception-landmarks.png")


def main() -> None:
    """Draw all figures."""
    hough()
    minimap()
    junction("junction", CROSSING, Pose(-0.2, 0.05, 0.1))
    junction("junction-offset", OFFSET, Pose(0.0, 0.02, -0.1))
    nodes()
    landmarks()


if __name__ == "__main__":
    main()
