"""The documentation builds as a site without a warning, by both programs that read ``mkdocs.yml``."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def build(program, *options):
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1", "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-m", program, "build", *options],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    if importlib.util.find_spec("mkdocstrings_handlers") is None:
        pytest.skip("mkdocs-material and mkdocstrings-python are not installed")
    folder = tmp_path_factory.mktemp("site")
    done = build("mkdocs", "--strict", "--site-dir", str(folder))
    assert (done.returncode, "WARNING" in done.stderr) == (0, False), done.stdout + done.stderr
    return folder


def test_the_pages_have_coloured_machines_and_the_python_interface(site):
    tutorial = (site / "tutorial.html").read_text(encoding="utf-8")
    assert re.search(r'<span class="k\w*">machine</span>', tutorial)
    python = (site / "reference" / "python.html").read_text(encoding="utf-8")
    assert 'id="hsm.Machine.start"' in python


def test_nothing_is_loaded_from_elsewhere(site):
    loaded = re.compile(r'<(?:script|link|img)\b[^>]*\b(?:src|href)="(?:https?:)?//[^"]*"')
    pages = {path: loaded.findall(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")}
    assert {path.name: found for path, found in pages.items() if found} == {}
    assert (site / "search" / "search_index.js").is_file()


def test_zensical_reads_the_same_file():
    """It writes into the folder that the file names: it takes no other."""
    if importlib.util.find_spec("zensical") is None:
        pytest.skip("zensical is not installed")
    done = build("zensical", "-f", "mkdocs.yml", "--clean")
    assert (done.returncode, "issue" in done.stdout) == (0, False), done.stdout + done.stderr
    assert 'id="hsm.Machine.start"' in (ROOT / "build" / "site" / "reference" / "python.html").read_text(
        encoding="utf-8"
    )
