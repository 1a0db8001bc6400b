"""Each example is short, says what it shows, and does what its lines ``$ COMMAND`` and ``> PART OF THE OUTPUT`` say.

A command that ends with ``&`` stays in the background until the example is over.
"""

import os
import re
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted(path for path in (ROOT / "examples").rglob("*") if path.is_file() and path.suffix != ".pyc")
NUMBERED = [path for path in EXAMPLES if path.parent.name[:2].isdigit()]
SHOWN = re.compile(r"^[# ]*([$>]) (.*)$", re.MULTILINE)
LIMIT = 120


@pytest.mark.parametrize("example", NUMBERED, ids=lambda path: path.name)
def test_an_example_does_what_it_says(example, tmp_path):
    shutil.copytree(ROOT / "examples", tmp_path, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        **{name: str(free_port()) for name in ("PORT", "LEADER_PORT", "FOLLOWER_PORT")},
    }
    background, shown = [], ""
    try:
        folder = tmp_path / example.parent.name
        for kind, text in SHOWN.findall(head_of(example)):
            if kind == ">":
                assert text in shown, shown
            elif text.endswith(" &"):
                background.append(started(text.removesuffix(" &"), folder, environment))
                background[-1].stdout.readline()
            else:
                process = started(text, folder, environment)
                shown = process.communicate(timeout=LIMIT)[0]
                assert process.returncode == 0, shown
    finally:
        for process in background:
            process.kill()
            process.communicate()


@pytest.mark.parametrize("example", NUMBERED, ids=lambda path: path.name)
def test_an_example_is_short_and_says_what_it_shows(example):
    text = example.read_text(encoding="utf-8")
    assert len(text.splitlines()) < 60
    if example.suffix != ".maze-test":
        assert "Shows " in head_of(example)
        assert any(kind == "$" for kind, _ in SHOWN.findall(head_of(example)))


def test_an_example_is_short_with_all_its_files():
    lines = {
        folder.name: sum(
            len(path.read_text(encoding="utf-8").splitlines()) for path in NUMBERED if path.parent == folder
        )
        for folder in {path.parent for path in NUMBERED}
    }
    assert {name: count for name, count in lines.items() if count >= 60} == {}


def test_the_examples_count_from_01_to_16():
    assert sorted({path.parent.name[:2] for path in NUMBERED}) == [f"{k:02}" for k in range(1, 17)]


def head_of(example):
    """The lines before the machine, the program or the chart begins."""
    return re.split(
        r'^(?:machine |"""$|-->$|\[|set -|import )', example.read_text(encoding="utf-8"), flags=re.MULTILINE
    )[0]


def started(command, folder, environment):
    return subprocess.Popen(
        command, shell=True, cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
