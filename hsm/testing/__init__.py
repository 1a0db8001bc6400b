"""Trust before driving: scenarios, generated tests, properties, mutation and coverage of machines, without a robot."""

from hsm.testing.coverage.data import Measurements
from hsm.testing.generation.generating import Generated, generate
from hsm.testing.mutation.mutating import Survey, survey
from hsm.testing.proofs.proving import check
from hsm.testing.proofs.verdicts import Assumptions, PropertyVerdict
from hsm.testing.scenarios.driver import Driver
from hsm.testing.scenarios.running import ScenarioResult, run_scenario, run_suite
from hsm.testing.scenarios.scenarios import Scenario, Suite

__all__ = [
    "Assumptions",
    "Driver",
    "Generated",
    "Measurements",
    "PropertyVerdict",
    "Scenario",
    "ScenarioResult",
    "Suite",
    "Survey",
    "check",
    "generate",
    "run_scenario",
    "run_suite",
    "survey",
]
