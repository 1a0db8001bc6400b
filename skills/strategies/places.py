"""The map, for machines that use it."""

from __future__ import annotations

from hsm.model.types import Length
from perception.facts import Facts
from perception.mapping.confidence import Knowledge
from perception.signals import FAR
from skills.library import LIBRARY


@LIBRARY.action("map.begin")
def map_begin(facts: Facts) -> None:
    """Begin a map where the robot is; from then on its position is the map's. Nothing where there is one."""
    facts.world.begin_map(facts.sweep)


@LIBRARY.signal("map.known")
def map_known(facts: Facts) -> bool:
    """Whether there is a map."""
    return facts.world.surveyor is not None


@LIBRARY.signal("map.doors")
def map_doors(facts: Facts) -> int:
    """How many dead ends have been seen since the map was begun that may be doors and have not been tried."""
    return len(facts.world.untried_doors())


@LIBRARY.signal("place.known")
def place_known(facts: Facts) -> bool:
    """Whether what is seen fits the map where the robot takes itself to be; false without a map.

    While it does not, nothing enters the map.
    """
    return facts.world.place_known


@LIBRARY.signal("place.lost")
def place_lost(facts: Facts) -> bool:
    """Whether the robot is lost on its map, until it has found itself again; false without a map."""
    return facts.world.surveyor is not None and facts.world.surveyor.knowledge is Knowledge.LOST


@LIBRARY.signal("place.deviation")
def place_deviation(facts: Facts) -> Length:
    """Standard deviation of the robot's position, seen from the map near it; 1000 m without a map and when lost."""
    surveyor = facts.world.surveyor
    if surveyor is None or surveyor.knowledge is Knowledge.LOST:
        return FAR
    return min(surveyor.deviation, FAR)
