"""What people write who know another language or tool: the suggestion names what to write here."""

import pytest

from hsm.dsl import check_text
from hsm.model.diagnostics import Severity

RIGHT = """machine right

import door

var tries : int = 0

state driving
    do drive()
    on blocked -> turning

state turning
    do rotate(1 rad)
    on done -> driving / tries += 1

final out
"""


@pytest.mark.parametrize(
    ("old", "new", "suggestion"),
    [
        ("import door", "import door.maze-machine", "`import door`"),
        ("import door", "from door import door", "`import door`"),
        ("var tries", "let tries", "`var NAME : TYPE = VALUE`"),
        ("int = 0", "string = 0", "declare an enumeration"),
        ("state driving", "initial: driving\nstate driving", "leave out the colon: `initial NAME`"),
        ("state driving", "initial = driving\nstate driving", "leave out the `=`: `initial NAME`"),
        ("state driving", "[*] -> driving\nstate driving", "`initial NAME`"),
        ("do drive()", "do sleep(5 s)", "`after 3 s -> ...`"),
        ("do drive()", "do drive() and ring()", "a state has one activity"),
        ("rotate(1 rad)", "rotate(1 rad))", "remove `)`"),
        ("    on blocked", "    on_enter / beep()\n    on blocked", "`entry / ...`"),
        ("    on blocked", "    onexit / beep()\n    on blocked", "`exit / ...`"),
        ("-> turning", "->> turning", "write `->`"),
        ("-> turning", "-> null", "a transition that leaves no state has no target"),
        ("-> turning", "-> turning.rotate", "there is no state `rotate` in `turning`"),
        ("-> turning", "-> driving.turning", "the name alone is enough: `turning`"),
        ("driving / tries += 1", "driving, tries = tries + 1", "write actions after a slash"),
        ("tries += 1", "tries == 1", "assign with `=`"),
        ("on blocked ->", "when tries not in (1, 2) ->", "compare with `==`"),
        ("on blocked ->", "when tries % 2 == 0 ->", "there is no such operator"),
        ("on blocked ->", "when tries ** 2 > 4 ->", "there is no such operator"),
    ],
)
def test_the_suggestion_names_what_to_write(old, new, suggestion, library):
    assert old in RIGHT
    errors = [
        one for one in check_text(RIGHT.replace(old, new, 1), library).diagnostics if one.severity is Severity.ERROR
    ]
    assert any(suggestion in (one.suggestion or "") for one in errors), [str(one) for one in errors]


def test_a_right_machine_has_no_errors(library):
    assert [
        one
        for one in check_text(RIGHT.replace("import door\n", ""), library).diagnostics
        if one.severity is Severity.ERROR
    ] == []
