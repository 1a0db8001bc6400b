"""Proofs of machines with event data, deferred events and events between members: no false claim is proved."""

import pytest

from hsm.dsl import load_model
from hsm.testing.proofs.proving import check
from hsm.testing.scenarios.writing import Writer
from tests.trust.library import make_library
from tests.trust.random_machines import TALKING, cross_checked

HEAD = """machine m

event put(number : int, far : length, light : Light), go, back
event got(number : int)

var n    : int    = 0
var d    : length = 0 m
var hue  : Light  = red
"""


@pytest.fixture
def decided(tmp_path):
    def decide(claim, states):
        path = tmp_path / "m.maze-machine"
        path.write_text(f"{HEAD}\nproperty claimed : {claim}\n\ninitial a\n{states}")
        model = load_model(path, make_library())
        (verdict,) = check(model, only={"claimed"}, seconds=20)
        text = "" if verdict.counterexample is None else Writer(model).suite([verdict.counterexample])
        return verdict, text

    return decide


@pytest.mark.parametrize(
    ("claim", "states"),
    [
        ("always n <= 2", "state a\n    on put if put.number <= 2 / n = put.number"),
        ("never in(b)", "state a\n    on put if put.number > 2 and put.number < 3 -> b\nstate b\n    stay"),
        ("always d < 1 m", "state a\n    on put if put.far < 1 m / d = put.far"),
        ("never in(b) and hue == red", "state a\n    on put if put.light == green -> b / hue = put.light\nfinal b"),
        # Deferred: it is handled once another state is active, in order of arrival.
        (
            "never in(c)",
            "state a\n    defer put\n    on go -> b\nstate b\n    on put if put.number == 1 -> a\nstate c\n    stay",
        ),
        (
            "after in(b), in(b) before in(a)",
            "state a\n    on go -> b\nstate b\n    defer back\n    on go -> c\nfinal c",
        ),
    ],
)
def test_what_holds_is_proved(decided, claim, states):
    verdict, _ = decided(claim, states)
    assert verdict.proved, verdict


@pytest.mark.parametrize(
    ("claim", "states", "shown"),
    [
        ("always n <= 2", "state a\n    on put if put.number <= 3 / n = put.number", "put(number = 3,"),
        ("always n >= 0", "state a\n    on put / n += put.number", "put(number = -"),
        ("never in(b)", "state a\n    on put if put.far > 3 m and put.far < 3.1 m -> b\nstate b\n    stay", "put("),
        ("never hue == green", "state a\n    on put / hue = put.light", "light = green"),
        ("always n <= 9", "state a\n    on put if put.number == 5 / raise got(put.number * 2)\n"
         "    on got / n = got.number", ""),
        # Two occurrences in one step carry different data.
        ("never in(c)", "state a\n    on put if put.number == 1 -> b\nstate b\n    on put if put.number == 2 -> c\n"
         "    when not door.near -> a\nfinal c", "put(number = 1"),
        # A value that was kept differs from that of a later event.
        ("never in(c)", "state a\n    on put -> b / n = put.number\nstate b\n"
         "    on put if put.number < 3 and n > 5 -> c\n"
         "    when not door.near -> a\nfinal c", "put(number ="),
        # A deferred event is not lost, nor is its data.
        ("never in(c)", "state a\n    defer put\n    on go -> b\nstate b\n    on put if put.number == 7 -> c\n"
         "    when not door.near -> a\nfinal c", "put(number = 7"),
        ("never n == 3", "state a\n    defer put, back\n    on go -> b\nstate b\n    on put, back / n += 1\n"
         "    when not door.near -> a / n = 0", ""),
        # One that was raised later carries what was known when it was raised.
        ("never in(b)", "state a\n    on go / raise got(4) after 1 s\n    on got if got.number == 4 -> b\nfinal b", ""),
    ],
)  # fmt: skip
def test_what_does_not_hold_is_shown(decided, claim, states, shown):
    verdict, text = decided(claim, states)
    assert verdict.violated, verdict
    assert shown in text


@pytest.mark.parametrize("seed", range(TALKING, TALKING + 2))
def test_proofs_of_random_machines_with_messages_are_not_contradicted(seed):
    assert not cross_checked(seed, runs=30, seconds=4).contradicted
