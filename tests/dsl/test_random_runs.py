"""Random machines with every word of the language: the quick way and the full way through a step, and restored runs."""

import json

from hypothesis import given, settings
from hypothesis import strategies as st

from hsm import MachineFault, build
from hsm.dsl import parse_model
from hsm.engine.inputs import checked_time
from hsm.engine.occurrences import checked_events
from hsm.engine.run import Supervisor
from tests.dsl.library import make_library
from tests.dsl.machines_at_random import machines

LIBRARY = make_library()
EVENTS = st.lists(
    st.sampled_from(["go", "stop", "bumped", "lift(0.5 m, true, left)", "lift(2 m, false, right)"]), max_size=3
)
STEPS = st.lists(st.tuples(st.sampled_from([0.0, 0.1, 0.5, 2.0, 7.0]), EVENTS, st.booleans()), min_size=1, max_size=8)


class Careful(Supervisor):
    """A run that does each step in full."""

    def step(self, time, events=(), facts=None):
        time = checked_time(time, self.time)
        checked_events(self.machine.model, events)
        return self._react(time, events, facts, {})


def done(run, time, events, facts):
    """What a step comes to: what was done, or what went wrong."""
    try:
        step = run.step(time, events, facts)
    except MachineFault as fault:
        return str(fault)
    return step, step.handled, step.deferred, step.sent, [str(one) for one in step.considered]


@settings(max_examples=150, deadline=None, derandomize=True)
@given(machines(), STEPS, st.integers(0, 8))
def test_the_quick_way_the_full_way_and_a_restored_run_do_the_same(text, steps, split):
    machine = build(parse_model(text, LIBRARY))
    try:
        quick = machine.start(facts=True)
    except MachineFault:
        return
    careful = Careful(machine, machine.restore(quick.snapshot())._run())
    runs, time = [quick, careful], 0.0
    for number, (wait, events, facts) in enumerate(steps):
        if number == split:
            runs.append(machine.restore(json.loads(json.dumps(quick.snapshot()))))
        time += wait
        first, *others = [done(run, time, events, facts) for run in runs]
        assert all(other == first for other in others)
        saved = quick.snapshot()
        assert all(run.snapshot() == saved for run in runs)
