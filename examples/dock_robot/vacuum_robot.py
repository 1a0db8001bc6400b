"""The library of a vacuum robot: signals, activities, actions and events, with their types and units."""

from dataclasses import dataclass
from enum import StrEnum

from hsm import Angle, Length, Library, Outcome, Speed


class Floor(StrEnum):
    """What is below the robot."""

    HARD = "hard"
    CARPET = "carpet"


class Suction(StrEnum):
    """The power of suction."""

    GENTLE = "gentle"
    STRONG = "strong"


@dataclass(frozen=True)
class Facts:
    """The sensor data at one moment; the charge is between 0 and 1, lengths are in metres."""

    charge: float
    bumped: bool
    floor: Floor
    dock: float
    jammed: bool = False


@dataclass(frozen=True)
class Wanted:
    """The request of an activity: speed in m/s, turn rate in rad/s, power of the brush from 0 to 1, the dock."""

    forward: float = 0.0
    turn: float = 0.0
    brush: float = 0.0
    homing: bool = False


LIBRARY: Library[Facts, Wanted] = Library("vacuum robot")
LIBRARY.event("button", "Somebody has pressed the button.")


@LIBRARY.signal("charge")
def charge(facts: Facts) -> float:
    """What is left in the battery: 0 is empty, 1 is full."""
    return facts.charge


@LIBRARY.signal("bumped")
def bumped(facts: Facts) -> bool:
    """Whether the bumper is pressed."""
    return facts.bumped


@LIBRARY.signal("floor")
def floor(facts: Facts) -> Floor:
    """What is below the robot."""
    return facts.floor


@LIBRARY.signal("dock.distance")
def dock_distance(facts: Facts) -> Length:
    """How far away the dock is."""
    return facts.dock


@LIBRARY.activity("drive", holds=("wheels",))
class Drive:
    """Drive straight on."""

    def __init__(self, speed: Speed = 0.2) -> None:
        self.wanted = Wanted(forward=speed)

    def tick(self, _facts: Facts) -> Wanted:
        """Ask for the speed, 10 times a second."""
        return self.wanted


@LIBRARY.activity("turn", outcomes=("done",), holds=("wheels",))
class Turn:
    """Turn on the spot, at 1 rad/s."""

    def __init__(self, angle: Angle) -> None:
        self.wanted, self.ticks = Wanted(turn=1.0 if angle > 0 else -1.0), round(abs(angle) * 10)

    def tick(self, _facts: Facts) -> Wanted | Outcome:
        """Turn until the angle is reached."""
        self.ticks -= 1
        return self.wanted if self.ticks >= 0 else Outcome("done")


@LIBRARY.activity("go_to_dock", outcomes=("docked", "lost"), holds=("wheels",))
class GoToDock:
    """Drive to the dock; it is lost where it is farther away than 10 m."""

    def tick(self, facts: Facts) -> Wanted | Outcome:
        """Drive until the dock is reached."""
        if facts.dock > 10:
            return Outcome("lost")
        return Wanted(forward=0.2, homing=True) if facts.dock > 0.02 else Outcome("docked")


@LIBRARY.activity("brush", holds=("brush",))
class Brush:
    """Sweep and suck; fails where something is caught in the brush."""

    def __init__(self, suction: Suction = Suction.GENTLE) -> None:
        self.wanted = Wanted(brush=1.0 if suction is Suction.STRONG else 0.4)

    def tick(self, facts: Facts) -> Wanted:
        """Ask for the power."""
        if facts.jammed:
            raise RuntimeError("something is caught in the brush")
        return self.wanted


@LIBRARY.action("beep")
def beep(_facts: Facts, times: int = 1) -> None:
    """Call for help."""
    print("beep " * times)
