"""Mutants that no test can kill are told from those that some test would kill."""

import random

import pytest

from hsm.dsl import parse_model
from hsm.model.faults import MachineFault
from hsm.testing.mutation.equivalence import Equivalence
from hsm.testing.mutation.mutating import mutants
from hsm.testing.scenarios.script import Script, scripted_machine
from maze_machine.catalogue.library import robot_library
from tests.trust.random_machines import drawn_machine
from tests.trust.random_runs import RandomRuns

FLAT = """
state a
    initial b
    when door.near -> out
    state b
        do stop()
        when space.left -> c
    state c
        when space.right -> b
state out
    when space.front -> a.history
"""

NESTED = FLAT.replace(
    "    state c\n",
    """    state c
        initial d
        state d
            when space.front -> e
        state e
            do ring()
""",
)

PASSING = """
state a
    when space.left -> b
state b
    do ring()
    when space.front     -> a
    when not space.front -> c
state c
    when not space.left -> a
"""

STAYING = PASSING.replace("    when not space.front -> c\n", "    when not space.front and space.right -> c\n")

COVERED = """
state a
    when space.left                 -> b
    when space.left or space.right  -> c
state b
    when not space.left and not space.right -> a
state c
    when not space.left and not space.right -> a
"""

PARAMETER = """
state a
    when most > 2 and space.left -> b
state b
    when not space.left -> a
"""

ROUNDS = """
state a
    when space.left and rounds >= 0 -> b / rounds += 1
state b
    when not space.left -> a
"""


def proved(text):
    """The equivalent mutants of a machine, each by its kind and its text."""
    model = parse_model(f"machine m\n{text}", robot_library())
    equivalence = Equivalence(scripted_machine(model))
    return {(one.kind, one.text) for one in mutants(model) if equivalence.proved(one)}


@pytest.mark.parametrize(
    ("text", "kind", "equivalent"),
    [
        (FLAT, "history kind", True),
        (NESTED, "history kind", False),
        (PASSING, "dropped activity", True),
        (PASSING, "wrong activity", False),
        (STAYING, "dropped activity", False),
        (COVERED, "logical operator", False),
        (f"param most : int = 3\n{PARAMETER}", "boundary", False),
        (f"var most : int = 3\n{PARAMETER}", "boundary", True),
        (f"var rounds : int = 0\n{ROUNDS}", "boundary", False),
        (f"var rounds : int = 1\n{ROUNDS}", "boundary", True),
    ],
)
def test_a_mutant_is_equivalent_only_where_no_run_shows_it(text, kind, equivalent):
    assert (kind in {one for one, _ in proved(text)}) is equivalent


def told_apart(machine, mutant, seed, runs):
    """Whether some random run shows a difference between a machine and a mutant."""
    draw, values = random.Random(seed), RandomRuns(machine, seed).values
    events = sorted(machine.model.events or ())
    return any(_run(machine, mutant, draw, values, events) for _ in range(runs))


def _run(machine, mutant, draw, values, events):
    scripts = [Script({name: draw.choice(some) for name, some in values.items()})]
    scripts.append(Script(dict(scripts[0].signals)))
    seen = []
    for one, script in zip((machine, mutant), scripts, strict=True):
        try:
            seen.append(one.start(facts=script))
        except MachineFault:
            return False
    time, calm = 0.0, draw.choice((0.0, 0.5, 0.9))
    for _ in range(40):
        reports = {}
        for name in sorted(seen[0].configuration):
            activity = machine.model.states[machine.indices[name]].activity
            if activity is not None and activity.activity.outcomes and draw.random() > 0.5 + calm / 2:
                reports[name] = draw.choice(activity.activity.outcomes)
        changes = {name: draw.choice(some) for name, some in values.items() if draw.random() > 0.5 + calm / 2}
        heard = draw.choices(events, k=draw.choice((0, 0, 1, 2))) if events else ()
        shown = []
        for run, script in zip(seen, scripts, strict=True):
            script.reports = reports
            run.act(script)
            script.reports, script.calls = {}, []
            script.signals.update(changes)
            try:
                step = run.step(time, heard, script)
            except MachineFault as fault:
                shown.append(str(fault))
                continue
            doing = [] if run.outcome is not None else run.act(script)
            shown.append(
                (run.configuration, run.outcome, dict(run.variables), step.entered, step.exited, script.calls,
                 [(type(one).__name__, getattr(one, "event", "")) for one in step.actions], step.sent,
                 [(state, str(effect)) for state, effect in doing])
            )  # fmt: skip
        if repr(shown[0]) != repr(shown[1]):
            return True
        if isinstance(shown[0], str) or seen[0].outcome is not None:
            return False
        time += draw.choice((0.0, 0.1, 0.1, 0.05, draw.random() / 10))
    return False


def contradicted(seed, runs):
    """The equivalent mutants of a machine drawn at random: how many there are, and those that a random run shows."""
    machine = scripted_machine(drawn_machine(seed))
    equivalence = Equivalence(machine)
    equivalent = [one for one in mutants(machine.model) if equivalence.proved(one)]
    wrong = [one for one in equivalent if told_apart(machine, scripted_machine(one.model), seed, runs)]
    return len(equivalent), [(one.kind, one.text, one.place) for one in wrong]


def test_no_random_run_shows_a_mutant_that_is_proved_equivalent():
    found = [contradicted(seed, runs=30) for seed in (1, 2)]
    assert [wrong for _, wrong in found if wrong] == []
    assert sum(count for count, _ in found) > 0


def test_random_runs_show_mutants():
    machine = scripted_machine(drawn_machine(0))
    negated = [one for one in mutants(machine.model) if one.kind in ("negated condition", "dropped transition")]
    assert any(told_apart(machine, scripted_machine(one.model), 0, runs=30) for one in negated)
