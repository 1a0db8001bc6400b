"""The settings of a simulation: noise, odometry, rules of the challenge, physics."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from sim.faults import Fault
from transport.section import NotNegative, Period, Positive, Settings

Fraction = Annotated[float, Field(ge=0, le=1)]


class LaserNoise(Settings):
    """How the laser's readings differ from the truth."""

    model: Literal["uniform", "gaussian", "none"] = "uniform"
    """Distribution of the error of each beam."""
    size: NotNegative = 0.01
    """Half the width of the uniform distribution, or the standard deviation of the Gaussian one, m."""
    dropout: Fraction = 0.0
    """Probability that a beam measures nothing; it reads NaN."""
    miss: Fraction = 0.0
    """Probability that a beam does not come back from what it hits; it reads infinity."""


class OdometryNoise(Settings):
    """How the wheels miscount: three of a holonomic base, two of a differential one."""

    scale: NotNegative = 0.002
    """Each wheel's speed is multiplied by 1 + U(-scale, scale)."""
    redraw: Annotated[float, Field(ge=0.01, le=1e6, allow_inf_nan=False)] = 6.0
    """Time after which the factors are drawn again, s."""
    lever: Positive = 0.1
    """Distance of a holonomic base's wheels from the robot's origin, m."""
    start_spread: NotNegative = 2.0
    """Half the width of the uniform distribution of the first position, m; the first heading is any."""
    slip: NotNegative = 0.0
    """Standard deviation of the part of each step's motion by which each wheel slips, so that it counts wrong."""


class Rules(Settings):
    """The rules of the referee."""

    still_limit: Positive = 30.0
    """Standing still for this long fails the attempt, s."""
    door_reach: Positive = 1.3
    """No part of the robot may be farther from the door than this when it rings, m."""
    lax_door: bool = False
    """The course simulator's door: it opens when the robot's origin is within a metre, moving or not."""
    attempts: Annotated[int, Field(ge=1, le=1000)] = 2
    """How many attempts there are within the maze's time limit."""
    practice: bool = False
    """Whether there is another attempt after a success too, which the challenge does not allow."""
    contact_fails: bool = True
    """Whether a touched wall fails the attempt."""


class SimulatorSettings(Settings):
    """All settings of a simulation."""

    noise: LaserNoise = LaserNoise()
    """The laser's noise."""
    odometry: OdometryNoise = OdometryNoise()
    """The odometry's noise."""
    rules: Rules = Rules()
    """The challenge's rules."""
    faults: tuple[Fault, ...] = ()
    """What goes wrong."""
    substep: Period = 0.01
    """Step of the physics, s."""


IDEAL = SimulatorSettings(noise=LaserNoise(model="none"), odometry=OdometryNoise(scale=0.0, start_spread=0.0))
"""No noise anywhere; the odometry frame is still turned at random."""
