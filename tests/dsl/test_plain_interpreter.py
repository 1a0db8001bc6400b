"""The engine beside an interpreter that was written from the recommendation and from the language's page alone."""

from fractions import Fraction
from random import Random

import pytest

from hsm import MachineFault, build
from hsm.dsl import check_text
from hsm.engine import execution
from tests.dsl.charts_at_random import EVENTS, PART, chart_text, make_library
from tests.dsl.plain_interpreter import EndlessError, Happened, PlainRun, UnhandledFaultError

DONE = []
LIBRARY = make_library(DONE)
RARE = [("broken flag", 5), ("broken action", 5), ("broken activity", 7), ("ready", 7), ("stuck", 7)]


def facts_at_random(draw, *, broken):
    """What is true, and what fails or is reported."""
    often = {what: 0.15 if what in ("ready", "stuck") else 0.03 * broken for what, _ in RARE}
    rare = [(what, number) for what, count in RARE for number in range(count)]
    return {number for number in range(5) if draw.random() < 0.4} | {
        one for one in rare if draw.random() < often[one[0]]
    }


def names(model, states):
    return tuple(model.states[one].name for one in states if one)


def tick_plainly(run, facts):
    """The outcomes of the activities, as the next step is given them; None if one fails and nothing waits for it."""
    found = []
    for index in sorted(run.memory.active):
        activity = run.states[index].activity
        if activity is None or index in run.memory.over or run.memory.outcome is not None:
            continue
        number = activity.arguments[0].value % 7
        names = ["fault"] if ("broken activity", number) in facts else []
        names += [one for one in ("ready", "stuck") if (one, number) in facts]
        if names:
            run.memory.over.add(index)
            found.append(Happened((names[0],), index))
    return found


def compare(model, draw, ticks=25):
    """Run a machine on both; return how many microsteps there were."""
    machine = build(model)
    DONE.clear()
    try:
        plain = PlainRun(model, set())
    except EndlessError:
        return 0
    except UnhandledFaultError:
        with pytest.raises(MachineFault):
            machine.start(facts=set())
        return 0
    expected = [*DONE]
    DONE.clear()
    run = machine.start(facts=set())
    assert expected == DONE
    time, taken, broken = Fraction(0), 0, draw.random() < 0.6
    for _ in range(ticks):
        facts = facts_at_random(draw, broken=broken)
        outcomes = tick_plainly(plain, facts)
        try:
            run.act(facts)
        except MachineFault:
            return taken
        time += draw.choice((Fraction(0), Fraction(1, 20), Fraction(1, 10), Fraction(1, 10), Fraction(7, 10)))
        events = draw.choices(EVENTS, k=draw.choice((0, 0, 1, 1, 2)))
        DONE.clear()
        try:
            plain.step(time, outcomes, events, facts)
        except EndlessError:
            return taken  # the engine counts in another way
        except UnhandledFaultError:
            with pytest.raises(MachineFault):
                run.step(float(time), events, facts)
            return taken
        expected = [*DONE]
        DONE.clear()
        step = run.step(float(time), events, facts)
        done = [(tuple(t.index for t in one.transitions), one.exited, one.entered) for one in step.microsteps]
        assert done == [(lines, names(model, left), names(model, new)) for lines, left, new in plain.done]
        assert expected == DONE
        assert run.configuration == set(names(model, plain.memory.active))
        assert dict(run.variables) == plain.memory.values
        assert run.outcome == plain.memory.outcome
        taken += len(done)
    return taken


@pytest.mark.parametrize("instances", [False, True])
def test_the_engine_follows_the_rules(tmp_path, monkeypatch, instances):
    monkeypatch.setattr(execution, "SPIN", 60)  # no machine here has a longer step that ends
    (tmp_path / "part.maze-machine").write_text(PART, encoding="utf-8")
    machines = taken = 0
    for seed in range(80):
        checked = check_text(chart_text(seed, instances=instances), LIBRARY, str(tmp_path / "m"), remarks=False)
        if checked.model is not None:
            machines += 1
            try:
                taken += compare(checked.model, Random(seed))
            except AssertionError as error:
                raise AssertionError(f"seed {seed}") from error
    assert machines > 60
    assert taken > 4 * machines
