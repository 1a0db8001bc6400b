"""A machine ready to run: a compiled chart that starts and restores its runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hsm.engine.compiled import CompiledChart
from hsm.engine.run import Supervisor
from hsm.engine.snapshots import from_json
from hsm.model.chart import Model


class Machine(CompiledChart):
    """A compiled machine. It never changes, and serves any number of runs.

    Attributes:
        model: the declaration.
    """

    def start(
        self, parameters: Mapping[str, Any] | None = None, *, facts: object = None, time: float = 0.0
    ) -> Supervisor:
        """Start a run: set the parameters and enter the initial configuration.

        Args:
            parameters: values by name, in SI units; the declared defaults stand for what is left out.
            facts: what signals and actions that are needed at the start are given.
            time: the time of the start in seconds.

        Raises:
            ValueError: a parameter is unknown, one without a default is missing, or a number is beyond its limits.
            MachineFault: an action failed.
        """
        return Supervisor.begin(self, self.parameter_values(parameters or {}), facts, time)

    def restore(self, snapshot: Mapping[str, Any]) -> Supervisor:
        """Go on with a run from where ``Supervisor.snapshot`` left it.

        Raises:
            SnapshotError: the snapshot does not fit this machine.
        """
        return Supervisor(self, from_json(self, snapshot))


def build(model: Model) -> Machine:
    """The machine of a declaration."""
    return Machine(model)
