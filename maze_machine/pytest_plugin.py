"""The pytest plugin: scenarios and properties as tests, fixtures for machines, coverage of machines.

It collects ``.maze-test`` files; a file named after its machine also checks the machine's properties. Fixtures:
``load_machine``, ``drive_machine`` (without a robot) and ``run_in_maze`` (in the simulator).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from hsm import Library, Machine, Supervisor
    from hsm.testing.coverage.data import Measurements
    from hsm.testing.proofs.verdicts import PropertyVerdict, Status
    from hsm.testing.scenarios.driver import Driver
    from hsm.testing.scenarios.running import Failure
    from hsm.testing.scenarios.scenarios import Scenario
    from hsm.testing.scenarios.script import ScriptedMachine
    from hsm.testing.scenarios.tested_machine import TestedMachine
    from maze_machine.drive.mission import Ending

SUFFIX = ".maze-test"

_measurements: pytest.StashKey[Measurements] = pytest.StashKey()
_libraries: pytest.StashKey[Library] = pytest.StashKey()
_scripted: pytest.StashKey[ScriptedMachine] = pytest.StashKey()
_summary: pytest.StashKey[list[str]] = pytest.StashKey()


def pytest_addoption(parser: pytest.Parser) -> None:
    """The options of this plugin."""
    group = parser.getgroup("machines", "coverage of machines")
    group.addoption("--machine-coverage", action="store_true", help="print a table of the coverage of machines")
    group.addoption(
        "--machine-coverage-fail-under",
        type=float,
        metavar="PERCENT",
        help="fail if a smaller share of all items is covered",
    )
    group.addoption("--machine-coverage-html", metavar="FOLDER", help="write a report with annotated sources")
    group.addoption("--machine-coverage-lcov", metavar="FILE", help="write an LCOV tracefile")
    group.addoption("--machine-coverage-cobertura", metavar="FILE", help="write Cobertura XML")
    group.addoption(
        "--machine-coverage-data",
        metavar="FOLDER",
        default=".machine-coverage",
        help="folder of the data files of all processes (default: .machine-coverage)",
    )
    group.addoption(
        "--machine-coverage-append", action="store_true", help="add to the data of earlier runs and other processes"
    )
    parser.addini("machine_library", "the library of machines, as module:function; default: the project's", default="")
    parser.addini("machine_require", "the required verdict of properties: proved, bounded or nothing", default="")


def pytest_configure(config: pytest.Config) -> None:
    """Start without coverage data."""
    config.stash[_summary] = []
    if _measuring(config) and not _is_worker(config) and not config.getoption("machine_coverage_append"):
        rmtree(_data(config), ignore_errors=True)


def _measuring(config: pytest.Config) -> bool:
    names = ("", "_fail_under", "_html", "_lcov", "_cobertura")
    return any(config.getoption(f"machine_coverage{name}") not in (None, False) for name in names)


def _is_worker(config: pytest.Config) -> bool:
    return hasattr(config, "workerinput")


def _data(config: pytest.Config) -> Path:
    return config.rootpath / str(config.getoption("machine_coverage_data"))


def _require_packages(*, simulator: bool = False) -> None:
    """Make sure that no package of the tested project hides one of ours that is needed from here on."""
    from maze_machine.installation import PACKAGES, WITHOUT_SIMULATOR, HiddenPackageError, require_packages

    try:
        require_packages(PACKAGES if simulator else WITHOUT_SIMULATOR)
    except HiddenPackageError as error:
        raise pytest.UsageError(str(error)) from None


def _library(config: pytest.Config) -> Library:
    """The library, made once per process."""
    _require_packages()
    from maze_machine.catalogue.library import chosen_library, named_library, robot_library
    from maze_machine.errors import CommandError

    if _libraries not in config.stash:
        named = str(config.getini("machine_library"))
        try:
            # pytest runs the Python code of its folder anyway, so nobody is asked whether to trust it.
            config.stash[_libraries] = (
                named_library(named, config.rootpath)
                if named
                else chosen_library(None, config.rootpath, robot_library, vouched=True)
            )
        except CommandError as error:
            way_out = f"; {error.way_out}" if error.way_out else ""
            raise pytest.UsageError(f"machine_library: {error}{way_out}") from None
    return config.stash[_libraries]


def _measured(config: pytest.Config) -> Measurements:
    """The coverage data of this process."""
    from hsm.testing.coverage.data import Measurements

    return config.stash.setdefault(_measurements, Measurements())


# Scenarios and properties as tests.


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Collect files of scenarios."""
    if file_path.suffix != SUFFIX:
        return None
    collected: pytest.Collector = ScenarioFile.from_parent(parent, path=file_path)
    return collected


class ScenarioFile(pytest.File):
    """A ``.maze-test`` file."""

    def collect(self) -> Iterator[pytest.Item]:
        """One test for each scenario; where the file is named after its machine, one for each property."""
        try:
            _require_packages()
        except pytest.UsageError as error:
            raise self.CollectError(str(error)) from None
        from hsm.model.diagnostics import MachineError
        from hsm.testing.proofs.verdicts import NO_FAULT
        from hsm.testing.scenarios.tested_machine import load_tested_machine

        try:
            trial = load_tested_machine(self.path, _library(self.config))
        except (MachineError, pytest.UsageError) as error:
            raise self.CollectError(str(error)) from None
        for suite in trial.suites:
            for scenario in suite.scenarios:
                yield ScenarioItem.from_parent(
                    self, name=scenario.name, trial=trial, scenario=scenario, tick=suite.tick
                )
        if Path(trial.machine.model.files[0]).stem == self.path.stem:
            for name in (NO_FAULT, *(one.name for one in trial.machine.model.properties)):
                yield PropertyItem.from_parent(self, name=f"property {name}", trial=trial, claim=name)


class ScenarioFailed(Exception):  # noqa: N818 - how a test ends
    """A failed scenario."""

    def __init__(self, failure: Failure) -> None:
        self.failure = failure
        super().__init__(failure.message)


class ScenarioItem(pytest.Item):
    """One scenario."""

    def __init__(self, *, trial: TestedMachine, scenario: Scenario, tick: float, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.trial = trial
        self.scenario = scenario
        self.tick = tick

    def runtest(self) -> None:
        """Run it on the machine, with the machine's properties watched."""
        from hsm.testing.scenarios.running import run_scenario
        from hsm.testing.scenarios.script import scripted_machine
        from hsm.testing.scenarios.watching import watches

        parent, model = self.parent, self.trial.machine.model
        assert parent is not None, "a scenario is collected with its file"
        if _scripted not in parent.stash:  # made once: its compiled code serves all scenarios of the file
            parent.stash[_scripted] = scripted_machine(self.trial.machine)
        result = run_scenario(
            self.scenario, parent.stash[_scripted], self.tick, watches(model.properties, model.assumptions)
        )
        _measured(self.config).add(model, result.coverage)
        if result.failure is not None:
            raise ScenarioFailed(result.failure)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """The step, the configuration, the guards' values."""
        if isinstance(excinfo.value, ScenarioFailed):
            return "\n".join(excinfo.value.failure.lines())
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Where it is written."""
        line = self.scenario.place.line - 1 if self.scenario.place else None
        return self.path, line, f"scenario {self.scenario.name}"


def _required(config: pytest.Config) -> Status | None:
    """The value of the setting ``machine_require``.

    Raises:
        pytest.UsageError: it is invalid.
    """
    from hsm.testing.proofs.verdicts import Status

    known = {"": None, "proved": Status.PROVED, "bounded": Status.BOUNDED}
    wanted = str(config.getini("machine_require"))
    if wanted not in known:
        raise pytest.UsageError(f"machine_require is `{wanted}`; it may be proved or bounded")
    return known[wanted]


class PropertyViolated(Exception):  # noqa: N818 - how a test ends
    """A property that is violated, or does not meet the requirement."""

    def __init__(self, verdict: PropertyVerdict) -> None:
        self.verdict = verdict
        super().__init__(str(verdict))


_checked: pytest.StashKey[dict[str, PropertyVerdict]] = pytest.StashKey()


class PropertyItem(pytest.Item):
    """One property of a machine, decided for all its runs; ``machine_require`` sets the required verdict."""

    def __init__(self, *, trial: TestedMachine, claim: str, **arguments: Any) -> None:
        super().__init__(**arguments)
        self.trial = trial
        self.claim = claim

    def runtest(self) -> None:
        """Check all properties of the machine together, when the first of them is requested."""
        from hsm.testing.proofs.proving import check

        parent = self.parent
        assert parent is not None, "a property is collected with its file"
        if _checked not in parent.stash:
            parent.stash[_checked] = {one.name: one for one in check(self.trial.machine)}
        verdict = parent.stash[_checked][self.claim]
        if not verdict.meets(_required(self.config)):
            raise PropertyViolated(verdict)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """The violation with a shortest run to it, as a scenario."""
        if not isinstance(excinfo.value, PropertyViolated):
            return super().repr_failure(excinfo, style)
        from hsm.testing.scenarios.writing import Writer

        verdict = excinfo.value.verdict
        example = verdict.counterexample
        lines = [] if example is None else Writer(self.trial.machine.model).scenario(example)
        return "\n".join([str(verdict), *lines])

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Which property."""
        return self.path, None, self.name


# Fixtures.


@pytest.fixture(scope="session")
def machine_library(pytestconfig: pytest.Config) -> Library:
    """The library of the setting ``machine_library``."""
    return _library(pytestconfig)


@pytest.fixture
def load_machine(machine_library: Library, pytestconfig: pytest.Config) -> Iterator[Callable[[str | Path], Machine]]:
    """Loads a machine, a file or a shipped name; its runs count for coverage."""
    from hsm.dsl import load_model
    from maze_machine.catalogue.machines import find_machine

    runs: list[Supervisor] = []

    def load(name: str | Path) -> Machine:
        return _recorded(load_model(find_machine(str(name)), machine_library), runs)

    yield load
    for run in runs:
        _measured(pytestconfig).add(run.machine.model, run.coverage)


def _recorded(model: Any, runs: list[Supervisor]) -> Machine:
    """A machine that keeps its runs."""
    from hsm.engine.machine import Machine

    class Recorded(Machine):
        def start(
            self, parameters: Mapping[str, Any] | None = None, *, facts: object = None, time: float = 0.0
        ) -> Supervisor:
            runs.append(super().start(parameters, facts=facts, time=time))
            return runs[-1]

    return Recorded(model)


@pytest.fixture
def drive_machine(
    load_machine: Callable[[str | Path], Machine], pytestconfig: pytest.Config
) -> Iterator[Callable[..., Driver]]:
    """Starts a machine without a robot: ``drive_machine("pledge", parameters, signals)`` gives a ``Driver``."""
    from hsm.engine.machine import Machine
    from hsm.testing.scenarios.driver import TICK, Driver

    drivers: list[tuple[Machine, Driver]] = []

    def drive(
        machine: Machine | str | Path,
        parameters: Mapping[str, Any] | None = None,
        signals: Mapping[Any, Any] | None = None,
        *,
        tick: float = TICK,
    ) -> Driver:
        loaded = machine if isinstance(machine, Machine) else load_machine(machine)
        drivers.append((loaded, Driver(loaded, parameters, signals, tick=tick)))
        return drivers[-1][1]

    yield drive
    for machine, driver in drivers:
        _measured(pytestconfig).add(machine.model, driver.supervisor.coverage)


@pytest.fixture
def run_in_maze(pytestconfig: pytest.Config) -> Iterator[Callable[..., Ending]]:
    """Runs a machine in the simulator: ``run_in_maze("pledge", "corridor", seed=3)`` gives an ``Ending``.

    ``start``, ``exits`` and ``goal`` are written as the options of `maze-machine run`.
    """
    _require_packages(simulator=True)
    from dataclasses import replace

    from maze_machine.catalogue.profile import chosen_profile
    from maze_machine.drive.mission import drive, prepare
    from maze_machine.simulated.choices import MazeWords
    from maze_machine.simulated.world import SimulatedWorld, find_maze
    from transport.world import LockstepRobot

    runs: list[Supervisor] = []
    library = str(pytestconfig.getini("machine_library")) or None

    def run(
        machine: str | Path,
        maze: str | Path,
        *,
        seed: int = 0,
        time_limit: float | None = None,
        parameters: Mapping[str, str] | None = None,
        robot: str | None = None,
        start: str | None = None,
        exits: Sequence[str] = (),
        goal: str | None = None,
    ) -> Ending:
        profile = chosen_profile(robot, str(machine))
        choices = MazeWords(start, tuple(exits), goal).choices()
        mission = prepare(str(machine), profile, (parameters or {}).items(), time_limit, library)
        mission = replace(mission, machine=_recorded(mission.machine.model, runs))
        driven = LockstepRobot(SimulatedWorld(find_maze(str(maze), choices, robot=profile.robot), profile.robot, seed))
        return drive(mission, driven, driven)

    yield run
    for one in runs:
        _measured(pytestconfig).add(one.machine.model, one.coverage)


# Coverage.


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """Save the data of this process; the last one to end reports on all."""
    config = session.config
    if not _measuring(config):
        return
    if _measured(config).machines:
        _measured(config).save(_data(config))
    if not _is_worker(config) and not _report(config) and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def _report(config: pytest.Config) -> bool:
    """Report the coverage; return whether it suffices."""
    from hsm.dsl import load_model
    from hsm.model.diagnostics import MachineError
    from hsm.testing.coverage.data import Measurements, measured_files
    from hsm.testing.coverage.lcov import cobertura, lcov
    from hsm.testing.coverage.table import coverage_table, total_share
    from maze_machine.report.testing import write_pages
    from transport.files import write_text

    told = config.stash[_summary]
    models = []
    for file in measured_files(_data(config)):
        try:
            models.append(load_model(file, _library(config)))
        except MachineError:
            told.append(f"{file}: measured, but the machine can no longer be loaded")
    measured = Measurements()
    told += [f"{left}: the machine has changed since it was measured" for left in measured.load(_data(config), models)]
    machines = [one for _, one in sorted(measured.machines.items())]
    told += coverage_table(machines, config.rootpath)
    for option, text in (("lcov", lcov), ("cobertura", cobertura)):
        path = config.getoption(f"machine_coverage_{option}")
        if path:
            write_text(Path(str(path)), text(machines))
    folder = config.getoption("machine_coverage_html")
    if folder:
        told += ["", f"report: {write_pages(Path(str(folder)), machines)}"]
    least = config.getoption("machine_coverage_fail_under")
    share = total_share(machines)
    if least is None or share >= float(str(least)):
        return True
    told += ["", f"FAIL machine coverage of {share:.2f}% is under {float(str(least)):g}%"]
    return False


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Print the table."""
    if config.stash[_summary]:
        terminalreporter.section("coverage of machines")
        for line in config.stash[_summary]:
            terminalreporter.write_line(line)
