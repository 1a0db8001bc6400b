"""Whatever stands in a file, there are only findings: no traceback, no hang, no deep recursion.

A long run: ``MAZE_MACHINE_EXAMPLES=100000 pytest tests/dsl/test_robustness.py``.
"""

import os
import string

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsm.dsl import check_file, check_text, parse_model
from hsm.dsl.format.formatter import format_text
from hsm.dsl.reporting.render import as_json, as_sarif, as_text
from hsm.model.diagnostics import MachineError
from tests.dsl.library import make_library
from tests.dsl.machines_at_random import machines

LIBRARY = make_library()
EXAMPLES = int(os.environ.get("MAZE_MACHINE_EXAMPLES", "0"))
robust = settings(
    max_examples=EXAMPLES or 150,
    deadline=None,
    derandomize=not EXAMPLES,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)

WORDS = st.sampled_from(
    [
        *("machine", "import", "param", "var", "event", "state", "parallel", "final", "initial", "do", "entry", "exit"),
        *("on", "when", "after", "stay", "if", "and", "or", "not", "raise", "in", "abs", "true", "->", "=>", "/", "("),
        *(")", ",", ":", "=", "==", "!=", "<", "<=", "+=", "-=", "*", "+", "-", ".", "#", "5", "0.5", "90", "deg"),
        *("m/s", "1e999", "s", "a", "b", "maze.history", "a.b.c", "space.left", "rotate", "drive", "ring", "done"),
        *("door.remember", "$", "\t", "\u00e4", "\u2028", "\x00", "\N{PILE OF POO}"),
    ]
)
LINES = st.builds(lambda depth, words: " " * depth + " ".join(words), st.integers(0, 12), st.lists(WORDS, max_size=9))


def survives(text):
    checked = check_text(text, LIBRARY)
    lines = text.replace("\r\n", "\n").split("\n")
    for found in checked.diagnostics:
        assert found.place is None or 1 <= found.place.line <= len(lines) + 1
    as_text(checked.diagnostics, checked.sources, colour=True)
    as_json(checked.diagnostics)
    as_sarif(checked.diagnostics, "0")
    try:
        formatted = format_text(text)
    except MachineError:
        return
    assert format_text(formatted) == formatted


@robust
@given(st.text(max_size=300))
def test_random_text(text):
    survives(text)


@robust
@given(st.lists(LINES, max_size=15))
def test_random_lines_of_the_languages_words(lines):
    survives("machine m\n" + "\n".join(lines))


@robust
@given(machines(), st.data())
def test_mutated_machines(text, data):
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(text)))
        cut = data.draw(st.integers(0, 12))
        text = (
            text[:at]
            + data.draw(st.one_of(WORDS, st.just(""), st.text(string.printable, max_size=3)))
            + text[at + cut :]
        )
    survives(text)


@robust
@given(st.binary(max_size=300))
def test_random_bytes(tmp_path, content):
    path = tmp_path / "random.maze-machine"
    path.write_bytes(content)
    checked = check_file(path, LIBRARY)
    assert checked.model is None


@pytest.mark.parametrize(
    "text",
    [
        "machine m\n" + "".join(" " * depth + f"state s{depth}\n" for depth in range(1500)),
        "machine m\nstate a\n    when " + "(" * 20_000 + "space.left" + ")" * 20_000 + " -> a\n",
        "machine m\nstate a\n    when " + "not " * 20_000 + "space.left -> a\n",
        "machine m\nstate a\n    when " + "(" * 50_000,
        "machine m\nvar n : int = " + "-" * 50_000 + "1\n",
        "machine m\nvar n : int = " + "1 + " * 20_000 + "1\n",
        "machine m\nvar n : int = " + "9" * 100_000 + "\n",
        "machine m\nstate a\n    when " + "space.left and " * 5_000 + "space.left -> a\n",
        "machine m\nstate a\n    when " + " or ".join(f"steps == {number}" for number in range(400)) + " -> a\n",
        "machine m\nstate a\n" + "    when space.left -> a\n" * 3_000,
        "machine m\nstate a\n" + "    on bumped if steps > 3 -> a\n" * 3_000,
        "machine m\nstate a\n    on " + ", ".join(["bumped"] * 10_000) + " -> a\n",
        "machine m\n" + "state a\n" * 3_000,
        "machine m\n" + "    $\n" * 5_000,
        "machine " + "m" * 100_000 + "\nstate a\n    on " + "x" * 100_000 + " -> " + "y" * 100_000 + "\n",
        "machine m\nparallel p\n" + "".join(f"    state s{one}\n        on bumped -> p\n" for one in range(400)),
    ],
    ids=range(16),
)
def test_extremes(text):
    survives(text)


def test_a_ladder_of_or_is_not_deep():
    condition = " or ".join(["space.left", "space.right"] * 500)
    model = parse_model(f"machine m\nstate a\n    when {condition} -> a\n", LIBRARY)
    assert model.transitions


def test_every_state_of_a_deep_machine_is_there():
    model = parse_model("machine m\n" + "".join(" " * depth + f"state s{depth}\n" for depth in range(1500)), LIBRARY)
    assert len(model.states) == 1501
    assert model.states[1].last == 1500
