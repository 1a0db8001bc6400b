"""Every construct of the language, with everything that must know it: layout, editor, drawing, exploration, export, replay."""

import json
import re
from pathlib import Path

import pytest

from hsm import MachineError, build
from hsm.dsl import check_file, load_model
from hsm.dsl.format.formatter import format_text
from hsm.dsl.lsp import navigation
from hsm.dsl.lsp.editing import Document
from hsm.dsl.lsp.navigation import Colour, RenameError
from hsm.dsl.syntax.lexer import IN_PLACE, RESERVED, STATEMENTS
from hsm.engine.occurrences import event_text
from hsm.interchange.diagrams import render
from hsm.interchange.scxml import differences, read_text, write_text
from hsm.testing.coverage.items import ItemKind, points
from hsm.testing.generation.generating import generate
from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.running import run_suite
from hsm.testing.scenarios.script import scripted_machine
from hsm.testing.scenarios.writing import Writer
from tests.dsl.library import make_library

LIBRARY = make_library()
COUNTER = "machine counter\nexpose laps\nparam most : int = 3\nvar laps : int = 0\nstate counting\n    do ring()\n"
COUNTER += "    every 1 s / laps += 1\n    on done, refused -> stopped\n    after 9 s if laps > most -> stopped\nfinal stopped\n"
TALKER = "machine talker\nevent claim(key : int), grant\nparam key : int\nstate idle\n    on claim if claim.key > key / send grant\n"
TALKER += "    on grant -> busy\n    when door.near -> asking\nstate asking\n    entry / send claim(key)\n    on grant -> busy\n    after 1 s -> idle\nstate busy\n    after 1 s -> idle / send claim(key = 2)\n"
BESIDE = {"counter": COUNTER, "talker": TALKER}

CONSTRUCTS = {
    "import, instance, exposed": "import counter\nvar last : int = 0\nstate one = counter(most = 2)\n"
    "    on stopped -> two / last = one.laps\nstate two = counter()\n    when two.laps > last and one.outcome == stopped -> over\n"
    "    on stopped -> over\nfinal over",
    "member": "import talker\nproperty apart : never in(red.busy) and in(blue.busy)\nparallel both\n"
    "    when red.space.left and in(blue.idle) -> over\n    member red = talker(key = 1)\n    member blue = talker(key = 2)\n"
    "        on blue.grant -> over\nfinal over",
    "param, var": "param near : length = 0.5 m\nparam far : length = 2 * near\nvar n : int = 0\nvar h : angle = 90 deg\nstate a\n"
    "    when ahead < near and n < 2 -> b / n += 1\nstate b\n    when ahead > far or heading > h -> a / h = -h, n *= 2, n -= 1\n"
    "final c",
    "event, data": "event floor(number : int, up : bool), stop\nvar n : int = 0\nstate a\n"
    "    on floor if floor.number > n and floor.up -> b / n = floor.number\nstate b\n    on stop, bumped -> a / raise floor(1, up = false)\n",
    "enum": "enum Pace = slow, quick\nevent go(pace : Pace)\nvar pace : Pace = slow\nstate a\n    on go if go.pace != pace -> b / pace = go.pace\n"
    "state b\n    when pace == quick -> a / pace = slow\n    when pace == slow and door.near -> a",
    "define": "define free = space.left or (space.right and n > 1)\nvar n : int = 0\nstate a\n    when free -> b / n += 1\nstate b\n"
    "    when not free -> a",
    "property": "var n : int = 0\nproperty p1 : never n > 9\nproperty p2 : always n >= 0 or in(a)\n"
    "property p3 : always eventually not in(b) within 10 s\nproperty p4 : after in(b), in(a) within 3 s\n"
    "property p5 : after in(b), doing(ring) before holding(bell)\nstate a\n    do ring()\n    when door.near -> b / n = 1\n"
    "    on done, refused -> b\nstate b\n    after 1 s -> a",
    "state, parallel, final": "parallel both\n    on done -> over\n    state left\n        initial l1 / raise up\n        state l1\n"
    "            on bumped -> l2\n        final l2\n    state right\n        state r1\n            on up -> r2\n            on bumped -> r2\n"
    "        state r2\n            on bumped -> r3\n        final r3\nfinal over",
    "history": "state out\n    on bumped -> pause\n    state one\n        when space.left -> two\n    state two\n        when space.right -> one\n"
    "state pause\n    after 1 s -> out.history\n    when door.near -> out.deep_history",
    "do, entry, exit": "var n : int = 0\nstate a\n    do rotate(90 deg, rate = 1 rad/s)\n    entry / n += 1, beep(2), door.remember()\n"
    "    exit / n = 0\n    on done -> b\n    on fault => a / n = 3\nstate b\n    when space.front -> a",
    "on, arrows": "event go, back\nvar n : int = 0\nstate a\n    on go -> inner\n    on back => inner / n += 1\n    on * / n = 0\n"
    "    state first\n        when n == 1 -> inner\n    state inner\n        when space.left and n == 0 => first",
    "several targets": "event go\nstate a\n    on go -> l2, r2\nparallel p\n    on go -> a\n    state left\n        state l1\n            after 1 s -> l2\n"
    "        state l2\n            stay\n    state right\n        state r1\n            after 1 s -> r2\n        state r2\n            stay",
    "when, else, stay": "var n : int = 0\nstate a\n    when door.near if n < 2 -> b / n += 1\n    when steps > 3 -> c\n    else -> b\nstate b\n"
    "    stay when space.left\n    when space.right -> a\nstate c\n    stay",
    "when for": "param dwell : time = 0.5 s\nstate a\n    when space.left for dwell -> b\nstate b\n    when not space.left for 1 s if door.near -> a",
    "after, every": "var n : int = 0\nstate a\n    after 2 s if n > 1 -> b\n    every 0.5 s if not space.left / n += 1\nstate b\n"
    "    after (1 s if n > 3 else 3 s) -> a / n = 0",
    "raise, cancel": "event go, calm\nvar n : int = 0\nstate a\n    on go -> b / raise tired after 3 s, raise more, raise late(n + 1) after 1 s\n"
    "    on late / n = 0\nstate b\n    on tired, calm -> a / cancel tired, cancel late\n    on more / n += 1\n    on late / n = late.n\nevent late(n : int)\nevent tired",
    "send": "event claim(key : int), grant\nstate a\n    when door.near -> b / send claim(3), send grant\nstate b\n    on claim, grant -> a",
    "defer": "event letter(number : int), rest\nvar n : int = 0\nstate a\n    defer letter, rest if n < 3\n    on bumped -> b\nstate b\n"
    "    on letter / n = letter.number\n    on rest -> a",
    "expressions": "param near : length = 0.5 m\nvar n : int = 3\nvar x : number = 0.5\nvar ok : bool = false\nvar side : Side = left\nstate a\n"
    "    when abs(heading) < 5 deg and min(ahead, near) >= 0.2 m or max(n, 4) == 4 and not (junction.kind == dead_end) -> b / "
    "ok = (n if space.left else -n) > 2 and in(b), side = (left if ok else right), x = (1 + n) / (2 * n)\nstate b\n"
    "    when (ahead / near) * 2 - x > 1 and side != right and clear(distance = 20 cm) -> a",
    "exposed": "expose n\nvar n : int = 0\nstate a\n    on bumped -> a / n = 1",
}  # fmt: skip
CHECKED = list(CONSTRUCTS)


@pytest.fixture
def files(tmp_path):
    """The file of a construct's machine, beside the machines that it imports."""

    def write(name):
        for beside, text in BESIDE.items():
            (tmp_path / f"{beside}.maze-machine").write_text(text, encoding="utf-8")
        path = tmp_path / "m.maze-machine"
        head = f"machine m\n{CONSTRUCTS[name]}\n"
        path.write_text(_declarations_first(head), encoding="utf-8")
        return path

    return write


def _declarations_first(text):
    """A machine whose declarations come before its states."""
    lines = text.split("\n")
    declared = [one for one in lines if one.startswith(("event", "var", "param", "enum", "define", "expose", "property", "import"))]
    return "\n".join([lines[0], *declared, *(one for one in lines[1:] if one not in declared)])


def test_the_table_has_every_word():
    text = "\n".join([*CONSTRUCTS.values(), *BESIDE.values()])
    missing = [word for word in sorted(STATEMENTS | RESERVED | IN_PLACE) if not re.search(rf"\b{word}\b", text)]
    assert missing == []


@pytest.mark.parametrize("name", CHECKED)
def test_check_and_layout_know_it(name, files):
    path = files(name)
    checked = check_file(path, LIBRARY)
    assert checked.model is not None, checked.diagnostics
    formatted = format_text(path.read_text(encoding="utf-8"))
    assert format_text(formatted) == formatted
    path.write_text(formatted, encoding="utf-8")
    again = check_file(path, LIBRARY)
    assert [one.code for one in again.diagnostics] == [one.code for one in checked.diagnostics]


@pytest.mark.parametrize("name", CHECKED)
def test_the_editor_knows_it(name, files):
    path = files(name)
    documents = {one.stem: Document(one.read_text(encoding="utf-8"), str(one), LIBRARY) for one in path.parent.glob("*.maze-machine")}
    document = documents["m"]
    coloured = {(one.line, one.column): one.kind for one in navigation.colours(document)}
    for number, line in enumerate(document.tree.lines):
        for match in re.finditer(r"[A-Za-z_]\w*", line):
            place = number, match.start()
            occurrence = document.occurrence(*place)
            if occurrence is None:
                unit = re.search(r"\d *(\w+/)?$", line[: match.start()])
                assert coloured.get(place) is Colour.KEYWORD or unit or match.group() in ("true", "false", "none"), (line, match.group())
            elif occurrence.column == match.start():
                assert document.hover(*place) is not None, (line, match.group())
        for column in range(len(line) + 1):
            document.completions(number, column)
            document.call(number, column)
    assert navigation.outline(document)


@pytest.mark.parametrize("name", CHECKED)
def test_what_it_declares_can_be_renamed(name, files):
    path = files(name)
    texts = {one: one.read_text(encoding="utf-8") for one in path.parent.glob("*.maze-machine")}
    documents = [Document(text, str(one), LIBRARY) for one, text in texts.items()]
    codes = {one: [found.code for found in check_file(one, LIBRARY).diagnostics] for one in texts}
    for document in documents:
        for one in document.occurrences:
            if not one.declares or one.role.name == "MACHINE":
                continue
            changes = navigation.rename(document, one.line, one.column, "renamed", documents)
            for file, text in texts.items():
                file.write_text(_renamed(text, [place for other, place in changes if Path(other) == file]), encoding="utf-8")
            assert {file: [found.code for found in check_file(file, LIBRARY).diagnostics] for file in texts} == codes, one
            for file, text in texts.items():
                file.write_text(text, encoding="utf-8")


def _renamed(text, places):
    lines = text.split("\n")
    for one in sorted(places, key=lambda place: (place.line, -place.column)):
        line = lines[one.line]
        assert line[one.column : one.end] == one.name
        lines[one.line] = f"{line[: one.column]}renamed{line[one.end :]}"
    return "\n".join(lines)


@pytest.mark.parametrize("name", CHECKED)
def test_drawing_exploration_coverage_and_scenarios_know_it(name, files):
    model = load_model(files(name), LIBRARY)
    machine = scripted_machine(model) if False else build(model)
    drawing = render(machine, "mmd").decode()
    assert all(state.own_name in drawing for state in model.states[1:])
    found = generate(machine)
    text = Writer(model).suite(found.scenarios)
    results = run_suite(parse_suite(text, model, LIBRARY), machine)
    assert [one.failure for one in results if not one.passed] == []
    coverage = results[0].coverage
    for result in results[1:]:
        coverage = coverage.merge(result.coverage)
    unreached = " ".join(one.text for one in found.unreached)
    left = [one.text for one in points(model, coverage) if one.kind is ItemKind.TRANSITION and not one.covered]
    assert not [one for one in left if one.removesuffix(" never taken") not in unreached]


@pytest.mark.parametrize("name", CHECKED)
def test_export_translates_it_names_it_or_it_is_refused(name, files):
    model = load_model(files(name), LIBRARY)
    text = write_text(model)
    try:
        back = read_text(text)
    except MachineError as error:
        assert all(one.place is not None and one.message for one in error.diagnostics)
        return
    assert [one.name for one in back.states] == [one.name for one in model.states]
    assert all(one.place is not None for one in differences(model))


@pytest.mark.parametrize("name", CHECKED)
def test_a_saved_run_goes_on_and_its_events_are_read_back(name, files):
    model = load_model(files(name), LIBRARY)
    machine = build(model)
    for scenario in generate(machine).scenarios[:3]:
        assert scenario.name
    for event in sorted(model.events or ()):
        declared = model.data_of(event)
        if declared is None:
            assert event_text(model, event) == event
    assert json.dumps(Writer(model).suite([]))
    with pytest.raises(RenameError):
        navigation.rename(Document("machine m", "m", LIBRARY), 0, 0, "x", [])
