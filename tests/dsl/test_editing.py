"""What an editor is told: completion, hovering, definitions, outline; and all of it over the protocol once."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from hsm.dsl.lsp.editing import Document, SymbolKind

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
        return {one.label: one for one in document("\n".join(lines)).completions(len(lines) - 1, len(line))}

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
    assert set(complete("    on done -> turning.")) == set(found)


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
        ("    on done -> left / ", {"beep", "door.remember", "turns", "raise"}, {"drive"}),
        ("    on done -> left / turns = 1, ", {"beep", "turns"}, {"drive"}),
        ("    after 5 ", {"s", "ms", "min"}, {"drive"}),
        ("param near : ", {"length", "bool", "Side"}, {"drive"}),
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
    found = document().hover(*at("drive("))
    assert (found.kind, found.doc) == (SymbolKind.ACTIVITY, "Drive straight on.")
    assert found.detail == "drive(speed : speed = 0.5 m/s) -> blocked; holds base"
    assert document().hover(*at("space.front")).detail == "space.front : bool"
    assert document().hover(*at("cruise", 1)).detail == "speed"
    assert document().hover(*at("straight.")) is None
    assert document().hover(999, 0) is None


def test_definitions(document):
    assert document().definition(*at("cruise", 1)).line == 6
    assert document().definition(*at("turning")).line == 14
    assert document().definition(*at("turning.history")).line == 14
    assert document().definition(*at("door", 3)).file == str(MACHINES / "door.maze-machine")
    assert document().definition(*at("rotate")) is None


def test_the_outline(document):
    found = document().symbols()
    assert [one.name for one in found] == ["straight", "turning", "open_door", "over"]
    assert [one.name for one in found[1].children] == ["left"]


def test_a_deep_outline(document):
    assert document("machine m\n" + "".join(" " * depth + f"state s{depth}\n" for depth in range(1200))).symbols()


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
    assert "    on done -> b\n" in by_id[6][0]["newText"]


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
