"""Trust before driving: scenarios, generated tests, properties, mutation and coverage of machines, without a robot."""

from hsm.testing.checking import Verdict, check
from hsm.testing.driver import Driver
from hsm.testing.generating import Generated, generate
from hsm.testing.measured import Measurements
from hsm.testing.mutating import Survey, survey
from hsm.testing.running import Result, run_scenario, run_suite
from hsm.testing.scenarios import Scenario, Suite

__all__ = [
    "Driver",
    "Generated",
    "Measurements",
    "Result",
    "Scenario",
    "Suite",
    "Survey",
    "Verdict",
    "check",
    "generate",
    "run_scenario",
    "run_suite",
    "survey",
]
