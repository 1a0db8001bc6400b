"""Visual Studio Code with the extension: what the driver finds from within, and what a person sees."""

from __future__ import annotations

import os
import re
import shutil
import socket
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.editors.code_server import EXTENSION, packed, workbench
from tests.editors.test_requests import OWN

TRUSTED = {"security.workspace.trust.enabled": False}
STEPS = (
    "server,diagnostics,completion,scenarios,settings,indentation,diagram,changes,live,tests,coverage,continuous,debug,"
    "machines,crashes"
)
PROGRAM = Path(sys.executable).parent / "maze-machine"
PICTURES = os.environ.get("MAZE_MACHINE_PICTURES")
"""A folder that keeps the pictures of what is seen."""


@pytest.fixture(autouse=True)
def extension():
    packed()


@pytest.fixture
def sample(tmp_path):
    folder = tmp_path / "sample"
    shutil.copytree(EXTENSION / "sample", folder)
    (folder / ".venv").symlink_to(PROGRAM.parents[1])
    return folder


@contextmanager
def live_run(machine: Path):
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{one.getsockname()[1]}"
    command = [PROGRAM, "run", machine, "--maze", "corridor", "--speed", "0.2", "--open", endpoint]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            yield endpoint
        finally:
            process.kill()


def test_the_extension_does_what_it_says(tmp_path, sample):
    with live_run(EXTENSION / "sample" / "patrol.maze-machine") as endpoint:
        environment = {"MAZE_MACHINE_LIVE": endpoint}
        with workbench(tmp_path / "editor", sample, STEPS, settings=TRUSTED, environment=environment) as editor:
            editor.wait_for("done")
            assert {step: editor.steps().get(step) for step in STEPS.split(",")} == dict.fromkeys(
                STEPS.split(","), "ok"
            )


def picture(page, name):
    if PICTURES:
        page.screenshot(path=str(Path(PICTURES) / f"{name}.png"))


def test_what_a_person_clicks(tmp_path, sample):
    text = (sample / "patrol.maze-machine").read_text(encoding="utf-8")
    (sample / "notes.md").write_text(f"# Notes\n\n```maze-machine\n{text}```\n", encoding="utf-8")
    steps = "server,fence,export,gutter,tree,rename,walkthrough"
    with workbench(tmp_path / "editor", sample, steps, settings=TRUSTED) as editor:
        with editor.person_at("fence") as page:
            spans = page.locator(".view-line span span")
            patterns = (r"^machine$", r"^\s*walk$", r"^0\.3", r"^#\sWalks")
            words = {word: spans.filter(has_text=re.compile(word)).first for word in patterns}
            colours = {word: one.evaluate("one => getComputedStyle(one).color") for word, one in words.items()}
            assert len(set(colours.values())) == 4, colours
            picture(page, "fence")
        with editor.person_at("export") as page:
            diagram_frame(page).locator("#export").click()
            _accept_path(page, "/sample/patrol.svg")
        with editor.person_at("gutter") as page:
            page.locator(".testing-run-glyph").nth(1).click()
        with editor.person_at("tree") as page:
            machines = page.get_by_role("tree", name="Machines")
            machines.get_by_role("treeitem").first.locator(".monaco-tl-twistie").click()
            machines.get_by_role("treeitem", name="tired").click()
            picture(page, "tree")
        with editor.person_at("rename") as page:
            diagram_frame(page).get_by_role("button", name="Rename...").click()
            box = page.locator(".rename-box input")
            box.fill("pivot")
            box.press("Enter")
        with editor.person_at("walkthrough") as page:
            for title in ("Install the program", "Open a sample", "Look at its diagram", "Run its tests"):
                page.get_by_text(title, exact=True).first.wait_for()
            page.get_by_text("Open a sample", exact=True).first.click()
            picture(page, "walkthrough")
            page.get_by_role("button", name="Open a Sample", exact=True).click()
            _accept_path(page, "/sample/")


def _accept_path(page, end):
    """Accept the path that a dialog for files proposes, once it proposes the one that is due."""
    sync_api = pytest.importorskip("playwright.sync_api")
    box = page.locator(".quick-input-widget input.input")
    sync_api.expect(box).to_have_value(re.compile(f"{re.escape(end)}$"), timeout=60_000)
    box.press("Enter")
    sync_api.expect(box).not_to_be_visible(timeout=60_000)


def test_the_server_is_that_of_the_selected_interpreter(tmp_path, sample):
    (sample / ".venv").unlink()
    for name in ("one", "two"):
        folder = tmp_path / name / "bin"
        folder.mkdir(parents=True)
        (folder / "maze-machine").write_text(f'#!/bin/sh\nexec "{PROGRAM}" "$@"\n', encoding="utf-8")
        (folder / "maze-machine").chmod(0o755)
    interpreters = os.pathsep.join(str(tmp_path / name / "bin" / "python") for name in ("one", "two"))
    environment = {"MAZE_MACHINE_INTERPRETERS": interpreters}
    with workbench(
        tmp_path / "editor", sample, "interpreter", settings=TRUSTED, environment=environment, others=["python"]
    ) as editor:
        assert editor.wait_for("interpreter") == "ok"


def test_until_it_is_trusted_no_code_of_a_workspace_runs(tmp_path):
    folder = tmp_path / "stranger"
    (folder / ".venv" / "bin").mkdir(parents=True)
    program = folder / ".venv" / "bin" / "maze-machine"
    program.write_text(f'#!/bin/sh\ntouch "{folder}/ran"\nexec "{PROGRAM}" "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    (folder / "maze-machine.toml").write_text('library = "own_of_editor:library"\n', encoding="utf-8")
    (folder / "own_of_editor.py").write_text(OWN, encoding="utf-8")
    text = "machine own\n\ninitial a\n\nstate a\n    when lamp -> b\n\nfinal b\n"
    (folder / "own.maze-machine").write_text(text, encoding="utf-8")
    (folder / "own.maze-test").write_text("test own\n\nscenario one\n    when lamp\n    expect b\n", encoding="utf-8")
    outside = {"VIRTUAL_ENV": str(PROGRAM.parents[1])}
    with workbench(tmp_path / "editor", folder, "untrusted,granted", environment=outside) as editor:
        assert editor.wait_for("untrusted") == "ok"
        assert not (folder / "ran").exists()
        editor.page.get_by_role("button", name="Restricted Mode").first.click()
        editor.page.get_by_role("button", name="Trust", exact=True).first.click()
        assert editor.wait_for("granted") == "ok"


def test_where_nothing_is_found_it_offers_to_install_or_to_choose(tmp_path, sample):
    (sample / ".venv").unlink()
    with workbench(tmp_path / "editor", sample, "nothing", settings=TRUSTED) as editor:
        assert editor.wait_for("nothing") == "ok"
        toast = editor.page.locator(".notifications-toasts")
        toast.get_by_text("maze-machine was not found").wait_for()
        for name in ("Install", "Choose Path"):
            assert toast.get_by_role("button", name=name).is_visible()


def diagram_frame(page):
    """The frame with the diagram, inside two that the editor puts around it."""
    for frame in page.frames:
        if frame.locator("#picture svg").count():
            return frame
    return None


@pytest.mark.parametrize(
    ("name", "theme"),
    [
        ("light", "Default Light Modern"),
        ("dark", "Default Dark Modern"),
        ("contrast", "Default High Contrast"),
    ],
)
def test_what_a_person_sees(tmp_path, sample, name, theme):
    axe = pytest.importorskip("axe_playwright_python")
    settings = {**TRUSTED, "workbench.colorTheme": theme}
    with live_run(EXTENSION / "sample" / "patrol.maze-machine") as endpoint:
        environment = {"MAZE_MACHINE_LIVE": endpoint}
        with workbench(
            tmp_path / "editor", sample, "server,shown", settings=settings, environment=environment
        ) as editor:
            assert editor.wait_for("shown") == "ok"
            page = editor.page
            frame = diagram_frame(page)
            assert frame is not None
            assert frame.locator(".active").count() == 1
            # Colours of the text: keywords, states and numbers differ.
            spans = page.locator(".view-line span span")
            colours = {
                word: spans.filter(has_text=word).first.evaluate("one => getComputedStyle(one).color")
                for word in ("state", "walk", "0.3")
            }
            assert len(set(colours.values())) == 3
            # By keyboard: from state to state, and to the text.
            frame.locator("[data-id][tabindex='0']").focus()
            before = frame.locator(".chosen").get_attribute("data-id")
            page.keyboard.press("ArrowDown")
            assert frame.locator(".chosen").get_attribute("data-id") != before
            width = float(frame.locator("#picture svg").get_attribute("width"))
            page.keyboard.press("+")
            assert float(frame.locator("#picture svg").get_attribute("width")) > width
            page.keyboard.press("0")
            frame.locator("#list").click()
            assert "state walk" in frame.locator("#text").inner_text()
            if PICTURES:
                page.screenshot(path=str(Path(PICTURES) / f"{name}.png"))
            script = Path(axe.__file__).with_name("axe.min.js").read_text(encoding="utf-8")
            frame.evaluate(script)
            found = frame.evaluate("axe.run(document, {resultTypes: ['violations']})")
            serious = [
                (one["id"], [node["html"][:120] for node in one["nodes"]], one["help"])
                for one in found["violations"]
                if one["impact"] in ("serious", "critical")
            ]
            assert not serious
            policy = frame.locator("meta[http-equiv='Content-Security-Policy']").get_attribute("content")
            assert "default-src 'none'" in policy
            assert "unsafe" not in policy
