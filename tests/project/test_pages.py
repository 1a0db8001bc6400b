"""The files on a page are written, its commands run in order, and their output compared with what the page shows.

In the expected output ``...`` stands for anything. A command that ends with ``&`` stays in the background.
"""

import doctest
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from maze_machine.catalogue.machines import SHIPPED

ROOT = Path(__file__).parents[2]
PAGES = (
    "../README.md",
    "tutorial.md",
    "how-to/campaigns.md",
    "how-to/ci.md",
    "how-to/from-behavior-trees.md",
    "how-to/from-scxml.md",
    "how-to/from-transitions.md",
    "how-to/proving.md",
    "how-to/python.md",
    "how-to/replay.md",
    "explanation/loop.md",
    "explanation/messages.md",
    "explanation/skills.md",
    "how-to/maps-and-recordings.md",
    "how-to/own-robot.md",
)
BLOCK = re.compile(r"^```(\S+)(?: title=\"(\S+)\")?\n(.*?)^```$", re.DOTALL | re.MULTILINE)
LIMIT = 120


@pytest.mark.parametrize("page", PAGES)
def test_a_page_does_what_it_says(page, tmp_path):
    bin_folder = Path(sys.executable).parent
    environment = {
        **os.environ,
        "PATH": f"{bin_folder}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "MACHINES": str(SHIPPED),
        "COLUMNS": "120",
        "XDG_CONFIG_HOME": str(tmp_path / "configuration"),
    }
    background = []
    try:
        for language, name, text in BLOCK.findall((ROOT / "docs" / page).read_text(encoding="utf-8")):
            if name:
                (tmp_path / name).write_text(text, encoding="utf-8")
            if language != "console":
                continue
            for example in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
                command, _, expected = example.partition("\n")
                process = subprocess.Popen(
                    command.removesuffix(" &"),
                    shell=True,
                    cwd=tmp_path,
                    env=environment,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.STDOUT,
                    text=True,
                )
                if command.endswith(" &"):
                    background.append(process)
                    shown = process.stdout.readline()
                else:
                    shown = process.communicate(timeout=LIMIT)[0]
                assert alike(expected, shown), f"$ {command}\n--- shows\n{shown}\n--- expected\n{expected}"
        for process in background:
            assert process.wait(LIMIT) == 0
    finally:
        for process in background:
            process.kill()
            process.communicate()


def test_the_python_of_the_readme_runs(tmp_path):
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    ((name, machine),) = re.findall(r"^```maze-machine title=\"(\S+)\"\n(.*?)^```$", readme, re.DOTALL | re.MULTILINE)
    (tmp_path / name).write_text(machine, encoding="utf-8")
    (program,) = re.findall(r"^```python\n(.*?)^```$", readme, re.DOTALL | re.MULTILINE)
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=True,
    )
    assert done.stdout == "['driving']\n('driving',) -> ('turning',)\n"


def test_the_files_of_the_own_robot_are_an_example():
    page = (ROOT / "docs" / "how-to" / "own-robot.md").read_text(encoding="utf-8")
    shown = {name: text for _, name, text in BLOCK.findall(page) if name}
    folder = ROOT / "examples" / "dock_robot"
    assert shown == {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir() if path.is_file()}
    assert len(shown["drive.py"].splitlines()) <= 20


def alike(expected, shown):
    shown = re.sub(r"^ ?[─ ]+$", "", shown, flags=re.MULTILINE)  # the rules of a table
    return doctest.OutputChecker().check_output(
        expected.strip(), shown.strip(), doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
    )


def test_the_readme_shows_how_to_change_a_machine(tmp_path):
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (lines,) = re.findall(r"^## Change it\n\n```sh\n(.*?)^```$", readme, re.DOTALL | re.MULTILINE)
    script = lines.replace(".venv/bin", str(Path(sys.executable).parent)).replace("machines/", f"{SHIPPED}/")
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", script],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "my in final of 2015, seed 0: out of the maze" in done.stdout
    shipped, mine = (SHIPPED / "pledge.maze-machine").read_text(), (tmp_path / "my.maze-machine").read_text()
    changed = {" ".join(line.split()) for line in set(mine.splitlines()) - set(shipped.splitlines())}
    assert changed == {"machine my", "param cruise : speed = 0.3 m/s"}
