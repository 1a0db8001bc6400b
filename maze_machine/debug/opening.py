"""Make a run from the arguments of an editor."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import hsm
from hsm.testing.scenarios.script import scripted_machine
from maze_machine.arguments.parameters import parameter_values
from maze_machine.catalogue.library import RobotLibrary, chosen_library
from maze_machine.catalogue.machines import find_machine
from maze_machine.debug.asked import Asked
from maze_machine.debug.chart import Chart
from maze_machine.debug.runs import Run
from maze_machine.debug.tried import TriedRun


def open_run(asked: Asked) -> Run:
    """The requested run, before or after its first step.

    Raises:
        CommandError: a file, a parameter or a library cannot be used.
        MachineError: the machine has faults.
        SessionError: it cannot start.
        LinkError: nobody can be reached.
    """
    # Each kind imports other packages, which takes time: perception, the simulator, the network.
    if asked.connect is not None:
        from maze_machine.debug.elsewhere import attached  # noqa: PLC0415

        machine, library = _loaded(asked)
        return attached(Chart(machine, library), asked.connect, asked.robot, asked.identity)
    if asked.recording is not None:
        from maze_machine.debug.driven import recorded  # noqa: PLC0415

        return recorded(asked, Path(asked.recording))
    if asked.maze is not None:
        from maze_machine.debug.driven import in_a_maze  # noqa: PLC0415

        return in_a_maze(asked, asked.maze)
    machine, library = _loaded(asked)
    values = parameter_values(machine.model, asked.parameters or {}, library.enumerations)
    return TriedRun(Chart(scripted_machine(machine), library), library, values)


def _loaded(asked: Asked) -> tuple[hsm.Machine[Any, Any], RobotLibrary]:
    path = find_machine(str(asked.program))
    library = chosen_library(asked.library, path)
    return hsm.load(path, library), library
