"""One canonical form; formatting twice changes nothing, and never the meaning or a comment."""

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings

from hsm.dsl import parse_model
from hsm.dsl.format.formatter import format_text
from hsm.model.diagnostics import MachineError
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


@settings(max_examples=150, deadline=None, derandomize=True)
@given(machines())
def test_formatting_is_idempotent_and_keeps_meaning_and_comments(text):
    formatted = format_text(text)
    assert format_text(formatted) == formatted
    before, after = parse_model(text, LIBRARY), parse_model(formatted, LIBRARY)
    assert stripped(replace(before, doc="", enumerations=())) == stripped(replace(after, doc="", enumerations=()))
    assert (before.doc, [state.doc for state in before.states]) == (after.doc, [state.doc for state in after.states])
    comments = [line.partition("#")[2].strip() for line in text.split("\n") if "#" in line]
    assert [line.partition("#")[2].strip() for line in formatted.split("\n") if "#" in line] == comments


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
