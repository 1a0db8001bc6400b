"""The quick way through a step and the full one do the same.

``Supervisor.step`` goes the quick way where nothing happens but moving: it calls decision trees of its configuration,
without a queue, without a copy of the state. That is a twentieth of the time of the full way, ``MacrostepExecution``,
which is left with everything else. Random machines hold the two together: whatever a step leaves behind must be equal.
"""

import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st

from hsm import MachineFault, build
from hsm.engine import configuration, trees
from hsm.engine.inputs import checked_time
from hsm.engine.occurrences import checked_events
from hsm.engine.run import Supervisor
from hsm.model.chart import StateKind, TransitionKind
from tests.hsm.charts import (
    DONE,
    Truth,
    active,
    add,
    after,
    always,
    both,
    compare,
    doing,
    either,
    final,
    history,
    model,
    no,
    noting,
    number,
    on,
    parallel,
    put,
    raising,
    signal,
    state,
    variable,
    when,
)

EVENTS = ("e", "f", "done", "stuck")
SIGNALS = "abc"


class InFull(Supervisor):
    """A run whose every step goes the full way."""

    def step(self, time, events=(), facts=None):
        time = checked_time(time, self.time)
        checked_events(self.machine.model, events)
        return self._react(time, events, facts, {})


@st.composite
def conditions(draw, names, depth=0):
    plain = st.one_of(
        st.sampled_from(SIGNALS).map(signal),
        st.sampled_from(names).map(active),
        st.builds(lambda limit: compare(variable("n"), "<", number(limit)), st.integers(0, 3)),
        st.builds(lambda limit: compare(signal("x"), ">", number(limit)), st.sampled_from([0.5, 1.5])),
        st.builds(lambda limit: signal("within", number(limit)), st.sampled_from([0.5, 1.5])),
    )
    if depth == 1 or draw(st.booleans()):
        return draw(plain)
    inner = conditions(names, depth + 1)
    kind = draw(st.sampled_from(["no", "both", "either"]))
    return no(draw(inner)) if kind == "no" else {"both": both, "either": either}[kind](draw(inner), draw(inner))


@st.composite
def machines(draw):
    """A tree of states of every kind with transitions of every kind; some machines do nothing but move."""
    names, busy = [], draw(st.booleans())

    def tree(depth):
        name = f"s{len(names)}"
        names.append(name)
        kind = draw(st.sampled_from(["atomic", "compound", "parallel"] if depth < 2 else ["atomic"]))
        count = {"atomic": 0, "compound": draw(st.integers(1, 2)), "parallel": 2}[kind]
        return name, kind, [tree(depth + 1) for _ in range(count)]

    trees = [tree(1) for _ in range(2)]
    actions = st.one_of(
        st.builds(put, st.just("n"), st.integers(0, 3)),
        st.just(add("n")),
        st.builds(noting, st.integers(0, 9)),
        st.sampled_from(EVENTS[:2]).map(raising),
    )

    def ways(parent):
        found = []
        for _ in range(draw(st.integers(0, 3))):
            target = draw(st.sampled_from([None, *names, *([f"h{parent}"] if parent else [])]))
            options = {
                "guard": draw(st.one_of(st.none(), conditions(names))),
                "actions": draw(st.lists(actions, max_size=2)) if busy else [],
            }
            if target:
                options["kind"] = draw(st.sampled_from([TransitionKind.LOCAL, TransitionKind.EXTERNAL]))
            trigger = draw(
                st.sampled_from(["on", "when", "when", "after", "always"] if busy else ["on", "when", "when"])
            )
            match trigger:
                case "on":
                    found.append(on(draw(st.sampled_from([*EVENTS, "fault"])), target, **options))
                case "when":
                    found.append(when(draw(conditions(names)), target, **options))
                case "after":
                    found.append(after(draw(st.sampled_from([0.1, 0.3])), target, **options))
                case _:
                    found.append(always(target, **{**options, "guard": draw(conditions(names))}))
        return found

    def spec(one, parent=None):
        name, kind, inner = one
        within = [spec(child, name if kind == "compound" else None) for child in inner]
        if kind == "compound":
            within += [history(f"h{name}", inner[0][0], deep=draw(st.booleans()))]
            within += [final(f"end_{name}")] if draw(st.booleans()) else []
        options = {"activity": doing(len(names))} if busy and kind == "atomic" and draw(st.booleans()) else {}
        if busy and draw(st.booleans()):
            options["entry"] = [draw(actions)]
        make = parallel if kind == "parallel" else state
        return make(name, *within, *ways(parent if kind == "atomic" else None), **options)

    return model(*map(spec, trees), variables={"n": 0})


STEPS = st.tuples(
    st.sampled_from([0.0, 0.1, 0.2]),
    st.lists(st.sampled_from([*EVENTS, "nobody"]), max_size=2),
    st.fixed_dictionaries(
        {
            **{
                name: st.one_of(st.booleans(), st.booleans(), st.just(OSError(f"{name} is broken"))) for name in SIGNALS
            },
            "x": st.sampled_from([0.0, 1.0, 2.0]),
        }
    ),
)


def outcome_of(function, *arguments, **options):
    """What a call comes to: what it gives, or what it raises, in words."""
    try:
        return function(*arguments, **options), None
    except MachineFault as fault:
        return None, (type(fault), str(fault))


@pytest.fixture(scope="module", params=[(0, 16), (0, 1), (1, 2)], ids=["at once", "a condition each", "soon"])
def growing(request):
    """Trees grow at once or after a step, as whole looks or cut after one or two conditions."""
    with pytest.MonkeyPatch.context() as patch:
        warm, widest = request.param
        patch.setattr(configuration, "WARM", warm)
        patch.setattr(trees, "WIDEST", widest)
        yield


@pytest.mark.usefixtures("growing")
@settings(max_examples=40, deadline=None, derandomize=True)
@given(machines(), st.lists(STEPS, min_size=3, max_size=6))
def test_the_quick_way_does_what_the_full_way_does(declared, steps):
    machine = build(declared)
    beginning = Truth(x=0.0)
    quick, problem = outcome_of(machine.start, facts=beginning)
    full, other = outcome_of(InFull.begin, machine, [], beginning, 0.0)
    assert problem == other
    if problem is not None:
        event("fails at the start")
        return
    moved = False
    for wait, events, values in steps:
        time, facts = round(quick.time + wait, 9), Truth(values)
        DONE.clear()
        one, problem = outcome_of(quick.step, time, events, facts)
        done = [*DONE]
        DONE.clear()
        two, other = outcome_of(full.step, time, events, facts)
        assert problem == other
        assert one == two
        assert done == DONE
        assert quick.snapshot() == full.snapshot()
        assert quick.coverage == full.coverage
        assert outcome_of(quick.act, facts) == outcome_of(full.act, facts)
        if one is None:
            event("fails")
            continue  # both are as they were before the step
        assert one.considered == two.considered
        moved = moved or bool(one)
    event("moves" if moved else "stays")
    event("only moves" if not any(one.kind is StateKind.PARALLEL for one in declared.states) else "in parallel")


def test_a_machine_that_only_moves_leaves_the_full_way_once_it_is_warm(monkeypatch):
    monkeypatch.setattr(configuration, "WARM", 3)
    machine = build(model(state("a", when(signal("a"), "b")), state("b", on("e", "a"))))
    run = machine.start(facts=Truth(a=False))
    full = []
    monkeypatch.setattr(run, "_react", lambda *given: full.append(given) or Supervisor._react(run, *given))
    for tick in range(40):
        run.step(tick, ["e"] if tick % 2 else [], Truth(a=tick % 2 == 0))
    assert 0 < len(full) <= 12
    assert full[-1][0] < 12
    assert run.coverage.transitions == {0: 20, 1: 20}


def test_an_event_that_decides_no_guard_needs_no_function(monkeypatch):
    monkeypatch.setattr(configuration, "WARM", 1)
    declared = build(model(state("a", on("e", "b"), on("f", "b", guard=signal("a"))), state("b", on("e", "a"))))
    run, slow = declared.start(), InFull.begin(declared, (), None, 0.0)
    for time, events in enumerate([("e",), (), ("done",), ("f",), ("e", "e"), ("done", "e"), ("f", "done")] * 6, 1):
        one, other = (made.step(float(time), events, Truth(a=True)) for made in (run, slow))
        assert (one, one.considered, one.ignored) == (other, other.considered, other.ignored)
        assert run.configuration == slow.configuration
    assert run.coverage.to_json() == slow.coverage.to_json()
    for time in range(101, 110):
        run.step(float(time), ("e",))
    assert run.configuration == {"a"}
    begin = run._state.configuration.root
    assert begin.go is None
    assert {"e", "done"} <= begin.sure.keys()
    assert begin.events.keys() == {"f"}
    assert begin.sure["done"].go is None


def test_guards_too_wide_for_trees_stay_on_the_full_way(monkeypatch):
    monkeypatch.setattr(configuration, "WARM", 0)
    monkeypatch.setattr(trees, "LARGEST", 2)
    monkeypatch.setattr(trees, "WIDEST", 1)
    guard = both(both(signal("a"), signal("b")), signal("c"))
    run = build(model(state("one", when(guard, "two")), state("two"))).start(facts=Truth())
    for tick in range(8):
        facts = Truth(a=bool(tick & 4), b=bool(tick & 2), c=bool(tick & 1))
        assert bool(run.step(tick, (), facts)) == (tick == 7)
    assert run.configuration == {"two"}
