"""The tests of the shipped machines reach all that the machines can do, and notice when a machine changes."""

import pytest

from hsm.engine.coverage import Coverage
from hsm.model.properties import Never, Precedence, Recurrence
from hsm.testing.coverage.data import Measured
from hsm.testing.coverage.items import ItemKind
from hsm.testing.mutation.mutating import structural, survey
from hsm.testing.scenarios.running import run_suite
from hsm.testing.scenarios.tested_machine import load_tested_machine
from maze_machine.catalogue.library import robot_library
from maze_machine.catalogue.machines import shipped_machines


@pytest.fixture(scope="module")
def robot():
    return robot_library()


@pytest.mark.parametrize("name", shipped_machines())
def test_scenarios_reach_every_state_and_transition_and_nearly_every_outcome_of_guards(name, robot):
    trial = load_tested_machine(shipped_machines()[name], robot)
    coverage = Coverage()
    for suite in trial.suites:
        for result in run_suite(suite, trial.machine):
            assert result.failure is None, result.failure.lines()
            coverage = coverage.merge(result.coverage)
    measured = Measured(trial.machine.model, coverage)
    assert measured.share(ItemKind.STATE) == 100
    assert measured.share(ItemKind.TRANSITION) == 100
    assert measured.share(ItemKind.GUARD) >= 95
    assert trial.machine.model.properties


@pytest.mark.parametrize("name", shipped_machines())
def test_scenarios_notice_changes(name, robot):
    trial = load_tested_machine(shipped_machines()[name], robot)
    assert survey(trial.machine.model, trial.suites, structural).score >= 95


@pytest.mark.parametrize("name", sorted(shipped_machines().keys() - {"door", "watch"}))
def test_each_machine_that_drives_states_what_follows_its_turns_and_those_with_doors_when_they_stand_still(name, robot):
    model = load_tested_machine(shipped_machines()[name], robot).machine.model
    claims = {one.name: one.claim for one in model.properties}
    assert any("turn" in one and isinstance(claim, Precedence) for one, claim in claims.items())
    if "open_door.rung" in claims:
        assert isinstance(claims["quiet"], Never)
        assert claims["still"] == Recurrence(claims["still"].condition, within=30.0)
