"""A declared machine with everything that is computed from it, independent of its runs."""

from __future__ import annotations

from hsm.engine.codegen import Generator
from hsm.engine.configuration import CACHE, Configuration
from hsm.engine.planner import Planner
from hsm.engine.trees import Trees
from hsm.model.chart import Model
from hsm.model.topology import Topology


class CompiledChart:
    """A declared machine with the tables that its runs share. What it computes on first use only saves time later.

    Attributes:
        model: the declaration.
        topology: how its states lie in one another.
        generator: makes the functions that pick transitions and run actions.
        planner: computes what a microstep does.
        indices: index of each state, by its full name.
        invokes: whether any state invokes a chart.
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        self.topology = Topology(model)
        self.generator = Generator(model)
        self._trees = Trees(self.generator)
        self.planner = Planner(self.topology, self.generator, self.configuration)
        self.indices = self.generator.states
        self.invokes = any(state.invokes for state in model.states)
        self._invoked: dict[int, CompiledChart] = {}
        self._configurations: dict[tuple[int, ...], Configuration] = {}

    @property
    def name(self) -> str:
        """The machine's name."""
        return self.model.name

    def configuration(self, leaves: tuple[int, ...]) -> Configuration:
        """The configuration with these active atomic states."""
        found = self._configurations.get(leaves)
        if found is None:
            if len(self._configurations) >= CACHE * 4:
                for one in self._configurations.values():
                    one.forget()
                self._configurations.clear()
            found = self._configurations[leaves] = Configuration(self.topology, self.generator, self._trees, leaves)
        return found

    def warm_up(self) -> None:
        """Make what picks transitions in the initial configuration, which the first step of a run would wait for."""
        initial = self.planner.start().target
        _ = initial.always, initial.after, initial.when

    def invoked(self, model: Model) -> CompiledChart:
        """A chart that this one invokes, compiled once."""
        found = self._invoked.get(id(model))
        if found is None or found.model is not model:
            if len(self._invoked) >= CACHE:
                self._invoked.clear()
            found = self._invoked[id(model)] = CompiledChart(model)
        return found

    def __repr__(self) -> str:
        return f"<Machine {self.name}: {len(self.model.states) - 1} states>"
