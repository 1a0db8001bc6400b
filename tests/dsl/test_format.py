"""One canonical form; formatting twice changes nothing, and never the meaning or a comment."""

from dataclasses import replace
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings

from hsm.dsl import check_text, parse_model
from hsm.dsl.format.formatter import format_text
from hsm.model.diagnostics import MachineError
from tests.dsl.charts_at_random import PART, carelessly, chart_text
from tests.dsl.charts_at_random import make_library as make_failing_library
from tests.dsl.library import make_library
from tests.dsl.machines_at_random import machines

LIBRARY = make_library()
ROOT = Path(__file__).parents[2]


def stripped(value):
    """A model or a part of one without places."""
    if isinstance(value, tuple):
        return tuple(map(stripped, value))
    if not hasattr(value, "__dataclass_fields__"):
        return value
    fields = {name: stripped(getattr(value, name)) for name in value.__dataclass_fields__ if name != "place"}
    return type(value).__name__, tuple(fields.items())


def assert_the_same(text, library, file="<text>"):
    """That the layout of a text can be made canonical, with the same meaning and comments."""
    formatted = format_text(text)
    assert format_text(formatted) == formatted
    before, after = parse_model(text, library, file), parse_model(formatted, library, file)
    assert stripped(replace(before, doc="", enumerations=())) == stripped(replace(after, doc="", enumerations=()))
    assert (before.doc, [state.doc for state in before.states]) == (after.doc, [state.doc for state in after.states])
    comments = [line.partition("#")[2].strip() for line in text.split("\n") if "#" in line]
    assert [line.partition("#")[2].strip() for line in formatted.split("\n") if "#" in line] == comments


@settings(max_examples=100, deadline=None, derandomize=True)
@given(machines())
def test_formatting_is_idempotent_and_keeps_meaning_and_comments(text):
    assert_the_same(text, LIBRARY)


@pytest.mark.parametrize("instances", [False, True])
def test_a_random_chart_with_every_kind_of_state_too(tmp_path, instances):
    (tmp_path / "part.maze-machine").write_text(PART, encoding="utf-8")
    library, file = make_failing_library([]), str(tmp_path / "chart.maze-machine")
    tried = ""
    for seed in range(1000, 1060):
        text = chart_text(seed, instances=instances)
        if check_text(text, library, file, remarks=False).model is not None:
            tried += text
            assert_the_same(carelessly(text, Random(seed)), library, file)
    words = "parallel |history|else |defer |every | for |on done|initial |exit |raise g after"
    assert [word for word in words.split("|") if tried.count(word) < 3] == []


def test_the_canonical_form():
    untidy = """


#top
machine   x   # a
param a:speed=0.5m/s   #c1
param long_name :time=5   s #c2
var n:int=-1
  # before the state
state a

  # in the state
  entry   /beep( ),n+=-1
  on done,x   if n==-1 and(a>1 or not  b)->b  /n-=1
  when clear(0.5m) / n=(1+2)*-3


  # last of a
# top again
state b
       do rotate( -90deg,rate=2 )
       when (a and
          # inner
        b)  -> c   # tail
       on q->d
       on q=>long_state / n = 1
final z"""
    assert (
        format_text(untidy)
        == """\
# top
machine x                          # a
param a         : speed = 0.5 m/s  # c1
param long_name : time  = 5 s      # c2
var n : int = -1
# before the state
state a

    # in the state
    entry / beep(), n += -1
    on done, x if n == -1 and (a > 1 or not b) -> b / n -= 1
    when clear(0.5 m)                               / n = (1 + 2) * -3

    # last of a
# top again
state b
    do rotate(-90 deg, rate = 2)
    when (a and
            # inner
            b) -> c  # tail
    on q -> d
    on q => long_state / n = 1
final z
"""
    )


def test_what_cannot_be_read_is_not_formatted():
    with pytest.raises(MachineError):
        format_text("machine m\nstate a\n    on ->\n")


def test_a_file_with_line_ends_of_windows_and_none_at_its_end():
    assert format_text("machine m\r\nstate a\r\n\r\n\r\n  on x -> a") == "machine m\nstate a\n\n    on x -> a\n"


def test_an_empty_text_stays_empty():
    assert format_text("\n \n") == ""


@pytest.mark.parametrize("path", sorted((ROOT / "machines").glob("*.maze-machine")), ids=lambda path: path.stem)
def test_a_shipped_machine_can_be_formatted(path):
    formatted = format_text(path.read_text(encoding="utf-8"))
    assert format_text(formatted) == formatted
