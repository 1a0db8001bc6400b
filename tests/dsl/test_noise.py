"""One mistake is reported once: whatever follows from it is not.

All faults in all machines: ``MAZE_MACHINE_EXAMPLES=1 pytest tests/dsl/test_noise.py``.
"""

import os
import random
from pathlib import Path

import pytest

from hsm.dsl import check_text
from tests.dsl.faults import planted

HERE = Path(__file__).parent / "machines"
STRIDE = 1 if os.environ.get("MAZE_MACHINE_EXAMPLES") else 13
MOST = {"indented wrongly": 3, "a line twice": 2}
"""A line that is indented as if it belonged to another state is a fault of that state, and may be two."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("machines")
    for path in HERE.glob("*.maze-machine"):
        (folder / path.name).write_text(path.read_text())
    (folder / "steward.maze-machine").write_text(STEWARD)
    return folder


STEWARD = """\
# Everything that the language has.
machine steward

import door

param cruise : speed = 0.5 m/s
param near   : length = 0.4 m
param wait   : time = 5 s

var turns : int = 0
var way   : Side = left

event go, halt

property calm    : never doing(ring) and holding(base) and in(open_door)
property counted : always turns <= 3 or turns >= -3
property back    : after in(turning), in(straight) within 20 s

initial waiting

state waiting
    do wait(wait)
    on done                                -> working
    on go                                  -> working / raise halt

parallel working
    entry / turns = 0
    on halt                                -> over
    on bumped                              -> open_door
    when exit.crossed                      -> over

    state base
        initial straight

        state straight
            do follow_wall(side = right, speed = cruise)
            when ahead < near and space.left   -> turning / turns += 1, way = left
            when ahead < near and not space.left -> turning / turns -= 1, way = right
            stay when ahead >= near

        state turning
            do rotate(90 deg, rate = 45 deg/s)
            on done if turns > 2               -> straight / beep(2)
            on done                            -> straight
            after 10 s                         -> straight

    state watch
        initial quiet

        state quiet
            when door.near and not door.tried and in(straight) -> alarmed / door.remember()

        state alarmed
            do ring()
            on done, refused                   -> quiet
            on fault => watch

    state count
        when way == left and junction.kind == dead_end -> working.history

state open_door = door(timeout = 8 s)
    entry / beep()
    on opened, stayed_shut                 -> working.deep_history
    on go                                  -> over

final over
"""


def names():
    return ["steward", *(path.stem for path in sorted(HERE.glob("*.maze-machine")))]


@pytest.mark.parametrize("name", names())
def test_one_fault_is_one_finding(name, folder, library):
    path = folder / f"{name}.maze-machine"
    text = path.read_text()
    known = {one.code for one in check_text(text, library, str(path)).diagnostics}
    noisy = []
    for fault in list(planted(text))[::STRIDE]:
        found = check_text(fault.text, library, str(path)).diagnostics
        new = [one for one in found if one.code not in known]
        if len(new) > MOST.get(fault.kind, 1):
            noisy.append((fault.kind, fault.line, *map(str, new)))
    assert not noisy, "\n\n".join("\n".join(map(str, one)) for one in noisy)


def together(text, faults):
    """The text with several faults; None where two are on one line, or one moves the others."""
    lines, broken = text.split("\n"), text.split("\n")
    for fault in faults:
        changed = fault.text.split("\n")
        if len(changed) != len(lines):
            return None
        for number, (old, new) in enumerate(zip(lines, changed, strict=True)):
            if old != new and broken[number] != old:
                return None
            broken[number] = new if old != new else broken[number]
    return "\n".join(broken)


@pytest.mark.parametrize("name", names())
def test_several_faults_are_as_many_findings(name, folder, library):
    path = folder / f"{name}.maze-machine"
    text, draw = path.read_text(), random.Random(name)
    known = {one.code for one in check_text(text, library, str(path)).diagnostics}
    faults, noisy, tried = list(planted(text)), [], 0
    while tried < 200 // STRIDE:
        chosen = draw.sample(faults, draw.choice((2, 3)))
        broken = together(text, chosen)
        if broken is None:
            continue
        tried += 1
        new = [one for one in check_text(broken, library, str(path)).diagnostics if one.code not in known]
        if len(new) > sum(MOST.get(fault.kind, 1) for fault in chosen):
            noisy.append((*((fault.kind, fault.line) for fault in chosen), *map(str, new)))
    assert not noisy, "\n\n".join("\n".join(map(str, one)) for one in noisy)


@pytest.mark.parametrize(
    ("body", "codes"),
    [
        pytest.param("event go  # accept N0601: by hand\nstate a\n    on go $ -> a", ["E0101"], id="accepted"),
        pytest.param("event told(key : int$ )\nstate a\n    on told if told.key > 2 -> a", ["E0101"], id="carried"),
        pytest.param("event told(key : qqq)\nstate a\n    entry / raise told(key = 2)", ["E0206"], id="carried type"),
        pytest.param(
            "Pace = slow, fast\nvar pace : Pace = slow\nstate a\n    when pace == slow -> a", ["E0101"], id="enum"
        ),
        pytest.param("event go\nstate a\n    after 3 s / send qqxqq\n    after 5 s -> a", ["E0203"], id="sent"),
        pytest.param("state a\n    when ahead < 1 m\n        and space.left -> a", ["E0101"], id="continued below"),
        pytest.param("state a\n    when ahead < 1 m\n    and space.left -> a", ["E0101"], id="continued beside"),
        pytest.param(
            "$ import x\nstate a = x()\n    on done -> b\nstate b\n    when in(a.inside) -> a", ["E0101"], id="import"
        ),
        pytest.param("state a\n    raise $\n    entry / cancel later", ["E0101"], id="delayed"),
    ],
)
def test_what_follows_from_a_fault_is_not_reported(body, codes, library):
    found = check_text(f"machine m\n{body}\n", library).diagnostics
    assert [one.code for one in found if one.code[0] == "E" or one.code in ("W0604", "W0605")] == codes, found
