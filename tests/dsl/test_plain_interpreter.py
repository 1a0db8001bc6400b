"""The engine beside an interpreter that was written from the recommendation and from the language's page alone."""

from fractions import Fraction
from random import Random

import pytest

from hsm import MachineFault, build
from hsm.dsl import check_text
from hsm.engine import execution
from hsm.model.faults import Spin
from tests.dsl.charts_at_random import EVENTS, PART, chart_text, make_library, members_text
from tests.dsl.plain_interpreter import EndlessError, Happened, PlainRun, UnhandledFaultError

DONE = []
LIBRARY = make_library(DONE)
RARE = [("broken flag", 5), ("broken action", 5), ("broken activity", 7), ("ready", 7), ("stuck", 7)]


def facts_at_random(draw, members, *, broken):
    """What is true, and what fails or is reported; for each member, if there are any."""
    if members:
        return {one: facts_at_random(draw, (), broken=broken) for one in members}
    often = {what: 0.15 if what in ("ready", "stuck") else 0.03 * broken for what, _ in RARE}
    rare = [(what, number) for what, count in RARE for number in range(count)]
    return {number for number in range(5) if draw.random() < 0.4} | {
        one for one in rare if draw.random() < often[one[0]]
    }


def event_at_random(draw, members, *, data):
    """An event from outside, as the engine and as the interpreter take it."""
    owner = draw.choice(("", *(f"{one}." for one in members)))
    name = owner + draw.choice((*EVENTS, *["h"] * data))
    if not name.endswith("h"):
        return name, Happened((name,))
    number, kind = draw.randint(0, 3), draw.choice(("low", "high"))
    return f"{name}({number}, {kind})", Happened((name,), data={f"{name}.number": number, f"{name}.kind": kind})


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
        of_member = facts[run.states[index].name.partition(".")[0]] if isinstance(facts, dict) else facts
        names = ["fault"] if ("broken activity", number) in of_member else []
        names += [one for one in ("ready", "stuck") if (one, number) in of_member]
        if names:
            run.memory.over.add(index)
            found.append(Happened((names[0],), index))
    return found


def compare(model, draw, members=(), ticks=25):
    """Run a machine on both; return how many microsteps there were."""
    machine = build(model)
    nothing = {one: set() for one in members} if members else set()
    data = model.data_of("h") is not None
    DONE.clear()
    try:
        plain = PlainRun(model, nothing)
    except EndlessError:
        return 0
    except UnhandledFaultError:
        with pytest.raises(MachineFault):
            machine.start(facts=nothing)
        return 0
    expected = [*DONE]
    DONE.clear()
    run = machine.start(facts=nothing)
    assert expected == DONE
    time, taken, broken = Fraction(0), 0, draw.random() < 0.6
    for _ in range(ticks):
        facts = facts_at_random(draw, members, broken=broken)
        outcomes = tick_plainly(plain, facts)
        try:
            run.act(facts)
        except MachineFault:
            return taken
        time += draw.choice((Fraction(0), Fraction(1, 20), Fraction(1, 10), Fraction(1, 10), Fraction(7, 10)))
        many = draw.choice((0, 0, 1, 1, 2))
        events = [event_at_random(draw, members, data=data) for _ in range(many)]
        DONE.clear()
        try:
            plain.step(time, outcomes, [happened for _, happened in events], facts)
        except EndlessError:
            return taken  # the engine counts in another way
        except UnhandledFaultError:
            with pytest.raises(MachineFault):
                run.step(float(time), [text for text, _ in events], facts)
            return taken
        expected = [*DONE]
        DONE.clear()
        try:
            step = run.step(float(time), [text for text, _ in events], facts)
        except Spin:
            assert plain.taken > execution.SPIN / 2  # the engine counts selections, not microsteps
            return taken
        done = [(tuple(t.index for t in one.transitions), one.exited, one.entered) for one in step.microsteps]
        assert done == [(lines, names(model, left), names(model, new)) for lines, left, new in plain.done]
        assert expected == DONE
        assert run.configuration == set(names(model, plain.memory.active))
        assert dict(run.variables) == plain.memory.values
        assert run.outcome == plain.memory.outcome
        assert [str(one) for one in step.sent] == plain.sent
        taken += len(done)
    return taken


def campaign(seeds, texts, folder, members=()):
    """Compare a machine for each seed; return how many there were, and how many microsteps."""
    machines = taken = 0
    for seed in seeds:
        checked = check_text(texts(seed), LIBRARY, str(folder / "m"), remarks=False)
        if checked.model is not None:
            machines += 1
            try:
                taken += compare(checked.model, Random(seed), members)
            except Exception as error:
                raise AssertionError(f"seed {seed}") from error
    return machines, taken


@pytest.mark.parametrize(("instances", "data"), [(False, False), (True, False), (False, True), (True, True)])
def test_the_engine_follows_the_rules(tmp_path, monkeypatch, instances, data):
    monkeypatch.setattr(execution, "SPIN", 60)  # no machine here has a longer step that ends
    (tmp_path / "part.maze-machine").write_text(PART, encoding="utf-8")
    machines, taken = campaign(range(60), lambda seed: chart_text(seed, instances=instances, data=data), tmp_path)
    assert machines > 35
    assert taken > 4 * machines


def test_members_follow_the_rules(tmp_path, monkeypatch):
    monkeypatch.setattr(execution, "SPIN", 60)

    def text(seed):
        (tmp_path / "chart.maze-machine").write_text(chart_text(seed, data=True), encoding="utf-8")
        return members_text(seed)

    machines, taken = campaign(range(30), text, tmp_path, ("red", "blue"))
    assert machines > 15
    assert taken > 4 * machines
