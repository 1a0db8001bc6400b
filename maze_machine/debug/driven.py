"""A machine with a robot in this process: in the embedded simulator, or in front of recorded sensors."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import closing
from pathlib import Path

from hsm.model.faults import MachineFault
from maze_machine.catalogue.library import chosen_library
from maze_machine.catalogue.profile import chosen_profile
from maze_machine.debug.asked import Asked
from maze_machine.debug.chart import Chart
from maze_machine.debug.runs import Run, RunError
from maze_machine.debug.steps import LocalStep, Step
from maze_machine.drive.mission import Mission, mission_ticks, prepare
from maze_machine.drive.operation import NOBODY, Operator
from maze_machine.drive.replay import recorded_mission, recorded_operator
from maze_machine.drive.tick import Tick
from maze_machine.simulated.world import SimulatedWorld, find_maze
from transport.recording import ReplayRobot, read_recording
from transport.world import LockstepRobot


class DrivenRun:
    """A machine with a robot in this process: in the embedded simulator, or in front of recorded sensors."""

    quiet = False

    def __init__(self, chart: Chart, ticks: Iterator[Tick], fixed: str, close: Callable[[], None]) -> None:
        """Args: the machine, its ticks as they come, why nothing can be changed, and what to do at the end."""
        self.chart = chart
        self.fixed = fixed
        self.steps: list[Step] = []
        self.over = ""
        self._ticks = ticks
        self._close = close

    def advance(self) -> bool:
        """The next tick."""
        if self.over:
            return False
        try:
            tick = next(self._ticks, None)
        except MachineFault as error:
            self.over = str(error)
            raise RunError(str(error)) from None
        if tick is None:
            self.over = "the run has ended"
            return False
        self.steps.append(
            LocalStep(self.chart, tick.step, tick.variables, tick.outcome, violations=[*map(str, tick.violations)])
        )
        return True

    def forget(self) -> int:
        """Nothing: a run in a maze ends."""
        return 0

    def pending(self) -> Mapping[str, str]:
        """Nothing is ever changed."""
        return {}

    def change(self, step: int, name: str, value: str) -> None:
        """Refused."""
        del step, value
        raise RunError(f"`{name}` cannot be set: {self.fixed}")

    def tell(self, step: int, line: str) -> str:
        """Refused."""
        del step
        raise RunError(f"`{line}` cannot be done: {self.fixed}")

    def hold(self) -> None:
        """It stands still anyway."""

    def go(self, ticks: int | None) -> None:
        """It goes on as it is asked to."""

    def close(self) -> None:
        """Let go of the robot."""
        self._close()


def in_a_maze(asked: Asked, maze: str) -> Run:
    """A machine on the simulated robot."""
    profile = chosen_profile(asked.robot, asked.program)
    mission = prepare(str(asked.program), profile, (asked.parameters or {}).items(), None, asked.library)
    drawn = find_maze(maze, robot=profile.robot)
    robot = LockstepRobot(SimulatedWorld(drawn, profile.robot, asked.seed))
    return _driven(mission, asked, _ticks(mission, robot), "signals are what the simulated robot sees")


def recorded(asked: Asked, file: Path) -> Run:
    """A machine in front of the sensors of a recording."""
    profile = chosen_profile(asked.robot, asked.program)
    recording = read_recording(file, period=profile.robot.period)
    chosen = profile if asked.robot is not None or "profile" not in recording.run else None
    mission = recorded_mission(recording, asked.program, chosen)
    operator = recorded_operator(recording, mission.machine)
    return _driven(mission, asked, _ticks(mission, ReplayRobot(recording), operator), "it is a recorded run")


def _ticks(mission: Mission, robot: LockstepRobot | ReplayRobot, operator: Operator = NOBODY) -> Generator[Tick]:
    """The ticks of a run that its robot or its referee ends."""
    with closing(robot):
        for tick in mission_ticks(mission, robot, operator=operator):
            yield tick
            if robot.finished:
                return


def _driven(mission: Mission, asked: Asked, ticks: Generator[Tick], fixed: str) -> Run:
    files = mission.machine.model.files
    library = chosen_library(asked.library, Path(files[0]) if files else None)
    return DrivenRun(Chart(mission.machine, library), ticks, fixed, ticks.close)
