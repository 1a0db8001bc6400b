"""Marks at junctions, for machines that use them."""

from __future__ import annotations

from perception.facts import Facts
from perception.marks import Direction
from skills.library import LIBRARY


@LIBRARY.action("junction.arrive")
def junction_arrive(facts: Facts) -> None:
    """Note that the robot is at a junction, and mark the way by which it came."""
    facts.world.marks.arrive(facts.pose)


@LIBRARY.action("junction.mark")
def junction_mark(facts: Facts, way: Direction) -> None:
    """Mark a way of this junction, named from the robot's heading on arrival."""
    facts.world.marks.mark(way)


@LIBRARY.signal("junction.marks")
def junction_marks(facts: Facts, way: Direction) -> int:
    """Number of marks of a way of this junction, named from the robot's heading on arrival."""
    return facts.world.marks.count(way)


@LIBRARY.signal("junction.leads_out")
def junction_leads_out(facts: Facts, way: Direction) -> bool:
    """Whether an earlier attempt has shown that this way leads out; only at a junction that is new in this run."""
    return facts.world.marks.leads_out(way)


@LIBRARY.signal("junction.new")
def junction_new(facts: Facts) -> bool:
    """Whether the robot has come to this junction for the first time; false before any."""
    return facts.world.marks.new
