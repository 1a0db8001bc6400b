"""False claims of kinds that a proof could miss: each is violated by a run that replays, or not decided."""

import pytest

from hsm.dsl import load_model
from hsm.engine.machine import Machine
from hsm.engine.monitoring import Monitor
from hsm.testing.proofs.proving import check
from hsm.testing.proofs.verdicts import NO_FAULT
from hsm.testing.scenarios.script import Script, scripted_machine
from tests.trust.library import make_library
from tests.trust.random_machines import replays

FAULTS = {
    "a flag that only matters for a limit": """
        var flag : bool = false
        var d : length = 1 m
        state a
            when space.left -> b / flag = space.right
        state b
            when not space.left -> a / d = (1e300 m if flag else 1 m) * 1e10
    """,
    "a name that only matters for a limit": """
        var hue : Light = red
        var n : int = 0
        state a
            when space.left -> b / hue = light
        state b
            when not space.left -> a / n = (4000000000000000000 if hue == green else 1) * 4
    """,
    "a flag that only matters for what an event carries": """
        event put(number : int)
        var flag : bool = false
        state a
            when space.left -> b / flag = space.right
        state b
            when not space.left -> a / raise put((4000000000000000000 if flag else 1) * 4)
        state c
            on put -> a
    """,
    "a condition that only some signals let fail": """
        event go
        var m : int = 1
        var seen : bool = false
        state a
            on go / m = 0, seen = space.left and (1 / m) > 1
    """,
    "more microsteps than a step may have": """
        var n : int = 0
        state a
            when space.left and n < 1500 / n += 1
    """,
    "more microsteps than a step may have, of two counts": """
        var n : int = 0
        var k : int = 0
        state a
            when space.left -> b
        state b
            when n < 32 / n += 1
            when k < 32 / k += 1, n = 0
            when not space.left -> a
    """,
}

HANDLED = {
    "a fault in a region that is handled around it": """
        property p : never in(f)
        event go
        var d : length = 1 m
        initial w
        parallel w
            on fault -> f
            state a
                state a1
                    on go / d = d * 1000000000000
            state b
                state b1
                    when space.left -> b2
                state b2
                    when space.right -> b1
        state f
            stay
    """,
    "a condition that fails and is handled": """
        property p : never in(f)
        event go
        var m : int = 1
        var seen : bool = false
        state a
            on go / m = 0
            when door.near / seen = space.left and (1 / m) > 1
            on fault -> f
        state f
            when seen -> a
    """,
}

CLAIMS = {
    "whole numbers and floats add differently": """
        property p : never in(c)
        state a
            when steps + 1 > 9007199254740992 and not (steps + 1.0 > 9007199254740992) -> c
        state c
            stay
    """,
    "the second of two delayed events comes before an outcome": """
        property p : never in(bad)
        event go, late
        parallel w
            state one
                state o1
                    do ring()
                    on accepted if in(t2) and in(long) -> bad
                state bad
                    stay
            state two
                state t1
                    on late -> t2
                state t2
                    when true -> t1
            state three
                state idle
                    on go -> p1 / raise late after 1 s
                state p1
                    on go / raise late after 1 s
                    after 0.9 s -> p2
                state p2
                    after 0.6 s -> long
                state long
                    stay
    """,
    "an event's data compared with one another": """
        property p : never in(b)
        event put(x : int, y : int)
        state a
            on put if put.x > put.y and put.y > 5 and put.x < 8 -> b
        state b
            stay
    """,
    "data of events in two regions": """
        property p : never in(b) and in(d)
        event put(x : int)
        var n : int = 0
        parallel w
            state one
                state a
                    on put if put.x > n -> b / n = put.x
                state b
                    when space.left -> a
            state two
                state c
                    on put if put.x < n -> d
                    on put if put.x == n -> e
                state d
                    when space.right -> c
                state e
                    on put if put.x > 0 -> d
    """,
    "a delayed event that only one way cancels": """
        property p : never in(c)
        event go, late
        state a
            on go -> b / raise late after 1 s
        state b
            when space.left -> d / cancel late
            when space.right -> d
        state d
            after 0.5 s -> e
        state e
            on late -> c
            after 1 s -> a
        state c
            stay
    """,
    "a history of regions after completion": """
        property p : never in(over) and n == 0
        event go, back
        var n : int = 0
        initial w
        parallel w
            on done -> over
            when space.left -> out / n = 1
            state one
                state o1
                    on go -> o2
                final o2
            state two
                state t1
                    on back -> t2
                final t2
        state out
            when space.right -> w.deep_history / n = 0
        state over
            stay
    """,
    "beats within one tick": """
        property p : always n <= 4
        var n : int = 0
        state a
            when space.left -> b / n = 0
        state b
            every 0.03 s / n += 1
            after 0.3 s -> a
    """,
    "what is read when a state is left": """
        property p : always total < 5
        event go
        var n : int = 0
        var total : int = 0
        state a
            exit / total += n
            when space.left -> b / n = 0
            on go if n < 2 / n += 1
        state b
            when space.right -> a
    """,
    "the greater of two values that is no number": """
        property p : never in(c)
        state a
            when not (max(ahead, 1 m) >= 1 m) -> c
        state c
            stay
    """,
    "an event that is deferred under a guard": """
        property p : never in(c)
        event go, back
        var n : int = 0
        state a
            defer go if n < 1
            on go -> d
            on back -> b / n += 1
        state b
            on go -> c
            when space.left -> a
        state c
            stay
        state d
            stay
    """,
}

TALKING = {
    "sender": """
        machine sender
        event first, second, third
        state s1
            when door.near -> s2 / send first, send second, send third
        state s2
            when not door.near -> s1
    """,
    "taker": """
        machine taker
        event first, second, third
        state t1
            defer first, second, third
            when door.open -> t2
        state t2
            on second -> t3
            on first -> t2
            when not door.open -> t1
        state t3
            on third -> good
            when not door.open -> t1
        state good
            stay
    """,
    "m": """
        machine m
        import sender
        import taker
        property p : never in(y.good)
        property q : after in(x.s2), in(y.t3) before in(x.s1)
        parallel w
            member x = sender()
            member y = taker()
    """,
}


def refuted(machine, name):
    """Whether a claim is violated by a run that replays; that it is not proved is asserted."""
    (found,) = check(machine, only={name}, seconds=20)
    assert not found.proved
    return found.violated and (name == NO_FAULT or replays(machine, found))


@pytest.mark.parametrize("text", FAULTS.values(), ids=FAULTS)
def test_a_step_that_fails_is_found(machine_of, text):
    assert refuted(machine_of(text), NO_FAULT)


@pytest.mark.parametrize("text", HANDLED.values(), ids=HANDLED)
def test_a_fault_that_is_handled_is_not_overlooked(machine_of, text):
    refuted(machine_of(text), "p")


@pytest.mark.parametrize("text", CLAIMS.values(), ids=CLAIMS)
def test_a_false_claim_is_not_proved(machine_of, text):
    refuted(machine_of(text), "p")


@pytest.mark.parametrize("name", ["p", "q"])
def test_a_false_claim_about_members_is_not_proved(tmp_path, name):
    for file, text in TALKING.items():
        (tmp_path / f"{file}.maze-machine").write_text("\n".join(line[8:] for line in text.splitlines()))
    assert refuted(Machine(load_model(tmp_path / "m.maze-machine", make_library())), name)


def test_ticks_that_are_longer_by_what_stamps_are_rounded_add_up(machine_of):
    """Near today's date each step may come two spacings of floats late without breaking the assumption."""
    states = "\n".join(f"state s{one}\n    after 0 s -> s{one + 1}" for one in range(20))
    machine = machine_of(f"property p : after in(s1), in(s20) within 1.900002 s\n{states}\nstate s20\n    stay\n")
    assert not refuted(machine, "p")
    scripted = scripted_machine(machine)
    script = Script({})
    time = 1.7e9
    run = scripted.start(facts=script, time=time)
    monitor, told = Monitor(run), []
    for _ in range(30):
        told += monitor.look(script, run.step(time, (), script))
        time += 0.1000004
    assert [one.property.name for one in told] == ["p"]
