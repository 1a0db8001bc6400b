"""A world in lockstep: the interface of a simulator for its controllers, in this process or over a network."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, runtime_checkable

from transport.messages import Command, Observation


class World(Protocol):
    """One episode: a robot in its surroundings, advanced by commands, watched by a referee."""

    @property
    def observation(self) -> Observation:
        """The current sensor data of the robot."""
        ...

    @property
    def finished(self) -> bool:
        """Whether the referee has ended the episode."""
        ...

    def step(self, command: Command) -> Observation:
        """Execute a command for one period; return the observation at its end."""
        ...

    def report(self) -> Mapping[str, object]:
        """The referee's verdict so far, of JSON values."""
        ...


@runtime_checkable
class Repeatable(Protocol):
    """A world, or a robot in one, that allows several attempts."""

    def try_again(self) -> bool:
        """Put the robot back to the start, if another attempt is allowed; return whether it is."""
        ...

    def attempts(self) -> Sequence[Mapping[str, object]]:
        """The referee's verdict on each attempt so far, of JSON values."""
        ...


MakeWorld = Callable[[int | None], World]
"""Begins an episode with a seed, or with the simulator's own where None is given."""


class Refereed(Protocol):
    """A robot with a referee, such as a simulated one."""

    @property
    def finished(self) -> bool:
        """Whether the referee had ended the episode when the last observation was made."""
        ...

    def report(self) -> Mapping[str, object]:
        """The referee's verdict so far, after the last command.

        Raises:
            LinkError: the referee cannot be reached.
        """
        ...


class LockstepRobot:
    """The robot of a world in the same process: each command advances the world to its next observation."""

    def __init__(self, world: World) -> None:
        self._world = world

    @property
    def finished(self) -> bool:
        """Whether the referee has ended the episode."""
        return self._world.finished

    def report(self) -> Mapping[str, object]:
        """The referee's verdict so far."""
        return self._world.report()

    def observe(self) -> Observation:
        """The present observation."""
        return self._world.observation

    def command(self, command: Command) -> None:
        """Step the world."""
        self._world.step(command)

    def close(self) -> None:
        """Does nothing: a world that is not stepped does not move."""
