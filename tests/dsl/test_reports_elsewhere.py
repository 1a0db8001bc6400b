"""What went wrong in other libraries of statecharts, as their users reported it, with what is right here.

Each machine is written anew after the report that it names.
"""

import json
from textwrap import dedent

import hsm
from hsm.dsl import check_text

LIBRARY = hsm.Library("reports")


@LIBRARY.signal("ready")
def is_ready(facts: object) -> bool:
    """What the test says."""
    return bool(facts)


def start(text, facts=None):
    checked = check_text(dedent(text), LIBRARY, "report.maze-machine")
    assert checked.model is not None, checked.diagnostics
    return hsm.build(checked.model).start(facts=facts)


def send(run, *events, at, facts=None):
    """One step for each event; the states left and entered in the last one."""
    for number, event in enumerate(events):
        step = run.step(at + number / 10, [event], facts)
    return step.exited, step.entered


WORKSHOP = """\
machine workshop
event cut, paint, out, back, home
var left : int = 0
initial off
state off
    on back -> both.deep_history
parallel both
    on out  -> off
    on done -> finished
    state cutting
        initial sawing
        state sawing
            on cut -> sawn
        final sawn
    state painting
        exit / left += 1
        initial wet
        state wet
            on paint -> dry
        final dry
final finished
"""


def test_a_history_does_not_keep_a_parallel_state_from_completion():
    """XState 3170; xstate-statemachine 22."""
    run = start(WORKSHOP)
    send(run, "back", "cut", "paint", at=1.0)
    assert run.outcome == "finished"


def test_the_history_of_a_parallel_state_that_was_never_active_enters_all_of_its_regions():
    """XState 5589."""
    run = start(WORKSHOP)
    assert send(run, "back", at=1.0)[1] == ("both", "cutting", "sawing", "painting", "wet")


def test_a_parallel_state_completes_with_its_last_region_and_once():
    """XState 326; transitions 715."""
    for order in (("cut", "paint"), ("paint", "cut")):
        run = start(WORKSHOP.replace("on done -> finished", "on done / left += 10"))
        send(run, "back", order[0], at=1.0)
        assert run.variables["left"] == 0
        send(run, order[1], at=2.0)
        assert run.variables["left"] == 10


def test_what_leaves_a_parallel_state_from_outside_leaves_every_state_in_it():
    """XState 177."""
    run = start(WORKSHOP)
    send(run, "back", "cut", at=1.0)
    exited, entered = send(run, "out", at=2.0)
    assert exited == ("wet", "painting", "sawn", "cutting", "both")
    assert entered == ("off",)
    assert run.variables["left"] == 1


def test_a_history_brings_a_final_state_back_without_what_came_before_it():
    """XState 733."""
    run = start(WORKSHOP)
    send(run, "back", "cut", "out", at=1.0)
    assert send(run, "back", at=2.0)[1] == ("both", "cutting", "sawn", "painting", "wet")


PAIR = """\
machine pair
event go, stay, again
parallel both
    state one
        on stay  -> one.history
        on again => a
        initial a
        state a
            on go -> b
        state b
    state two
        initial c
        state c
            on go -> d
        state d
"""


def test_the_history_of_one_region_leaves_the_other_region_alone():
    """XState 4900. The memory is of the last time that the region was left: until then it is the initial state."""
    run = start(PAIR)
    send(run, "go", at=1.0)
    for tick in range(3):
        assert send(run, "stay", at=2.0 + tick)[1] == ("a",)
        assert run.configuration == {"both", "one", "a", "two", "d"}


def test_a_region_that_is_entered_again_leaves_its_siblings_alone():
    """XState 5162, where the siblings are entered again: the innermost compound state around both is the whole machine.

    Here as in SCXML an external transition of a region leaves the parallel state; a local one does not.
    """
    run = start(PAIR)
    send(run, "go", at=1.0)
    assert send(run, "again", at=2.0) == (
        ("d", "two", "b", "one", "both"),
        ("both", "one", "a", "two", "c"),
    )
    run = start(PAIR.replace("on again =>", "on again ->"))
    send(run, "go", at=1.0)
    assert send(run, "again", at=2.0) == (("b",), ("a",))


def test_one_event_moves_two_regions_whether_the_line_is_in_the_region_or_in_its_state():
    """SCION 15."""
    run = start(PAIR.replace("            on go -> b\n", "").replace("on stay ", "on go -> b\n        on stay "))
    send(run, "go", at=1.0)
    assert run.configuration == {"both", "one", "b", "two", "d"}


def test_a_transition_within_a_region_leaves_no_region_beside_it():
    """uscxml 193."""
    run = start("""\
        machine siblings
        event go
        parallel top
            state parent
                state child
                    state first
                        on go -> second
                    state second
            state sibling1
            state sibling2
        """)
    assert send(run, "go", at=1.0) == (("first",), ("second",))


def test_an_inner_line_comes_before_that_of_the_parallel_state():
    """scxmlcc 97."""
    run = start("""\
        machine inner
        event go
        parallel top
            on go -> over
            state one
                initial a
                state a
                    on go -> b
                state b
            state two
        final over
        """)
    send(run, "go", at=1.0)
    assert run.configuration == {"top", "one", "b", "two"}
    send(run, "go", at=2.0)
    assert run.outcome == "over"


def test_a_compound_state_beside_an_atomic_one_enters_its_initial_state():
    """python-statemachine 651."""
    run = start("""\
        machine microwave
        parallel oven
            state lamp
                stay
            state door
                state shut
                    stay
        """)
    assert run.configuration == {"oven", "lamp", "door", "shut"}


def test_conditions_hold_in_every_region_of_a_run_that_was_restored():
    """XState 3544."""
    run = start("""\
        machine restored
        parallel both
            state x
                initial foo
                state foo
                    when ready -> bar
                state bar
            state y
        """)
    restored = run.machine.restore(json.loads(json.dumps(run.snapshot())))
    restored.step(1.0, facts=True)
    assert restored.configuration == {"both", "x", "bar", "y"}


NESTED = """\
machine nested
event x, y, z
var entries : int = 0
var exits : int = 0
initial c
state c
    on x -> a
state a
    on y => a
    entry / entries += 1
    exit / exits += 1
    initial b
    state b
        on z => b
        entry / entries += 10
        exit / exits += 10
        initial d
        state d
            entry / entries += 100
            exit / exits += 100
"""


def test_nested_initial_states_are_entered_once_each():
    """Stateless 292."""
    run = start(NESTED)
    assert send(run, "x", at=1.0)[1] == ("a", "b", "d")
    assert run.variables["entries"] == 111


def test_an_inner_state_that_is_entered_again_runs_its_exit_action_once_and_none_around_it():
    """Stateless 261 and 264."""
    run = start(NESTED)
    send(run, "x", "z", at=1.0)
    assert run.variables["exits"] == 110
    assert run.variables["entries"] == 221


def test_an_outer_state_that_is_entered_again_enters_its_initial_states_again():
    """Stateless 299 and 191."""
    run = start(NESTED)
    send(run, "x", "y", at=1.0)
    assert run.configuration == {"a", "b", "d"}
    assert run.variables["exits"] == 111
    assert run.variables["entries"] == 222


def test_an_event_that_an_entry_raises_is_handled_once_when_the_states_are_entered():
    """transitions 548 and 554."""
    run = start("""\
        machine raising
        event go, inside
        var count : int = 0
        initial a
        state a
            on go -> b
        state b
            entry / raise inside, count += 1
            on inside -> deep
            initial shallow
            state shallow
            state deep
        """)
    step = run.step(1.0, ["go"])
    assert [one.entered for one in step.microsteps] == [("b", "shallow"), ("deep",)]
    assert run.variables["count"] == 1


def test_a_state_inside_that_has_ended_begins_anew_when_it_is_entered_again():
    """SML 440."""
    run = start("""\
        machine leaving
        event inner, outer
        initial idle
        state idle
            on outer -> around
        state around
            on done -> idle
            state working
                on inner -> ended
            final ended
        """)
    for tick in range(3):
        send(run, "outer", at=1.0 + tick)
        assert run.configuration == {"around", "working"}
        send(run, "inner", at=1.5 + tick)
        assert run.configuration == {"idle"}


def test_an_event_that_a_later_region_defers_is_handled_when_that_region_moves():
    """SML 611."""
    quiet = "    state quiet\n"
    eager = """\
    state eager
        initial busy
        state busy
            defer job
            on free -> idle
        state idle
            on job -> served
        state served
"""
    for order in (quiet + eager, eager + quiet):
        run = start("machine regions\nevent job, free\nparallel both\n" + order)
        send(run, "job", "free", at=1.0)
        assert "served" in run.configuration


def test_an_event_is_deferred_again_and_again():
    """SML 416 and 586."""
    states = "".join(f"state s{n}\n    defer job\n    on next -> s{n + 1}\n" for n in range(4))
    run = start("machine chain\nevent job, next\n" + states + "state s4\n    on job -> served\nfinal served\n")
    send(run, "job", "next", "next", "next", at=1.0)
    assert run.configuration == {"s3"}
    send(run, "next", at=2.0)
    assert run.outcome == "served"


def test_deferred_events_keep_the_order_in_which_they_arrived():
    """SML 230: one that is deferred again still comes before a later one."""
    run = start("""\
        machine order
        event e1, e2, e3, e4
        state s1
            defer e1, e2, e3
            on e4 -> s2
        state s2
            defer e1, e3
            on e2 -> s3
        state s3
            on e1 -> s4
            on e3 -> s5
        state s4
        state s5
        """)
    send(run, "e1", "e2", "e3", "e4", at=1.0)
    assert run.configuration == {"s4"}
