"""Projects: their settings, the library of one's own in every command, and whose code may run."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from maze_machine.catalogue.library import chosen_library, robot_names
from maze_machine.catalogue.machines import find_machine, shipped_machines
from maze_machine.catalogue.project import default_robot, find_project
from maze_machine.catalogue.trust import is_trusted, require_trust, trust_file, trusted_folders
from maze_machine.cli import app
from maze_machine.errors import FileError, UsageError
from transport.recording import read_recording


@pytest.fixture(autouse=True)
def _own_configuration(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "configuration"))


@pytest.fixture
def restored_modules(monkeypatch):
    """What a test imports from its folder is forgotten."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    before = set(sys.modules)
    yield
    for name in set(sys.modules) - before:
        if name.endswith("_robot") or name == "stranger":
            del sys.modules[name]


def run(*arguments):
    done = CliRunner().invoke(app, list(map(str, arguments)))
    return done.exit_code, done.stdout, done.stderr


@pytest.fixture
def vacuum(tmp_path, restored_modules):
    assert run("new", "vacuum", "--folder", tmp_path / "vacuum")[0] == 0
    return tmp_path / "vacuum"


def test_a_new_project_passes_its_checks_and_tests(vacuum):
    machine = vacuum / "vacuum.maze-machine"
    status, told, _ = run("check", machine, "--json")
    assert (status, json.loads(told)["findings"]) == (0, [])
    status, told, _ = run("test", machine, "--coverage", "--fail-under", 90)
    assert status == 0, told
    assert run("fmt", "--check", machine)[0] == 0


def test_every_command_takes_the_library_of_the_project(vacuum, tmp_path, monkeypatch):
    machine = vacuum / "vacuum.maze-machine"
    assert run("export", machine, "-o", tmp_path / "vacuum.scxml")[0] == 0
    assert run("diagram", machine, "-o", tmp_path / "vacuum.mmd")[0] == 0
    monkeypatch.chdir(vacuum)
    assert "go_to_dock()" in run("list", "activities")[1]
    assert run("check", "vacuum")[0] == 0  # by its name
    (vacuum / "maze-machine.toml").unlink()
    assert run("check", machine)[0] == 1
    assert run("check", machine, "--library", "vacuum_robot:library")[0] == 0


def test_a_machine_of_the_project_comes_before_the_shipped_one_of_its_name(vacuum, monkeypatch):
    text = (vacuum / "vacuum.maze-machine").read_text()
    (vacuum / "pledge.maze-machine").write_text(text.replace("machine vacuum", "machine pledge", 1))
    monkeypatch.chdir(vacuum)
    assert find_machine("pledge") == vacuum / "pledge.maze-machine"
    assert find_machine("tremaux") == shipped_machines()["tremaux"]
    run("diagram", "pledge", "-o", "pledge.mmd")
    assert "dock" in Path("pledge.mmd").read_text()


def test_a_recording_names_the_machine_that_ran(courier, monkeypatch):
    (courier / "pledge.maze-machine").write_text(shipped_machines()["pledge"].read_text().replace("0.5 m/s", "0.2 m/s"))
    run("run", "pledge", "--maze", "corridor", "--time-limit", 1, "--no-picture", "--record", "own.mcap")
    assert Path(read_recording(Path("own.mcap")).run["machine"]) == courier / "pledge.maze-machine"
    assert run("replay", "own.mcap")[0] == 0
    monkeypatch.chdir(courier.parent)
    run("run", "pledge", "--maze", "corridor", "--time-limit", 1, "--no-picture", "--record", "shipped.mcap")
    assert read_recording(Path("shipped.mcap")).run["machine"] == "pledge"
    monkeypatch.chdir(courier)
    assert run("replay", "../shipped.mcap")[0] == 0, "the shipped one, not the project's"


def test_the_loop_of_a_new_project_drives(vacuum):
    done = subprocess.run(
        [sys.executable, "drive.py"], cwd=vacuum, capture_output=True, text=True, timeout=60, check=True
    )
    assert "charging" in done.stdout


@pytest.fixture
def courier(tmp_path, restored_modules, monkeypatch):
    """A project for a robot that the shipped skills drive; it is the present folder."""
    assert run("new", "courier", "--robot", "--folder", tmp_path / "courier")[0] == 0
    monkeypatch.chdir(tmp_path / "courier")
    return tmp_path / "courier"


def test_a_new_project_of_a_robot_passes_its_checks_and_tests(courier):
    assert json.loads(run("check", "--json")[1])["findings"] == []
    status, told, _ = run("test", "courier.maze-machine", "--coverage", "--fail-under", 90, "--require", "proved")
    assert status == 0, told
    assert run("fmt", "--check", ".")[0] == 0


def test_the_robot_of_a_new_project_drives_and_its_run_is_repeated(courier):
    status, told, error = run("run", "courier", "--json", "--no-picture", "--record", "run.mcap")
    assert (status, json.loads(told)["verdict"]["maze"]) == (0, "room"), error
    assert json.loads(read_recording(Path("run.mcap")).run["profile"])["robot"]["name"] == "courier"
    assert "no difference" in run("replay", "run.mcap")[1]
    assert run("view", "run.mcap", "--no-sights")[0] == 0
    assert '"undrawn":""' in Path("run.html").read_text(encoding="utf-8")


def test_runs_take_a_library_on_the_command_line(courier):
    (courier / "maze-machine.toml").write_text('robot = "robot.toml"\nmaze = "room.maze"\n', encoding="utf-8")
    given = ("courier.maze-machine", "--library", "courier_robot:library")
    driven = ("--no-picture", "--time-limit", 1, "--record", "run.mcap")
    assert "narrow" in run("run", given[0], *driven)[2]
    assert json.loads(run("run", *given, *driven, "--json")[1])["ticks"] > 1
    status, _, told = run("replay", "run.mcap")
    assert (status, "there is no signal or function `narrow`" in told) == (3, True), told
    assert "no difference" in run("replay", "run.mcap", *given[1:])[1]
    assert run("view", "run.mcap", "--no-sights", *given[1:])[0] == 0
    assert '"undrawn":""' in Path("run.html").read_text(encoding="utf-8")
    status, _, told = run("view", "run.mcap", "--library", "no_such:library")
    assert (status, "there is no module `no_such`" in told) == (2, True)
    campaign = ("--machines", given[0], "--mazes", "room.maze", "--time-limit", 1, "--out", "results.jsonl", "--json")
    assert run("sweep", *campaign)[0] == 3
    (only,) = json.loads(run("sweep", *campaign, *given[1:])[1])["machines"]
    assert (only["machine"], only["runs"]) == (given[0], 1)


def test_a_library_that_adds_to_the_shipped_one_has_the_projects_robot(courier):
    assert run("list", "signals")[1].count("narrow(") == 1
    shown = json.loads(run("list", "constants", "--json")[1])
    (radius,) = (one for one in shown if one["name"] == "robot.radius")
    assert radius["value"].startswith("0.212"), "half the diagonal of 0.3 m"


def test_pytest_takes_the_library_of_the_project(vacuum):
    # No setting names the library, and nobody is asked for trust: pytest runs the Python code of its folder anyway.
    run("trust", "--remove", vacuum)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "vacuum.maze-test"],
        cwd=vacuum,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    assert "6 passed" in done.stdout


def test_nothing_is_overwritten(vacuum):
    (vacuum / "drive.py").write_text("mine", encoding="utf-8")
    status, _, told = run("new", "vacuum", "--folder", vacuum)
    assert status == 3
    assert "exists already" in told
    assert (vacuum / "drive.py").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("name", ["Vacuum", "9", "a-b", "../x", "", "and", "door"])
def test_a_name_that_no_machine_can_have_is_refused(name, tmp_path):
    assert run("new", name, "--folder", tmp_path / "there")[0] == 2
    assert not (tmp_path / "there").exists()


@pytest.fixture
def stranger(tmp_path, restored_modules):
    """A folder of somebody else's: its library leaves a mark when it is run."""
    folder = tmp_path / "downloaded"
    folder.mkdir()
    (folder / "maze-machine.toml").write_text('library = "stranger:library"\n', encoding="utf-8")
    (folder / "stranger.py").write_text(
        "from pathlib import Path\nfrom hsm import Library\nPath(__file__).with_name('ran').touch()\n"
        "def library(): return Library('stranger')\n",
        encoding="utf-8",
    )
    (folder / "m.maze-machine").write_text("machine m\n\ninitial a\n\nfinal a\n", encoding="utf-8")
    return folder


@pytest.mark.parametrize(
    "command", [["check"], ["test"], ["diagram", "-o", "m.mmd"], ["export"], ["run"], ["simulate"]]
)
def test_code_of_an_untrusted_folder_never_runs(stranger, command):
    name, *rest = command
    status, _, told = run(name, stranger / "m.maze-machine", *rest)
    assert status == 2
    assert "is not trusted; read the code, then run `maze-machine trust" in told
    assert not (stranger / "ran").exists()


def test_a_trusted_folder_runs_its_code_until_trust_is_taken_back(stranger):
    assert run("trust", stranger)[0] == 0
    assert json.loads(run("trust", "--list", "--json")[1]) == [str(stranger)]
    assert run("check", stranger / "m.maze-machine")[0] == 0
    assert (stranger / "ran").exists()
    assert run("trust", "--remove", stranger)[0] == 0
    assert run("check", stranger / "m.maze-machine")[0] == 2


def test_trust_of_a_folder_is_none_of_the_folders_in_it(stranger):
    inner = stranger / "inner"
    inner.mkdir()
    (inner / "maze-machine.toml").write_text('library = "other:library"\n', encoding="utf-8")
    assert run("trust", stranger)[0] == 0
    project = find_project(inner)
    assert project is not None
    assert not is_trusted(project)


def test_an_editor_vouches_for_its_workspace(stranger, monkeypatch):
    for folders in ("", ".", str(stranger / "inner"), f"{stranger}_not"):
        monkeypatch.setenv("MAZE_MACHINE_TRUSTED", folders)
        assert run("check", stranger / "m.maze-machine")[0] == 2
    assert not (stranger / "ran").exists()
    monkeypatch.setenv("MAZE_MACHINE_TRUSTED", os.pathsep.join(["/elsewhere", str(stranger.parent)]))
    assert run("check", stranger / "m.maze-machine")[0] == 0
    assert trusted_folders() == set()


def test_a_person_who_is_asked_may_say_yes_or_no(stranger):
    project = find_project(stranger)
    assert project is not None
    asked = []
    with pytest.raises(UsageError, match="not trusted"):
        require_trust(project, lambda question: bool(asked.append(question)))
    assert "stranger:library" in asked[0]
    require_trust(project, lambda _question: True)
    assert trusted_folders() == {stranger}


def test_a_shipped_machine_belongs_to_no_project(stranger, monkeypatch):
    monkeypatch.chdir(stranger)
    assert run("check", "pledge")[0] == 0
    assert not (stranger / "ran").exists()


def test_settings_may_lie_in_pyproject(tmp_path):
    (tmp_path / "pyproject.toml").write_text(
        '[tool.maze-machine]\nmachines = ["charts"]\nignore = ["N"]\n', encoding="utf-8"
    )
    inner = tmp_path / "a" / "b"
    inner.mkdir(parents=True)
    project = find_project(inner)
    assert project is not None
    assert (project.folder, project.machines, project.ignore) == (tmp_path, (tmp_path / "charts",), ("N",))


def test_a_machine_of_the_projects_folders_is_imported_by_name(tmp_path):
    (tmp_path / "maze-machine.toml").write_text('machines = ["parts"]\n', encoding="utf-8")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "pause.maze-machine").write_text(
        "machine pause\n\ninitial wait\n\nstate wait\n    after 1 s -> over\n\nfinal over\n", encoding="utf-8"
    )
    whole = tmp_path / "whole.maze-machine"
    whole.write_text(
        "machine whole\n\nimport pause\n\ninitial p\n\nstate p = pause()\n    on over -> end\n\nfinal end\n",
        encoding="utf-8",
    )
    status, told, _ = run("check", whole)
    assert status == 0, told


@pytest.fixture
def two_machines(tmp_path, monkeypatch):
    """A project whose machines lie in a folder and one below it; another one lies in an environment."""
    text = "machine m\n\ninitial over\n\nfinal over\n"
    for place in ("charts/a", "charts/rooms/b", "charts/venv/lib/c", "charts/.hidden/d", "loose"):
        file = tmp_path / f"{place}.maze-machine"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    (tmp_path / "charts" / "venv" / "pyvenv.cfg").touch()
    (tmp_path / "maze-machine.toml").write_text('machines = ["charts"]\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("named", "count"), [([], 2), (["charts"], 2), (["charts/rooms", "loose.maze-machine"], 2), (["."], 3)]
)
def test_a_folder_stands_for_its_machines_and_no_name_for_the_project(two_machines, named, count):
    assert f"{count} files checked" in run("check", *named)[1]
    assert run("fmt", "--check", *named) == (0, "", "")
    (two_machines / "charts" / "rooms" / "b.maze-machine").write_text("machine m\ninitial  over\nfinal over\n")
    status, printed, _ = run("fmt", "--check", *named)
    assert (status, printed) == (1, f"{Path('charts', 'rooms', 'b.maze-machine')}: would be formatted\n")


@pytest.mark.parametrize("command", ["check", "fmt"])
def test_a_folder_without_machines_is_named(tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    status, _, message = run(command, ".")
    assert (status, ". has no `.maze-machine` file" in message) == (3, True)
    status, _, message = run(command)
    assert (status, "no file is named, and this folder has no project" in message) == (2, True)


def test_codes_that_a_project_ignores_are_left_out(tmp_path):
    machine = tmp_path / "m.maze-machine"
    machine.write_text("machine m\n\nparam p : int = 1\n\ninitial a\n\nfinal a\n", encoding="utf-8")
    found = json.loads(run("check", machine, "--json")[1])["findings"]
    assert found
    codes = json.dumps(sorted({one["code"] for one in found}))
    (tmp_path / "maze-machine.toml").write_text(f"ignore = {codes}\n", encoding="utf-8")
    assert json.loads(run("check", machine, "--json")[1])["findings"] == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('libary = "a:b"', "unknown setting `libary`"),
        ("library = 3", "`library` is a string, not 3"),
        ('machines = "x"', "`machines` is a list of strings"),
        ("machines = [1]", "`machines` is a list of strings"),
        ("library = ", "is not valid TOML"),
        ("a = " + "[" * 5000, "is not valid TOML"),
    ],
)
def test_wrong_settings_end_with_one_message(tmp_path, text, message):
    (tmp_path / "maze-machine.toml").write_text(text, encoding="utf-8")
    with pytest.raises(FileError, match=message):
        find_project(tmp_path)


@pytest.mark.parametrize("text", ["{", '{"a": 1}', "[1]", "\0"])
def test_a_damaged_memory_of_trust_trusts_nobody(stranger, text):
    trust_file().parent.mkdir(parents=True)
    trust_file().write_text(text, encoding="utf-8")
    status, _, told = run("check", stranger / "m.maze-machine")
    assert status == 3
    assert "is damaged" in told
    assert not (stranger / "ran").exists()


@pytest.mark.parametrize("fault", ["1 / 0", "import no_such_module_of_theirs", "def library(:"])
def test_a_library_that_fails_is_reported_with_its_place(stranger, fault):
    (stranger / "stranger.py").write_text(fault + "\n", encoding="utf-8")
    run("trust", stranger)
    status, _, told = run("check", stranger / "m.maze-machine")
    assert status == 2
    assert "cannot be imported" in told
    assert "stranger.py" in told


@pytest.fixture
def own_robot(tmp_path):
    """A project with a smaller robot and a maze of its own, and a machine that goes by the robot's size."""
    folder = tmp_path / "own"
    folder.mkdir()
    (folder / "maze-machine.toml").write_text('robot = "small.toml"\nmaze = "corridor"\n', encoding="utf-8")
    (folder / "small.toml").write_text(
        '[robot]\nname = "small"\nfootprint = [[0.08, -0.08], [0.08, 0.08], [-0.08, 0.08], [-0.08, -0.08]]\n',
        encoding="utf-8",
    )
    (folder / "wide.maze-machine").write_text(
        "machine wide\n\ninitial go\n\nstate go\n    do drive(speed = 0.1 m/s)\n"
        "    when distance.front < 1 m if robot.radius < 0.12 m -> over\n    on blocked -> over\n\nfinal over\n",
        encoding="utf-8",
    )
    return folder


def test_the_robot_and_the_maze_of_the_project_are_the_defaults(own_robot, tmp_path, monkeypatch):
    _, told, error = run(
        "run",
        own_robot / "wide.maze-machine",
        "--json",
        "--no-picture",
        "--time-limit",
        1,
        "--record",
        tmp_path / "r.mcap",
    )
    assert json.loads(told)["verdict"]["maze"] == "corridor", error
    recorded = read_recording(tmp_path / "r.mcap").run["profile"]
    assert json.loads(recorded)["robot"]["name"] == "small"
    monkeypatch.chdir(own_robot)
    assert default_robot() == str(own_robot / "small.toml")
    assert default_robot("pico") == "pico"
    assert default_robot(near=str(tmp_path / "nowhere.maze-machine")) == str(own_robot / "small.toml")


def test_the_profile_of_the_project_is_the_one_to_print(own_robot, monkeypatch):
    monkeypatch.chdir(own_robot)
    assert 'name = "small"' in run("profile")[1]
    assert 'name = "pico"' in run("profile", "pico")[1]


def test_constants_are_those_of_the_projects_robot(own_robot):
    constants = chosen_library(None, own_robot / "wide.maze-machine").constants
    assert constants["robot.radius"].value == pytest.approx(0.08 * 2**0.5)
    assert constants["robot.speed"].value == robot_names().constants["robot.speed"].value
