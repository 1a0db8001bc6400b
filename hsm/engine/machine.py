"""A machine ready to run: a compiled chart that starts and restores its runs."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Any, Generic

from hsm.engine.compiled import CompiledChart
from hsm.engine.inputs import checked_time, parameter_values, shown
from hsm.engine.run import Supervisor
from hsm.engine.snapshots import from_json
from hsm.model.chart import Model
from hsm.model.registry import E, F


class Machine(CompiledChart, Generic[F, E]):
    """A compiled machine. It never changes, and serves any number of runs, also in several threads.

    The runs of a ``Machine[F, E]`` take facts of type ``F`` and return effects of type ``E``, as its library does.

    Attributes:
        model: the declaration.
    """

    def start(
        self, parameters: Mapping[str, Any] | None = None, *, facts: F | None = None, time: float = 0.0
    ) -> Supervisor[F, E]:
        """Start a run: set the parameters and enter the initial configuration.

        Args:
            parameters: values by name, in SI units; the others have their declared defaults.
            facts: the argument of signals and actions at the start.
            time: the time of the start in seconds.

        Returns:
            The run.

        Raises:
            ValueError: a parameter is unknown, one without a default is missing, or a number is out of bounds, infinite
                or no number.
            TypeError: a parameter or the time is of the wrong type.
            MachineFault: an action failed.
        """
        values = parameter_values(self.model, parameters or {})
        return Supervisor.begin(self, values, facts, checked_time(time, -inf))

    def restore(self, snapshot: Mapping[str, Any]) -> Supervisor[F, E]:
        """Restore a run from a snapshot; its activities begin again.

        Args:
            snapshot: the result of ``Supervisor.snapshot``, possibly after a round trip through JSON.

        Returns:
            A run with the same future.

        Raises:
            SnapshotError: the snapshot does not fit this machine.
        """
        return Supervisor(self, from_json(self, snapshot))


def build(model: Model) -> Machine:
    """Compile a declaration to a machine.

    Args:
        model: a machine as data, such as the result of ``check_text``.

    Raises:
        TypeError: the argument is not a ``Model``.
    """
    if not isinstance(model, Model):
        raise TypeError(f"a machine is built from a Model, not from {shown(model)}")
    return Machine(model)
