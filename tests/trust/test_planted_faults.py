"""One realistic mistake each: the tools find every one, and no robot moves."""

from pathlib import Path

import pytest

from hsm.dsl import check_text
from hsm.model.diagnostics import Severity
from hsm.testing.generation.generating import generate
from hsm.testing.proofs.proving import check
from hsm.testing.proofs.verdicts import NO_FAULT
from hsm.testing.scenarios.running import run_suite

MACHINE = Path(__file__).parent / "machines" / "walker.maze-machine"

# What went wrong, the text before, the text after, who finds it: a scenario, a property, generation or the checker.
FAULTS = [
    ("a swapped turn", "do rotate(90 deg)", "do rotate(-90 deg)", "scenario"),
    ("a counter not reset", "            entry / tries = 0\n", "", "property persists"),
    ("a missing outcome", "on done                                -> driving     / turns += 1\n"
     "            on blocked                             -> stuck",
     "on done                                -> driving     / turns += 1", "checker W0504"),
    ("a door rung while moving", "            when exit.crossed                      -> outside",
     "            when exit.crossed                      -> outside\n"
     "            when door.near                         -> calling\n"
     "        state calling\n            do ring()\n            on accepted, refused -> inside\n"
     "            after 1 s -> inside", "property quiet"),
    ("a forgotten time-out", "            after patience                         -> turn_left\n", "",
     "property moves_on"),
    ("a negated guard", "when not space.front and space.left ", "when space.front and space.left ", "scenario"),
    ("one too many", "on refused if tries < 3", "on refused if tries <= 3", "property persists"),
    ("a wrong target", "on accepted                            -> waiting",
     "on accepted                            -> driving", "scenario"),
    ("the general case before the special ones",
     "            when not space.front and space.left    -> turn_left\n",
     "            when not space.front                   -> stuck\n"
     "            when not space.front and space.left    -> turn_left\n", "generation"),
    ("a threshold that is never reached", "if turns == -4", "if turns == -4 and turns > 0", "generation"),
    ("a wrong sign", "/ turns -= 1", "/ turns += 1", "scenario"),
    ("patience in minutes", "= 5 s\n", "= 5 min\n", "property moves_on"),
    ("two states that hand over to each other", "after 1 s if exit.crossed              -> home",
     "after 1 s if exit.crossed              -> home\n"
     "            when exit.crossed                      -> inside", f"property {NO_FAULT}"),
    ("a state that nobody waits for", "            when door.near and not door.tried      -> at_door\n",
     "            when door.near and not door.tried      -> ringing\n", "scenario"),
]  # fmt: skip


def broken(text: str, before: str, after: str) -> str:
    assert text.count(before) >= 1
    return text.replace(before, after, 1)


@pytest.mark.parametrize(("before", "after", "finder"), [fault[1:] for fault in FAULTS], ids=[one[0] for one in FAULTS])
def test_the_mistake_is_found(before, after, finder, library, walker):
    text = broken(MACHINE.read_text(encoding="utf-8"), before, after)
    checked = check_text(text, library, str(MACHINE))
    tool, _, name = finder.partition(" ")
    if tool == "checker":
        assert name in [one.code for one in checked.diagnostics]
        return
    assert checked.model is not None
    if tool == "scenario":
        assert not all(result.passed for suite in walker.suites for result in run_suite(suite, checked.model))
    elif tool == "generation":
        assert [one for one in generate(checked.model, steps=6000).unreached if "is not taken" in one.text]
    else:
        verdicts = {one.name: one for one in check(checked.model, only={name})}
        assert verdicts[name].counterexample is not None


def test_the_machine_without_a_mistake_passes_all_tools(library, walker):
    checked = check_text(MACHINE.read_text(encoding="utf-8"), library, str(MACHINE))
    assert max((one.severity for one in checked.diagnostics), default=Severity.NOTE) is Severity.NOTE
    assert all(result.passed for suite in walker.suites for result in run_suite(suite, walker.machine))
    assert all(verdict.proved for verdict in check(walker.machine))
    assert not generate(walker.machine).unreached
