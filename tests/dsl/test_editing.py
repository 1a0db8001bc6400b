"""What an editor is told: completion, hovering, definitions, outline; and all of it over the protocol once."""

import importlib
import json
import linecache
import subprocess
import sys
from pathlib import Path

import pytest

from hsm.dsl import check_text
from hsm.dsl.lsp import actions, navigation, refactoring, references
from hsm.dsl.lsp.completion import completions
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.edited import MachineFile
from hsm.dsl.lsp.entries import SymbolKind
from hsm.dsl.lsp.hovering import hover, open_call
from hsm.dsl.lsp.occurrences import Role
from maze_machine.catalogue.library import robot_library, robot_names
from maze_machine.editor.scenarios import ScenarioDocument

MACHINES = Path(__file__).parent / "machines"
TEXT = """\
# Walks.
machine walk

import door

param cruise : speed = 0.5 m/s
var turns : int = 0

# Drives on.
state straight
    do drive(speed = cruise)
    when space.front -> turning

state turning
    initial left
    on done -> straight.

    state left
        do rotate(90 deg)
        on done -> open_door / turns += 1

state open_door = door(timeout = 3 s)
    on opened -> turning.history

final over
"""


@pytest.fixture
def document(library):
    return lambda text=TEXT: Document(text, str(MACHINES / "walk.maze-machine"), library)


@pytest.fixture
def complete(document):
    """What could stand at the end of a line that is put before the end of the file."""

    def labels(line):
        lines = [*TEXT.split("\n")[:-2], line]
        return {one.label: one for one in completions(document("\n".join(lines)), len(lines) - 1, len(line))}

    return labels


def test_lines_begin_with_words(complete):
    assert {"state", "on", "when", "after", "final", "do"} <= complete("    ").keys()
    assert "drive" not in complete("    ")


def test_a_target_is_a_state(complete):
    found = complete("    on done -> ")
    assert set(found) == {
        *("straight", "turning", "turning.history", "turning.deep_history"),
        *("left", "open_door", "open_door.history", "open_door.deep_history"),
    }
    assert found["straight"].doc == "Drives on."
    assert set(complete("    on done -> turning.")) == {"turning.history", "turning.deep_history"}


@pytest.mark.parametrize(
    ("line", "some", "none"),
    [
        ("    do ", {"drive", "rotate", "ring"}, {"space.front", "beep"}),
        ("    do dr", {"drive"}, {"space.front"}),
        ("    do drive(", {"speed = ", "cruise"}, {"side = "}),
        ("    do drive(speed = ", {"cruise"}, set()),
        ("    when ", {"space.left", "turns", "cruise", "clear", "in", "dead_end"}, {"drive", "beep"}),
        ("    when space.left and not sp", {"space.front"}, {"drive"}),
        ("    when junction.kind == ", {"dead_end", "corner"}, {"drive"}),
        ("    on ", {"done", "blocked", "bumped", "fault"}, {"drive", "space.left"}),
        ("    on done, ", {"blocked"}, {"space.left"}),
        ("    on done -> left / ", {"beep", "door.remember", "turns", "raise"}, {"drive", "cruise"}),
        ("    on done -> left / turns = 1, ", {"beep", "turns"}, {"drive"}),
        ("    after 5 ", {"s", "ms", "min"}, {"drive"}),
        ("param near : ", {"length", "bool", "Side"}, {"drive"}),
        ("param near : speed = ", {"cruise", "max"}, {"turns", "clear", "distance.front", "in"}),
        ("var near : bool = ", set(), {"turns", "space.left", "clear"}),
        ("    when in(", {"turning", "left"}, {"turning.history", "turns"}),
        ("import ", {"door", "pledge"}, {"walk"}),
        ("state x = ", {"door"}, {"pledge"}),
        ("state ", set(), {"straight", "drive"}),
        ("    do drive() # see ", set(), {"drive", "space.left"}),
    ],
)
def test_what_could_stand_there(complete, line, some, none):
    found = complete(line).keys()
    assert some <= found
    assert not none & found


def at(word, nth=0):
    """Line and column within an occurrence of a word."""
    start = -1
    for _ in range(nth + 1):
        start = TEXT.index(word, start + 1)
    line = TEXT.count("\n", 0, start)
    return line, start - (TEXT.rindex("\n", 0, start) + 1 if line else 0) + 1


def test_hovering_shows_the_registry(document):
    found = hover(document(), *at("drive("))
    assert (found.kind, found.doc) == (SymbolKind.ACTIVITY, "Drive straight on.")
    assert found.detail == "drive(speed : speed = 0.5 m/s) -> blocked; uses base"
    assert hover(document(), *at("space.front")).detail == "space.front : bool"
    assert hover(document(), *at("cruise", 1)).detail == "speed = 0.5 m/s"
    assert hover(document(), 999, 0) is None


def test_hovering_a_state_shows_the_ways_in_and_out(document):
    found = hover(document(), *at("straight"))
    assert found.doc.startswith("Drives on.")
    assert "out:\n- `when space.front -> turning`" in found.doc
    assert "in:" not in found.doc
    assert "- open_door: `on opened -> turning.history`" in hover(document(), *at("turning", 1)).doc


def test_hovering_an_argument_and_a_machine(document):
    assert hover(document(), *at("speed = cruise")).detail == "speed in m/s"
    assert hover(document(), *at("door")).kind is SymbolKind.MACHINE
    assert hover(document(), *at("deg")).detail == "angle"


def test_a_call_shows_what_it_takes_and_what_is_due(document):
    text = TEXT.replace("do rotate(90 deg)", "do rotate(")
    line, column = at("rotate(")
    call = open_call(Document(text, "walk.maze-machine", document().library), text.splitlines()[line][: column + 6])
    assert (call.name, call.active) == ("rotate", 0)
    assert call.parameters[0].name == "angle"


def test_definitions(document):
    def defined(word, nth=0):
        return navigation.definition(document(), *at(word, nth))

    assert defined("cruise", 1).line == 5
    assert defined("turning").line == 13
    assert defined("turning.history").line == 13
    assert defined("door", 3).file == str(MACHINES / "door.maze-machine")
    assert Path(defined("rotate").file).name == "library.py"
    assert Path(defined("space.front").file).name == "library.py"
    assert defined("done", 1) == defined("rotate")
    assert defined("90") is None


def test_an_argument_leads_to_the_python_that_takes_it(document):
    found = navigation.definition(document(), *at("speed = cruise"))
    assert found is not None
    assert Path(found.file).suffix == ".py"


def test_an_activity_of_a_robot_leads_to_its_source():
    text = TEXT.replace("do rotate", "do align(side = right)\n        # do rotate")
    found = navigation.definition(Document(text, "walk.maze-machine", robot_library()), *at("rotate(90"))
    assert found is not None
    assert Path(found.file).name == "align.py"


def test_references_are_those_of_one_meaning(document):
    def used(word, nth=0):
        return [(one.line, one.declares) for one in references.references(document(), *at(word, nth))]

    assert used("cruise") == [(5, True), (10, False)]
    assert used("turning") == [(11, False), (13, True), (22, False)]
    assert used("turns") == [(6, True), (19, False)]
    assert used("open_door") == [(19, False), (21, True)]


def test_a_new_name_is_written_wherever_the_old_one_is_meant(document):
    one = document()
    found = references.rename(one, *at("turning"), "veering", [])
    lines = [list(line) for line in TEXT.split("\n")]
    for _, place in sorted(found, key=lambda pair: (pair[1].line, -pair[1].column)):
        lines[place.line][place.column : place.end] = "veering"
    renamed = "\n".join("".join(line) for line in lines)
    assert renamed == TEXT.replace("turning", "veering")
    for name in ("not a name", "9", "straight", "cruise", "space.front", "", "and"):
        with pytest.raises(references.RenameError):
            references.rename(one, *at("turning"), name, [])
    for word in ("rotate", "space.front", "90"):
        with pytest.raises(references.RenameError):
            references.rename(one, *at(word), "other", [])


PART = """machine part

event knock

param rest : time = 1 s

var count : int = 0

expose count

initial a

state a
    on knock -> a / count += 1
    after rest -> over

final over
"""
WHOLE = """machine whole

import part

initial p

state p = part(rest = 2 s)
    on over -> q
    when p.count > 2 -> q / raise knock

state q
    on over -> p
"""
SCENARIOS = """test whole

scenario it rests
    given rest = 1 s
    expect p.a, a
    when event knock,
        # twice

        event knock
    expect p.count == 2, not p.over, q
"""


@pytest.mark.parametrize(
    ("asked", "places"),
    [
        (("part", 4, 7), {("part", 4), ("part", 14), ("whole", 6)}),  # a parameter
        (("whole", 6, 17), {("part", 4), ("part", 14), ("whole", 6)}),
        (("part", 16, 8), {("part", 14), ("part", 16), ("whole", 7), ("tests", 9)}),  # an outcome
        (("whole", 7, 8), {("part", 14), ("part", 16), ("whole", 7), ("tests", 9)}),
        (("part", 6, 5), {("part", 6), ("part", 8), ("part", 13), ("whole", 8), ("tests", 9)}),  # what it exposes
        (("whole", 8, 12), {("part", 6), ("part", 8), ("part", 13), ("whole", 8), ("tests", 9)}),
        (("tests", 9, 14), {("part", 6), ("part", 8), ("part", 13), ("whole", 8), ("tests", 9)}),
        (("part", 2, 6), {("part", 2), ("part", 13), ("whole", 8), ("tests", 5), ("tests", 8)}),  # an event
        (("tests", 8, 16), {("part", 2), ("part", 13), ("whole", 8), ("tests", 5), ("tests", 8)}),
        (("part", 12, 6), {("part", 10), ("part", 12), ("part", 13), ("tests", 4)}),  # a state of the part
        (("whole", 10, 6), {("whole", 7), ("whole", 8), ("whole", 10), ("tests", 9)}),  # a state
        (("tests", 4, 11), {("whole", 4), ("whole", 6), ("whole", 8), ("whole", 11), ("tests", 4), ("tests", 9)}),
    ],
)
def test_a_new_name_reaches_all_files_wherever_it_is_asked_for(library, tmp_path, asked, places):
    for name, text in (("part", PART), ("whole", WHOLE)):
        (tmp_path / f"{name}.maze-machine").write_text(text, encoding="utf-8")
    known = {
        "part": Document(PART, str(tmp_path / "part.maze-machine"), library),
        "whole": Document(WHOLE, str(tmp_path / "whole.maze-machine"), library),
        "tests": ScenarioDocument(SCENARIOS, str(tmp_path / "whole.maze-test"), library, {}),
    }
    names = {one.file: name for name, one in known.items()}
    file, line, column = asked
    found = references.rename(known[file], line, column, "renamed", known.values())
    assert {(names[of.file], one.line) for of, one in found} == places
    written = {references.occurrence(known[file], line, column).name}
    for of, one in found:
        assert of.lines[one.line][one.column : one.end] in written


def test_the_outline(document):
    found = navigation.outline(document())
    assert [one.name for one in found] == ["cruise", "turns", "straight", "turning", "open_door", "over"]
    assert [one.name for one in found[3].children] == ["left"]
    assert (found[3].whole.line, found[3].whole.end_line) == (13, 19)
    assert list(navigation.folds(document())) == [(9, 11, False), (13, 19, False), (17, 19, False), (21, 22, False)]


def test_a_deep_outline(document):
    deep = "machine m\n" + "".join(" " * depth + f"state s{depth}\n" for depth in range(1200))
    assert navigation.outline(document(deep))


def test_colours_name_the_role_of_each_word(document):
    found = {(one.line, one.column): one.kind for one in MachineFile(document()).colours()}
    assert found[0, 0] is navigation.Colour.COMMENT
    assert found[1, 0] is navigation.Colour.KEYWORD
    assert found[at("space.front")[0], at("space.front")[1] - 1] is Role.SIGNAL
    assert found[at("rotate")[0], at("rotate")[1] - 1] is Role.ACTIVITY
    assert found[at("speed = cruise")[0], at("speed = cruise")[1] - 1] is Role.ARGUMENT


def test_what_is_meant_is_one_click_away(library):
    text = "machine m\n\ninitial a\n\nstate a\n    do rotat(90 deg)\n    on done -> b\n\nfinal b\n"
    found = check_text(text, library, "m").diagnostics
    document = Document(text, "m", library)
    edits = actions.all_fixes(actions.fixes(document, found))
    assert [(one.line, one.column, one.end_column, one.text) for one in edits] == [(5, 7, 12, "rotate")]
    mended = text.replace("rotat(", "rotate(")
    mended = mended.replace("on done ->", "after 1 s ->")
    remaining = check_text(mended, library, "m").diagnostics
    (missing,) = (one for one in actions.fixes(Document(mended, "m", library), remaining) if "Add" in one.title)
    assert missing.title == "Add `on done`"
    assert missing.edits[0].text == "\n    on done -> a"


def test_a_missing_transition_leads_back_to_the_state_that_lacks_it(library):
    text = (
        "machine m\n\ninitial a\n\nstate a\n    initial b\n\n    state b\n        after 1 s -> over\n\n"
        "    do rotate(90 deg)\n    when space.left -> over\n\nfinal over\n"
    )
    found = check_text(text, library, "m").diagnostics
    (missing,) = (one for one in actions.fixes(Document(text, "m", library), found) if "on done" in one.title)
    assert missing.edits[0].text == "\n    on done -> a"


def test_units_that_a_line_does_not_show_are_hinted_at(library):
    text = (
        "machine m\nparam near : length = 20 cm\nparam far : length = 2 m # rad\nvar turned : angle = 90 deg # rad\n"
        "var done : int = 0\nvar left : time = 2 * rest\nparam rest : time = 1 s\nevent floor(height : length)\n"
        "var cruise : speed = 1 m/s\nvar ratio : number = 1\n"
    )
    lines = text.split("\n")
    found = [(one.line, lines[one.line][: one.column].split()[-1], one.text) for one in actions.hints(
        Document(text, "m", library), 0, 99
    )]  # fmt: skip
    assert found == [
        (1, "length", " in m"), (3, "angle", " in rad"), (5, "time", " in s"), (7, "length", " in m"),
    ]  # fmt: skip


def test_arguments_that_are_left_out_are_hinted_at(document):
    text = TEXT.replace("do drive(speed = cruise)", "do drive()")
    found = actions.hints(Document(text, "walk", document().library), 0, 99)
    assert {(one.line, one.text) for one in found} == {(10, "speed = 0.5 m/s"), (18, ", rate = 0.8 rad/s")}
    assert [one.line for one in actions.hints(document(), 0, 99)] == [18]


def test_a_wrong_type_is_not_offered(complete):
    assert set(complete("    do follow_wall(side = ")) == {"left", "right"}
    assert {"straight", "left"} <= set(complete("    when in("))
    assert "space.front" not in complete("    when in(")


def test_values_of_the_type_that_is_due_come_first(complete):
    turned = complete("    do rotate(angle = ")
    assert not {"space.front", "dead_end"} & turned.keys()
    first = next(iter(turned.values()))
    assert str(first.type) == "angle"
    assigned = complete("    on done -> left / turns = ")
    assert next(iter(assigned)) == "turns"
    assert "space.front" not in assigned


def test_the_outcomes_of_an_instance_are_offered(complete):
    assert "opened" in complete("    on op")


def test_over_the_protocol(tmp_path):
    path = tmp_path / "walk.maze-machine"
    text = "machine walk\n\nstate a\n  do rotat(90 deg)  # \U0001f6aa\n  on done->b\nfinal b\n"
    path.write_text(text, encoding="utf-8")
    document = {"uri": path.as_uri()}
    there = {"textDocument": document, "position": {"line": 4, "character": 11}}
    messages = [
        {"id": 1, "method": "initialize", "params": {"processId": None, "rootUri": None, "capabilities": {}}},
        {"method": "initialized", "params": {}},
        {
            "method": "textDocument/didOpen",
            "params": {"textDocument": {**document, "languageId": "maze-machine", "version": 1, "text": text}},
        },
        {"id": 2, "method": "textDocument/completion", "params": there},
        {"id": 3, "method": "textDocument/definition", "params": there},
        {"id": 4, "method": "textDocument/hover", "params": {**there, "position": {"line": 3, "character": 17}}},
        {"id": 5, "method": "textDocument/documentSymbol", "params": {"textDocument": document}},
        {
            "id": 6,
            "method": "textDocument/formatting",
            "params": {"textDocument": document, "options": {"tabSize": 4, "insertSpaces": True}},
        },
        {"id": 7, "method": "shutdown"},
        {"method": "exit"},
    ]
    framed = b"".join(frame({"jsonrpc": "2.0", **message}) for message in messages)
    command = [Path(sys.executable).parent / "maze-machine", "lsp"]
    ended = subprocess.run(command, input=framed, capture_output=True, timeout=120, check=False)
    answers = list(unframed(ended.stdout))
    by_id = {one["id"]: one.get("result") for one in answers if "id" in one}
    (published,) = (one["params"] for one in answers if one.get("method") == "textDocument/publishDiagnostics")
    (first,) = (one for one in published["diagnostics"] if one["severity"] == 1)
    assert (first["code"], first["range"]["start"]) == ("E0204", {"line": 3, "character": 5})
    assert {"a", "b"} <= {one["label"] for one in by_id[2]}
    assert by_id[3]["range"]["start"] == {"line": 5, "character": 6}
    assert by_id[4]["contents"]["value"] == "`deg : angle` (unit)"
    assert [one["name"] for one in by_id[5]] == ["a", "b"]
    assert [one["newText"] for one in by_id[6]] == ["    do rotat(90 deg)  # \U0001f6aa", "    on done -> b"]


def frame(message):
    body = json.dumps(message).encode()
    return b"Content-Length: %d\r\n\r\n" % len(body) + body


def unframed(stream):
    while stream:
        head, _, rest = stream.partition(b"\r\n\r\n")
        length = next(
            int(line.split(b":")[1]) for line in head.split(b"\r\n") if line.lower().startswith(b"content-length")
        )
        yield json.loads(rest[:length])
        stream = rest[length:]


# Events with data, what instances expose, machines that talk.

TALKING = """machine m
import door
enum Pace = slow, fast
event floor(number : int, pace : Pace), stop
var at : int = 0
state a
    on floor if floor.number > at / at = floor.number, raise floor(1, slow)
    defer stop
    on stop -> d / send stop
state d = door()
    when d.rings > 1 -> a
"""


@pytest.fixture
def talking(tmp_path, library):
    (tmp_path / "door.maze-machine").write_text(
        "machine door\nexpose rings\n# How often it rang.\nvar rings : int = 0\nvar other : int = 0\n"
        "state x\n    when rings > other -> over\nfinal over\n"
    )
    return Document(TALKING, str(tmp_path / "m.maze-machine"), library)


def at_line(document, number, text):
    line = document.tree.lines[number - 1]
    return number - 1, line.index(text) + 1


def test_hovering_over_an_event_and_what_it_carries(talking):
    assert hover(talking, *at_line(talking, 7, "floor")).detail == "event floor(number : int, pace : Pace)"
    entry = hover(talking, *at_line(talking, 7, "number > at"))
    assert (entry.label, entry.detail) == ("number", "int")


def test_an_event_may_have_the_name_of_an_activity(document):
    text = "machine m\nevent rotate(count : int)\nstate a\n    on rotate if rotate.count > 1 -> a\n"
    assert hover(document(text), 3, text.splitlines()[3].index("count")).detail == "int"


def test_hovering_over_a_definition_names_it_so(document):
    text = "machine m\ndefine open = space.left or space.right\nstate a\n    when open -> a\n"
    found = hover(document(text), 3, 10)
    assert (found.kind, found.detail) == (SymbolKind.DEFINITION, "space.left or space.right")


def test_hovering_over_what_an_instance_exposes(talking):
    entry = hover(talking, *at_line(talking, 11, "rings"))
    assert (entry.label, entry.doc) == ("d.rings", "How often it rang.")


@pytest.mark.parametrize(
    ("line", "expected", "absent"),
    [
        ("    on floor if ", {"floor.number", "floor.pace", "at", "d.rings", "d.outcome"}, {"d.other", "stop"}),
        ("    on stop if ", {"at", "d.rings"}, {"floor.number"}),
        ("    on floor / at = ", {"floor.number"}, set()),
        ("    defer ", {"floor", "stop"}, {"at"}),
        ("    entry / send ", {"floor", "stop"}, {"at"}),
        ("    entry / ", {"send", "raise", "cancel", "at"}, set()),
        ("    entry / raise floor(", {"number = ", "pace = "}, set()),
        ("    entry / raise floor(1, pace = ", {"slow", "fast"}, {"at"}),
        ("event lift(up : ", {"bool", "length", "Pace"}, {"at"}),
        ("event lift(", set(), {"at", "floor"}),
    ],
)
def test_completion_of_the_newer_words(talking, line, expected, absent):
    text = f"{TALKING}state b\n{line}\n"
    document = Document(text, talking.file, talking.library)
    number = text.splitlines().index(line) if line.strip() in text else len(text.splitlines()) - 1
    labels = {one.label for one in completions(document, number, len(line))}
    assert expected <= labels
    assert not absent & labels


def test_going_to_what_an_event_carries_and_what_an_instance_exposes(talking):
    found = navigation.definition(talking, *at_line(talking, 7, "number > at"))
    assert (found.line, TALKING.splitlines()[found.line][found.column : found.end_column]) == (3, "number")
    found = navigation.definition(talking, *at_line(talking, 11, "rings"))
    assert (Path(found.file).name, found.line) == ("door.maze-machine", 3)


def test_what_an_event_carries_is_renamed_everywhere(talking):
    found = [one for _, one in references.rename(talking, *at_line(talking, 7, "number > at"), "storey", [])]
    lines = TALKING.splitlines()
    assert {(one.line, lines[one.line][one.column : one.end]) for one in found} == {(3, "number"), (6, "number")}
    assert len(found) == 3


def test_the_newer_words_have_their_colours(talking):
    lines, found = TALKING.splitlines(), MachineFile(talking).colours()
    named = {(one.line + 1, lines[one.line][one.column : one.column + one.length]) for one in found}
    assert {(8, "defer"), (9, "stop"), (7, "number"), (7, "raise"), (11, "rings")} <= named


OUTER = """machine outer

event go

var turns : int = 0

initial calm

state calm
    on go -> busy

state busy
    initial first
    on over -> calm / turns += 1

    # The beginning.
    state first
        do stop()
        after 1 s -> second

    state second
        do stop()
        after 1 s -> over

    final over
"""


def applied(text, edits):
    lines = text.split("\n")
    for one in sorted(edits, key=lambda edit: (edit.line, edit.column), reverse=True):
        before, after = lines[one.line][: one.column], lines[one.end_line][one.end_column :]
        lines[one.line : one.end_line + 1] = f"{before}{one.text}{after}".split("\n")
    return "\n".join(lines)


def errors_of(text, library, file):
    return [one.message for one in check_text(text, library, file).diagnostics if one.severity.name == "ERROR"]


def extractions(text, library, folder):
    document = Document(text, str(folder / "outer.maze-machine"), library)
    line = text.split("\n").index("state busy")
    return [one for one in refactoring.refactorings(document, line) if one.kind == refactoring.EXTRACT]


def test_the_inside_of_a_state_becomes_a_machine(tmp_path):
    library = robot_names()
    (found,) = extractions(OUTER, library, tmp_path)
    ((path, made),) = found.created
    assert path == tmp_path / "busy.maze-machine"
    assert "# The beginning." in made
    path.write_text(made, encoding="utf-8")
    rest = applied(OUTER, found.edits)
    assert "state busy = busy()\n    on over -> calm / turns += 1\n" in rest
    before, after = (check_text(text, library, str(tmp_path / "outer.maze-machine")) for text in (OUTER, rest))
    assert [one.code for one in after.diagnostics] == [one.code for one in before.diagnostics]
    own = [one.name.removeprefix("busy.") for one in after.model.states[1:]]
    assert own == [one.name for one in before.model.states[1:]]
    assert extractions(OUTER, library, tmp_path) == []  # the file is there already


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("after 1 s -> over", "after 1 s -> calm"),
        ("after 1 s -> over", "when turns > 1 -> over"),
        ("after 1 s -> over", "on go -> over"),
        ("on go -> busy", "on go -> second"),
        ("    initial first\n", "    initial first\n    entry / raise go\n"),
    ],
)
def test_what_is_bound_to_its_surroundings_stays(tmp_path, old, new):
    assert extractions(OUTER.replace(old, new), robot_names(), tmp_path) == []


def fixed(text, library, file, title):
    checked = check_text(text, library, file).diagnostics
    (found,) = [one for one in actions.fixes(Document(text, file, library), checked) if one.title == title]
    return found


def test_unknown_names_are_declared(tmp_path):
    library, file = robot_names(), str(tmp_path / "outer.maze-machine")
    wrong = OUTER.replace("on go -> busy", "on go -> bus").replace("after 1 s -> second", "on nudge -> second")
    wrong = wrong.replace("    on over -> calm", "    when tired -> calm\n    on over -> calm")
    for title in ("Declare state `bus`", "Declare `event nudge`", "Declare `var tired : bool = false`"):
        wrong = applied(wrong, fixed(wrong, library, file, title).edits)
    assert errors_of(wrong, library, file) == []


def test_unknown_names_of_the_robot_are_declared_in_python(tmp_path, monkeypatch):
    source = tmp_path / "declared_lamp.py"
    source.write_text(
        "from hsm import Library\n\nLIBRARY: Library = Library('lamp')\n\n\n"
        "@LIBRARY.signal('dark')\ndef dark(facts) -> bool:\n    'It is dark.'\n    return True\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    text = (
        "machine lamp\n\ninitial off\n\nstate off\n    do glow()\n    when dark -> lit / click()\n\n"
        "state lit\n    when not near.wall -> off\n"
    )
    file = str(tmp_path / "lamp.maze-machine")
    for title in ("activity `glow`", "action `click`", "signal `near.wall`"):
        found = fixed(text, imported("declared_lamp"), file, f"Declare {title} in declared_lamp.py")
        assert found.file == str(source)
        source.write_text(applied(source.read_text(), found.edits))
    assert errors_of(text, imported("declared_lamp"), file) == []


def imported(name):
    sys.modules.pop(name, None)
    importlib.invalidate_caches()
    linecache.clearcache()
    return importlib.import_module(name).LIBRARY
