"""Activities and what they report; completion."""

from hsm import Outcome
from tests.hsm.charts import Work, add, doing, facts, final, on, parallel, start, state


def test_activities_are_ticked_in_document_order_and_their_effects_handed_out():
    run = start(parallel("p", state("b", activity=doing(1)), state("c", activity=doing(2)), activity=doing(3)))
    assert run.act(facts()) == [("p", 3), ("b", 1), ("c", 2)]
    assert [one.number for one in Work.made] == [3, 1, 2]
    run.act(facts())
    assert len(Work.made) == 3


def test_an_outcome_is_seen_by_the_next_step_before_other_events():
    run = start(
        state("a", on("done", "b"), on("go", "c"), activity=doing(1)), state("b", on("go", "d")), *map(state, "cd")
    )
    assert run.act({1: "done"}) == []
    assert run.configuration == {"a"}
    assert run.step(1.0, ["go"]).handled == ("done", "go")
    assert run.configuration == {"d"}


def test_an_activity_that_is_over_is_not_ticked_again():
    run = start(state("a", activity=doing(1)))
    run.act({1: "done"})
    assert run.act(facts()) == []
    assert run.step(1.0).ignored == ("done",)
    assert run.act(facts()) == []


def test_a_state_that_is_left_stops_its_activity_and_one_that_is_entered_again_begins_anew():
    run = start(state("a", on("again", "a"), activity=doing(1)))
    run.act(facts())
    run.step(1.0, ["again"])
    assert Work.made[0].stopped
    run.act(facts())
    assert len(Work.made) == 2


def test_a_state_that_is_only_passed_does_nothing():
    run = start(state("a", on("go", "b")), state("b", on("on", "c"), activity=doing(1)), state("c"))
    run.step(1.0, ["go", "on"])
    run.act(facts())
    assert Work.made == []


def test_an_outcome_is_seen_around_its_state_but_not_beside_or_inside_it():
    run = start(
        parallel(
            "p",
            state(
                "b",
                state("b1", on("done", actions=[add("inside")])),
                on("stuck", actions=[add("own")]),
                activity=doing(1),
            ),
            state("c", state("c1"), on("done", actions=[add("beside")])),
            on("done", actions=[add("around")]),
        ),
        variables={"inside": 0, "own": 0, "beside": 0, "around": 0},
    )
    run.act({1: "done"})
    run.step(1.0)
    assert dict(run.variables) == {"inside": 0, "own": 0, "beside": 0, "around": 1}


def test_the_same_name_from_outside_is_seen_everywhere():
    run = start(state("a", state("b", on("done", "c"), activity=doing(1)), state("c")))
    assert run.step(1.0, ["done"]).entered == ("c",)


def test_an_outcome_of_a_state_that_was_left_meanwhile_is_lost():
    run = start(state("a", on("go", "b"), activity=doing(1)), state("b", on("done", "a")))
    run.act({1: "done"})
    run.step(1.0, ["go"])
    assert run.configuration == {"b"}


def test_stop_ends_all_activities():
    run = start(parallel("p", state("b", activity=doing(1)), state("c", activity=doing(2))))
    run.act(facts())
    run.stop()
    assert all(one.stopped for one in Work.made)


def test_the_end_of_a_run_stops_all_activities_and_ends_reactions():
    run = start(state("a", on("go", "end")), final("end"), on("more", "a"), activity=doing(9))
    run.act(facts())
    step = run.step(1.0, ["go", "more"])
    assert run.outcome == "end"
    assert run.configuration == {"end"}
    assert Work.made[0].stopped
    assert step.entered == ("end",)
    assert run.step(2.0, ["more"]).ignored == ("more",)
    assert run.act(facts()) == []


def test_completion_is_one_event_with_two_names():
    def inner(*ways):
        return state("a", state("b", on("go", "opened")), final("opened"), *ways)

    by_name = start(inner(on("opened", "x"), on("done", "y")), *map(state, "xy"))
    assert by_name.step(1.0, ["go"]).entered == ("opened", "x")
    by_done = start(inner(on("done", "y"), on("opened", "x")), *map(state, "xy"))
    assert by_done.step(1.0, ["go"]).handled == ("go", "opened")
    assert by_done.configuration == {"y"}


def test_completion_belongs_to_the_state_that_completed():
    inner = state("b", state("c", on("go", "f")), final("f"), on("done", actions=[add("own")]))
    run = start(
        parallel(
            "p",
            state("q", state("a", inner, on("done", actions=[add("around")]))),
            state("r", state("r1"), on("done", "f", actions=[add("beside")])),
            on("done", actions=[add("outside")]),
        ),
        on("done", actions=[add("top")]),
        variables=dict.fromkeys(("own", "around", "outside", "top", "beside"), 0),
    )
    run.step(1.0, ["go"])
    assert dict(run.variables) == {"own": 1, "around": 0, "outside": 0, "top": 0, "beside": 0}


def test_the_name_of_a_final_state_is_seen_around_but_not_beside():
    run = start(
        parallel(
            "p",
            state("q", state("a", state("b", on("go", "f")), final("f"))),
            state("r", state("r1"), on("f", actions=[add("beside")])),
            on("f", actions=[add("around")]),
        ),
        variables={"around": 0, "beside": 0},
    )
    run.step(1.0, ["go"])
    assert dict(run.variables) == {"around": 1, "beside": 0}


def test_coverage_counts_outcomes():
    run = start(state("a", on("done", "a"), activity=doing(1)))
    for time in (1.0, 2.0):
        run.act({1: "done"})
        run.step(time)
    run.act({1: "stuck"})
    index = run.machine.indices["a"]
    assert dict(run.coverage.outcomes) == {(index, "done"): 2, (index, "stuck"): 1}


def test_outcomes_are_values():
    assert Outcome("done") == Outcome("done")
