"""What is shipped works where it is installed: a wheel in an environment of its own, far from this checkout."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import venv
import zipfile
from contextlib import closing
from importlib.metadata import distributions
from pathlib import Path

import pytest

from tests.maze_machine.test_command_line import commands
from transport.compiled import PACKAGES as KERNELS

ROOT = Path(__file__).parents[2]
PACKAGES = ("hsm", "skills", "perception", "machines", "transport", "sim", "maze_machine")
TAKEN = ("hsm", "skills", "perception", "machines", "transport", "sim", "controller", "view")
"""Folders that a stranger's project may well have."""

MACHINE = """machine lamp

param patience : time = 2 s

initial off

state off
    do drive(0.3 m/s)
    on blocked         -> on
    after patience     -> on

final on
"""
SCENARIOS = """test lamp

scenario the lamp goes on by itself
    after 2 s
    expect on
"""
EVERY_HELP = """
import json, sys
from typer.testing import CliRunner
from maze_machine.cli import app
print(json.dumps([CliRunner().invoke(app, [*path, "--help"]).exit_code for path in json.loads(sys.argv[1])]))
"""
EVERY_COMMAND = """
import json, sys
from maze_machine.__main__ import main
statuses = []
for line in json.loads(sys.argv[1]):
    sys.argv = ["maze-machine", *line]
    try:
        statuses.append(main() or 0)
    except SystemExit as ended:
        statuses.append(ended.code or 0)
print()
print(json.dumps(statuses))
"""
CHART = """<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0">
<state id="a"><transition event="go" target="b"/></state><final id="b"/>
</scxml>
"""


def run(command, folder, **options):
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=180, check=False, **options)


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """A copy of what is under version control."""
    listed = run(["git", "ls-files", "-z", "--", *PACKAGES, "pyproject.toml", "README.md", "LICENSE"], ROOT)
    if listed.returncode != 0:
        pytest.skip("not a git checkout")
    source = tmp_path_factory.mktemp("source")
    for name in filter(None, listed.stdout.split("\0")):
        if (ROOT / name).is_file():
            copy = source / name
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes((ROOT / name).read_bytes())
    return source


def setuptools_runs(code, source, **environment):
    """Run a line of Python that begins with setuptools' newest version at hand, in the folder of the sources."""
    newest = max(distributions(name="setuptools"), key=lambda one: [int(part) for part in one.version.split(".")[:2]])
    path = f"import sys; sys.path.insert(0, {str(newest.locate_file(''))!r}); "
    done = run([sys.executable, "-c", path + code], source, env={**os.environ, **environment})
    assert done.returncode == 0, done.stderr
    return done.stderr


@pytest.fixture(scope="module")
def wheel(source, tmp_path_factory):
    """The wheel, built without a network."""
    built = tmp_path_factory.mktemp("built")
    setuptools_runs(f"from setuptools import build_meta as build; build.build_wheel({str(built)!r})", source)
    return next(built.glob("*.whl"))


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
def test_the_wheel_has_the_compiled_kernels_for_every_version_of_python(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = [name for name in archive.namelist() if name.endswith(".so")]
    assert {name.partition("/")[0] for name in names} == set(KERNELS)
    assert all(name.endswith("/_kernels.abi3.so") for name in names)
    assert "-cp311-abi3-" in wheel.name


def test_without_a_compiler_the_packages_are_built_all_the_same(source, tmp_path):
    folders = ["--build-lib", str(tmp_path / "built"), "--build-temp", str(tmp_path / "temporary")]
    code = f"from setuptools import setup; setup(script_args={['build_ext', *folders]})"
    said = setuptools_runs(code, source, CC="false")
    assert all(f'building extension "{package}._kernels" failed' in said for package in KERNELS)
    assert not list(tmp_path.rglob("*.so"))


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """The scripts of an environment with the wheel in it, and with the dependencies of the one that runs the tests."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, with_pip=False)
    python = folder / "bin" / "python"
    where = run([python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], folder)
    home = Path(where.stdout.strip())
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(home)
    shared = [one for one in sys.path if Path(one).name in ("site-packages", "dist-packages")]
    (home / "dependencies.pth").write_text("\n".join(shared))
    name, _, function = "maze_machine.__main__:main".partition(":")
    script = folder / "bin" / "maze-machine"
    script.write_text(f"#!{python}\nimport sys\nfrom {name} import {function}\nsys.exit({function}())\n")
    script.chmod(0o755)
    place = run([python, "-c", "import hsm, sim; print(hsm.__file__, sim.__file__)"], folder).stdout
    assert all(one.startswith(str(home)) for one in place.split()), "the wheel is used, not this checkout"
    return folder / "bin"


def test_the_wheel_has_types_and_data_and_says_what_it_runs_on(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        metadata = next(archive.read(name).decode() for name in names if name.endswith("METADATA"))
        entry_points = next(archive.read(name).decode() for name in names if name.endswith("entry_points.txt"))
    assert {f"{package}/py.typed" for package in PACKAGES} <= names
    assert {
        "hsm/dsl/syntax/grammar.lark",
        "machines/pledge.maze-machine",
        "hsm/testing/scenarios/scenario.lark",
    } <= names
    assert {name.partition("/")[0] for name in names if ".dist-info" not in name} == set(PACKAGES)
    assert "maze-machine = maze_machine.__main__:main" in entry_points
    assert "Classifier: Typing :: Typed" in metadata
    assert "Requires-Python: >=3.11" in metadata
    assert "Requires-Dist: transitions<0.10,>=0.9.3" in metadata


def test_every_command_answers_in_an_empty_folder(installed, tmp_path):
    paths = [path for path, _ in commands()]
    done = run([installed / "python", "-c", EVERY_HELP, json.dumps(paths)], tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == [0] * len(paths)
    assert len(paths) > 15


NOBODY = "tcp/127.0.0.1:1"
WORK = {
    "run": ["run lamp.maze-machine --maze corridor --no-picture --record run.mcap --save-map lamp.map", 1],
    "replay": ["replay run.mcap", 0],
    "view": ["view run.mcap --no-sights", 0],
    "plot": ["plot run.mcap", 0],
    "watch": [f"watch --connect {NOBODY}", 4],
    "send": [f"send go --connect {NOBODY}", 4],
    "sweep": ["sweep --machines lamp.maze-machine --mazes mazes --seeds 1 --time-limit 3 --out results.jsonl", 1],
    "sweep show": ["sweep show results.jsonl", 0],
    "profile": ["profile", 0],
    "new": ["new project", 0],
    "check": ["check lamp.maze-machine", 0],
    "fmt": ["fmt lamp.maze-machine", 0],
    "test": ["test lamp.maze-test", 0],
    "simulate": ["simulate lamp.maze-machine", 0],
    "diagram": ["diagram lamp.maze-machine -o lamp.mmd", 0],
    "import": ["import chart.scxml -o chart.maze-machine", 0],
    "export": ["export lamp.maze-machine -o lamp.scxml", 0],
    "list": ["list signals", 0],
    "lsp": ["lsp", 0],
    "dap": ["dap", 0],
    "trust": ["trust --list", 0],
    "maze generate": ["maze generate mazes/drawn.maze --seed 1", 0],
    "maze show": ["maze show mazes/drawn.maze", 0],
    "maze convert": ["maze convert mazes/drawn.maze drawn.png", 0],
    "map show": ["map show lamp.map", 0],
    "sim": [f"sim corridor --connect {NOBODY}", 4],
    "gate": [f"gate {NOBODY}", 4],
    "router": ["router --listen tcp/127.0.0.1:PORT", 130],
    "certificates": ["certificates ca --robot pico1 --controller alice", 0],
}
"""A command line for each subcommand, and its exit status."""
MEETING = ("watch", "send", "sim", "gate")
"""Commands that look for another program: here there is none."""


def test_every_command_works_in_a_folder_of_its_own(installed, tmp_path):
    assert set(WORK) == {" ".join(path) for path, _ in commands()}
    (tmp_path / "lamp.maze-machine").write_text(MACHINE)
    (tmp_path / "lamp.maze-test").write_text(SCENARIOS)
    (tmp_path / "chart.scxml").write_text(CHART)
    (tmp_path / "mazes").mkdir()
    own = {**os.environ, "XDG_DATA_HOME": str(tmp_path / "data"), "XDG_CONFIG_HOME": str(tmp_path / "settings")}

    def begin(line):
        return subprocess.Popen(
            [installed / "maze-machine", *line.split()],
            cwd=tmp_path,
            env=own,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    with closing(socket.create_server(("127.0.0.1", 0))) as free:
        port = free.getsockname()[1]
    router = begin(WORK["router"][0].replace("PORT", str(port)))
    meeting = {name: begin(WORK[name][0]) for name in MEETING}
    alone = [name for name in ("maze generate", *WORK) if name not in (*MEETING, "router")]
    lines = [WORK[name][0].split() for name in alone]
    done = run(
        [installed / "python", "-c", EVERY_COMMAND, json.dumps(lines)], tmp_path, env=own, stdin=subprocess.DEVNULL
    )
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    statuses = json.loads(done.stdout.splitlines()[-1])
    assert dict(zip(alone, statuses, strict=True)) == {name: WORK[name][1] for name in alone}, done.stdout + done.stderr
    for name, process in meeting.items():
        _, said = process.communicate(timeout=60)
        assert (process.returncode, said.count("\n")) == (WORK[name][1], 1), said
    assert "listens" in router.stdout.readline()
    router.send_signal(signal.SIGINT)
    said = router.communicate(timeout=60)[1]
    assert (router.returncode, said) == (WORK["router"][1], "maze-machine: interrupted\n")


@pytest.fixture
def foreign(tmp_path):
    """Somebody's project with packages of the same names, and with tests of its own."""
    for name in TAKEN:
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(f"NAME = {name!r}\n")
    imports = "".join(f"import {name}\n" for name in TAKEN)
    test = f"import sys\n{imports}\n\ndef test_own():\n    assert [{', '.join(f'{name}.NAME' for name in TAKEN)}]\n"
    ours = (
        "    assert [one for one in sys.modules if one.startswith('maze_machine.')] == ['maze_machine.pytest_plugin']\n"
    )
    (tmp_path / "test_own.py").write_text(test + ours)
    return tmp_path


def test_a_foreign_project_is_tested_as_if_this_one_were_not_installed(foreign, installed):
    done = run([installed / "python", "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist"], foreign)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_package_that_hides_one_of_ours_is_named_at_every_entry_point(foreign, installed):
    (foreign / "lamp.maze-machine").write_text(MACHINE)
    (foreign / "lamp.maze-test").write_text(SCENARIOS)
    (foreign / "own_library.py").write_text("from hsm import Library\n\nlibrary = Library('own')\n")
    python, script = installed / "python", installed / "maze-machine"
    tests = run([python, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "lamp.maze-test"], foreign)
    module = run([python, "-m", "maze_machine", "check", "pledge"], foreign)
    named = run([script, "check", "lamp.maze-machine", "--library", "own_library:library"], foreign)
    on_path = run([script, "--help"], foreign, env={"PYTHONPATH": str(foreign)})
    # With a library of one's own, all but the simulator is imported before its folder comes onto the path.
    for done, told, name in (
        (tests, tests.stdout, "hsm"),
        (module, module.stderr, "hsm"),
        (named, named.stderr, "sim"),
        (on_path, on_path.stderr, "hsm"),
    ):
        assert done.returncode == 2, told
        assert f"{foreign / name} hides the package `{name}`" in told
        assert "or run where" in told
        assert "Traceback" not in told


@pytest.mark.parametrize(("module", "name"), [("catalogue", "hsm"), ("drive", "hsm"), ("simulated", "sim")])
def test_a_python_program_is_told_what_is_hidden(module, name, foreign, installed):
    done = run([installed / "python", "-c", f"import maze_machine.{module}"], foreign)
    assert done.returncode == 1
    last = done.stderr.strip().splitlines()[-1]
    assert "HiddenPackageError" in last
    assert f"{foreign / name} hides the package `{name}`" in last


def test_a_folder_without_an_init_hides_nothing(installed, tmp_path):
    for name in PACKAGES:
        (tmp_path / name).mkdir()
    done = run([installed / "python", "-m", "maze_machine", "--version"], tmp_path)
    assert done.returncode == 0, done.stderr
