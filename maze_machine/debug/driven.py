"""A machine with a robot in this process: in the embedded simulator, or with recorded sensor data."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from hsm.model.diagnostics import MachineError
from hsm.model.faults import MachineFault
from hsm.testing.scenarios.reading import parse_signal
from maze_machine.catalogue.library import chosen_library
from maze_machine.catalogue.profile import chosen_profile
from maze_machine.debug.asked import Asked
from maze_machine.debug.chart import Chart
from maze_machine.debug.overriding import Overrides
from maze_machine.debug.runs import Run, RunError
from maze_machine.debug.steps import LocalStep, Step
from maze_machine.debug.tried import setting
from maze_machine.drive.mission import Mission, mission_ticks, prepare
from maze_machine.drive.operation import NOBODY, Operator
from maze_machine.drive.replay import recorded_mission, recorded_operator
from maze_machine.drive.tick import Tick
from maze_machine.simulated.world import SimulatedWorld, find_maze
from transport.recording import ReplayRobot, read_recording
from transport.world import LockstepRobot


class DrivenRun:
    """A machine with a robot in this process: in the embedded simulator, or with recorded sensor data."""

    quiet = False

    def __init__(
        self, chart: Chart, ticks: Iterator[Tick], close: Callable[[], None], overrides: Overrides | None
    ) -> None:
        """Args: the machine, its ticks, what to do at the end, and where signals are set; None where they cannot be."""
        self.chart = chart
        self.fixed = "" if overrides is not None else "it is a recorded run"
        self._overrides = overrides
        self._set: dict[str, str] = {}
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
            LocalStep(
                self.chart,
                tick.step,
                tick.variables,
                tick.outcome,
                arguments=tick.report.arguments,
                before=self.steps[-1] if self.steps else None,
                violations=[*map(str, tick.violations)],
            )
        )
        return True

    def forget(self) -> int:
        """Does nothing: a run in a maze ends."""
        return 0

    def pending(self) -> Mapping[str, str]:
        """The signals that were set, as they were written."""
        return self._set

    def change(self, step: int, name: str, value: str) -> None:
        """Set a signal from the next step on, whatever the robot sees; a variable or the past cannot be changed."""
        if self._overrides is None:
            raise RunError(f"`{name}` cannot be set: {self.fixed}")
        if name not in self.chart.signals:
            raise RunError(f"`{name}` cannot be set while a robot is driven; only signals can")
        if step < len(self.steps) - 1:
            raise RunError("a robot's actions cannot be undone: go forward to its current position first")
        line = setting(name, value.strip())
        try:
            key, given = parse_signal(line, self.chart.model, self.chart.library, "session")
        except MachineError as error:
            raise RunError(error.diagnostics[0].message) from None
        self._overrides.values[key] = given
        self._set[name] = line

    def tell(self, step: int, line: str) -> str:
        """Set a signal by a line ``when SIGNAL``."""
        word, _, rest = line.strip().partition(" ")
        name = rest.removeprefix("not ").partition("=")[0].strip()
        if word != "when" or not rest:
            raise RunError(f"`{line}` is not possible while a robot is driven; `when SIGNAL = VALUE` sets a signal")
        value = rest.partition("=")[2].strip() or ("false" if rest.startswith("not ") else "true")
        self.change(step, name, value)
        return f"from the next step on: {rest}"

    def hold(self) -> None:
        """It stands still anyway."""

    def go(self, ticks: int | None) -> None:
        """The run continues on request."""

    def close(self) -> None:
        """Release the robot."""
        self._close()


def in_a_maze(asked: Asked, maze: str) -> Run:
    """A machine on the simulated robot."""
    profile = chosen_profile(asked.robot, asked.program)
    mission = prepare(str(asked.program), profile, (asked.parameters or {}).items(), None, asked.library)
    drawn = find_maze(maze, robot=profile.robot)
    robot = LockstepRobot(SimulatedWorld(drawn, profile.robot, asked.seed))
    overrides = Overrides()
    return _driven(replace(mission, machine=overrides.machine(mission.machine)), asked, robot, overrides)


def recorded(asked: Asked, file: Path) -> Run:
    """A machine with the sensor data of a recording."""
    profile = chosen_profile(asked.robot, asked.program)
    recording = read_recording(file, period=profile.robot.period)
    chosen = profile if asked.robot is not None or "profile" not in recording.run else None
    mission = recorded_mission(recording, asked.program, chosen, asked.library)
    operator = recorded_operator(recording, mission.machine)
    return _driven(mission, asked, ReplayRobot(recording), None, operator)


def _ticks(mission: Mission, robot: LockstepRobot | ReplayRobot, operator: Operator = NOBODY) -> Generator[Tick]:
    """The ticks of a run that its robot or its referee ends."""
    with closing(robot):
        for tick in mission_ticks(mission, robot, operator=operator):
            yield tick
            if robot.finished:
                return


def _driven(
    mission: Mission,
    asked: Asked,
    robot: LockstepRobot | ReplayRobot,
    overrides: Overrides | None,
    operator: Operator = NOBODY,
) -> Run:
    files = mission.machine.model.files
    library = chosen_library(asked.library, Path(files[0]) if files else None)
    ticks = _ticks(mission, robot, operator)
    return DrivenRun(Chart(mission.machine, library), ticks, ticks.close, overrides)
