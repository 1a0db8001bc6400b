from pathlib import Path

import pytest

from hsm.dsl import check_file, load_model, parse_model
from hsm.model.chart import StateKind
from hsm.model.diagnostics import MachineError
from hsm.model.registry import Library

MACHINES = Path(__file__).parent / "machines"


def test_the_pledge_machine_is_read_with_its_door(library):
    model = load_model(MACHINES / "pledge.maze-machine", library)
    assert [state.name for state in model.states] == [
        "pledge",
        "start",
        "maze",
        "straight_pref",
        "straight",
        "turn_left",
        "turn_right",
        "turn_180",
        "maze.history",
        "open_door",
        "open_door.ringing",
        "open_door.waiting",
        "open_door.opened",
        "open_door.stayed_shut",
        "finished",
    ]
    assert model.states[8].kind is StateKind.SHALLOW_HISTORY
    assert [variable.name for variable in model.variables] == ["turns", "open_door.timeout", "open_door.rings"]
    assert [(one.name, one.default) for one in model.parameters] == [("cruise", 0.5), ("patience", 5.0)]


def test_an_import_is_looked_for_beside_the_file_and_then_in_the_librarys_folders(library, tmp_path):
    shipped, mine = tmp_path / "shipped", tmp_path / "mine"
    for folder, final in ((shipped, "shut"), (mine, "ajar")):
        folder.mkdir()
        (folder / "door.maze-machine").write_text(f"machine door\ninitial {final}\nfinal {final}\n")
    importer = mine / "m.maze-machine"
    importer.write_text("machine m\nimport door\ninitial a\nstate a = door()\n    on done -> over\nfinal over\n")
    library.folders.append(shipped)
    assert "a.ajar" in {state.name for state in load_model(importer, library).states}
    (mine / "door.maze-machine").unlink()
    assert "a.shut" in {state.name for state in load_model(importer, library).states}
    library.folders.clear()
    with pytest.raises(MachineError, match="E0208"):
        load_model(importer, library)


def test_all_faults_are_told_at_once(library):
    text = "machine m\nstate a\n    on done ->\n    do rotat(5 deg)\nstate b\n    when nonsense -> c\n    on x -> a\n"
    with pytest.raises(MachineError) as caught:
        parse_model(text, library)
    assert [(one.code, one.place.line) for one in caught.value.diagnostics] == [
        ("E0101", 3),
        ("E0204", 4),
        ("E0202", 6),
        ("E0201", 6),
        ("E0203", 7),
    ]


@pytest.mark.parametrize(
    ("name", "content", "kind", "advice"),
    [
        (
            "x.scxml",
            b'<?xml version="1.0"?>\n<scxml version="1.0"><state id="a"/></scxml>',
            "SCXML",
            "maze-machine import",
        ),
        ("x.txt", b"\xef\xbb\xbf\n<scxml/>", "SCXML", "maze-machine import"),
        ("x.xml", b'<root BTCPP_format="4"><BehaviorTree ID="m"/></root>', "BehaviorTree.CPP", "maze-machine new"),
        ("x.xml", b"<note/>", "XML", "SCXML"),
        ("x.json", b'{"id": "m", "states": {"a": {}}}', "XState", "SCXML"),
        ("x.json", b'[{"a": 1}]', "JSON", ".maze-machine"),
        ("x.py", b"from transitions import Machine\n", "Python", "maze-machine new"),
        ("x.mcap", b"\x89MCAP0\r\n", "MCAP", "replay"),
        ("x.db3", b"SQLite format 3\x00", "SQLite", "replay"),
        ("x.png", b"\x89PNG\r\n\x1a\n\x00", "PNG", "--maze"),
    ],
)
def test_another_kind_of_file_is_named_once(name, content, kind, advice, tmp_path):
    path = tmp_path / name
    path.write_bytes(content)
    (found,) = check_file(path, Library("none")).diagnostics
    assert found.code == "E0107"
    assert kind in found.message
    assert advice in found.suggestion


@pytest.mark.parametrize("text", ["{ state a", "machine m {\n}", "states = ['a']"])
def test_a_text_that_may_be_a_machine_is_read_as_one(text, tmp_path, library):
    path = tmp_path / "m.maze-machine"
    path.write_text(text)
    assert all(one.code != "E0107" for one in check_file(path, library).diagnostics)
