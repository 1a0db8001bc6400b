"""What a state remembers of itself."""

import pytest

from hsm.model.chart import TransitionKind
from tests.hsm.charts import DONE, history, noting, on, parallel, start, state


def maze(*, deep=False, **options):
    return start(
        state("x", on("back", "h"), on("fresh", "a")),
        state(
            "a",
            history("h", "a1", deep=deep),
            state("a1", state("u", on("next", "v")), state("v"), on("over", "a2")),
            state("a2"),
            on("out", "x"),
        ),
        **options,
    )


def test_without_a_memory_the_default_is_entered():
    assert maze().step(1.0, ["back"]).entered == ("a", "a1", "u")


def test_shallow_history_remembers_the_child_only():
    run = maze()
    run.step(1.0, ["fresh", "next", "out"])
    assert run.step(2.0, ["back"]).entered == ("a", "a1", "u")
    run.step(3.0, ["over", "out"])
    assert run.step(4.0, ["back"]).entered == ("a", "a2")


def test_deep_history_remembers_the_atomic_states():
    run = maze(deep=True)
    run.step(1.0, ["fresh", "next", "out"])
    assert run.step(2.0, ["back"]).entered == ("a", "a1", "v")


def test_history_changes_when_the_state_is_left_again():
    run = maze(deep=True)
    for time, events in enumerate((["fresh", "next", "out"], ["back", "over", "out"], ["back"])):
        run.step(float(time), events)
    assert "a2" in run.configuration


def test_history_of_all_regions():
    run = start(
        parallel(
            "p",
            history("h", ["b1", "c1"], deep=True),
            state("b", state("b1", on("one", "b2")), state("b2")),
            state("c", state("c1", on("two", "c2")), state("c2")),
            on("out", "x"),
        ),
        state("x", on("back", "h")),
    )
    run.step(1.0, ["two", "out"])
    assert run.step(2.0, ["back"]).entered == ("p", "b", "b1", "c", "c2")


def test_the_actions_of_the_default_run_only_when_it_is_taken():
    run = start(
        state("x", on("back", "h")),
        state("a", history_with_actions(), state("a1"), state("a2"), on("out", "x"), entry=[noting(1)]),
    )
    run.step(1.0, ["back"])
    assert DONE == [1, 2]
    run.step(2.0, ["out", "back"])
    assert DONE == [1, 2, 1]


def history_with_actions():
    one = history("h", "a2")
    one.options["initial_actions"] = [noting(2)]
    return one


def test_coverage_tells_default_from_memory():
    run = maze()
    run.step(1.0, ["back", "out", "back"])
    remembered = run.machine.indices["h"]
    assert dict(run.coverage.history) == {(remembered, False): 1, (remembered, True): 1}


@pytest.mark.parametrize("kind", [TransitionKind.LOCAL, TransitionKind.EXTERNAL])
def test_what_is_entered_has_been_left_before(kind):
    """A history lies in its own state, however deep within another one the remembered state is."""
    again = on("again", "h", kind=kind)
    run = start(
        state(
            "p",
            history("h", "x", deep=True),
            state("x", state("a", on("next", "b")), state("b"), again),
            on("out", "q"),
        ),
        state("q", on("back", "h")),
    )
    run.step(1.0, ["next", "out", "back"])
    step = run.step(2.0, ["again"])
    assert step.exited == ("b", "x")
    assert step.entered == ("x", "b")
