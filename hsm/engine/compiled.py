"""A machine ready to run: the declaration with everything that is worked out from it, shared by all runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from hsm.engine.codegen import Generator
from hsm.engine.configuration import CACHE, Configuration
from hsm.engine.evaluation import Evaluation
from hsm.engine.plans import Planner
from hsm.model.chart import Model
from hsm.model.expressions import SignalValue
from hsm.model.topology import Topology

if TYPE_CHECKING:
    from hsm.engine.run import Supervisor
    from hsm.interchange.backend import TransitionsMachine


class Machine:
    """A compiled machine. It never changes; what it works out on first use only makes later steps faster.

    Attributes:
        model: the declaration.
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        self.topology = Topology(model)
        self.generator = Generator(model)
        self.planner = Planner(self.topology, self.generator, self.configuration)
        self.indices = {state.name: state.index for state in model.states}
        self._configurations: dict[tuple[int, ...], Configuration] = {}

    @property
    def name(self) -> str:
        """The machine's name."""
        return self.model.name

    def start(
        self, parameters: Mapping[str, Any] | None = None, *, facts: object = None, time: float = 0.0
    ) -> Supervisor:
        """Start a run: set the parameters and enter the initial configuration.

        Args:
            parameters: values by name, in SI units; the declared defaults stand for what is left out.
            facts: what signals and actions that are needed at the start are given.
            time: the time of the start in seconds.

        Raises:
            ValueError: a parameter is unknown, or one without a default is missing.
            MachineFault: an action failed.
        """
        from hsm.engine.run import Supervisor  # noqa: PLC0415 - a run knows its machine

        return Supervisor.begin(self, self.parameter_values(parameters or {}), facts, time)

    def restore(self, snapshot: Mapping[str, Any]) -> Supervisor:
        """Go on with a run from where ``Supervisor.snapshot`` left it.

        Raises:
            SnapshotError: the snapshot does not fit this machine.
        """
        from hsm.engine.run import Supervisor  # noqa: PLC0415
        from hsm.engine.snapshots import from_json  # noqa: PLC0415 - a run knows its machine

        return Supervisor(self, from_json(self, snapshot))

    def to_transitions(
        self, model: object | None = None, parameters: Mapping[str, Any] | None = None
    ) -> TransitionsMachine:
        """This machine on the library ``transitions``, live: events are sent as ``model.trigger(name, facts)``.

        Args:
            model: the object that gets the state and the triggers; by default the machine itself.
            parameters: values by name, in SI units.

        Raises:
            MachineError: the machine has something that ``transitions`` does not share; all of it is in the error.
            ValueError: a parameter is unknown, or one without a default is missing.
        """
        from hsm.interchange.backend import to_transitions  # noqa: PLC0415 - nobody else needs the library

        return to_transitions(self, model, parameters or {})

    def configuration(self, leaves: tuple[int, ...]) -> Configuration:
        """The configuration with these active atomic states."""
        found = self._configurations.get(leaves)
        if found is None:
            if len(self._configurations) >= CACHE * 4:
                for one in self._configurations.values():
                    one.forget()
                self._configurations.clear()
            found = self._configurations[leaves] = Configuration(self, leaves)
        return found

    def evaluation(
        self,
        memo: Mapping[Any, Any],
        values: Sequence[Any],
        active: frozenset[int],
        ask: Callable[[SignalValue], Any],
    ) -> Evaluation:
        """What expressions are evaluated against at one moment of a run."""
        generator = self.generator
        return Evaluation(values, generator.variables, active, self.indices, memo, generator.key, ask)

    def parameter_values(self, given: Mapping[str, Any]) -> list[Any]:
        """The values of all parameters, in order: those given, and the defaults of the others.

        Raises:
            ValueError: a parameter is unknown, or one without a default is missing.
        """
        declared = {parameter.name: parameter for parameter in self.model.parameters}
        for name in given:
            if name not in declared:
                known = ", ".join(declared) or "none"
                raise ValueError(f"machine {self.name} has no parameter `{name}`; its parameters: {known}")
        missing = [name for name, parameter in declared.items() if parameter.required and name not in given]
        if missing:
            raise ValueError(f"machine {self.name} needs a value for its parameter `{missing[0]}`")
        return [given.get(name, parameter.default) for name, parameter in declared.items()]

    def __repr__(self) -> str:
        return f"<Machine {self.name}: {len(self.model.states) - 1} states>"


def build(model: Model) -> Machine:
    """The machine of a declaration."""
    return Machine(model)
