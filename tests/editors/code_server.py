"""Visual Studio Code in a browser, with the extension and a driver that tries it from within.

``MAZE_MACHINE_CODE_SERVER`` names the program code-server; without it, or without the packed extension, playwright or
Chromium, tests that use this are skipped. ``.ci/editors`` installs all of it.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

EXTENSION = Path(__file__).parents[2] / "editors" / "vscode"
SERVER = os.environ.get("MAZE_MACHINE_CODE_SERVER")
CHROMIUM = shutil.which("chromium")
PATIENCE = 240.0
SETTINGS: Mapping[str, Any] = {
    "workbench.startupEditor": "none",
    "workbench.colorTheme": "Default Dark Modern",
    "telemetry.telemetryLevel": "off",
    "extensions.autoUpdate": False,
    "update.mode": "none",
    "testing.automaticallyOpenResults": "neverOpen",
    "workbench.secondarySideBar.defaultVisibility": "hidden",
    "chat.disableAIFeatures": True,
    "security.workspace.trust.startupPrompt": "never",
    "files.autoSave": "off",
    "editor.minimap.enabled": False,
}


def packed() -> Path:
    """The newest packed extension."""
    found = sorted(EXTENSION.glob("*.vsix"), key=lambda path: path.stat().st_mtime)
    if SERVER is None or CHROMIUM is None or not found:
        pytest.skip("there is no code-server, no Chromium or no packed extension")
    return found[-1]


@dataclass(slots=True)
class Workbench:
    """The editor in a browser.

    Attributes:
        page: of playwright.
        verdict: the file that the driver writes.
    """

    page: Any
    verdict: Path

    def steps(self) -> dict[str, Any]:
        """What the driver has found so far."""
        try:
            found: dict[str, Any] = json.loads(self.verdict.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return {}
        return found

    def wait_for(self, step: str) -> Any:
        """What the driver has found at a step."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            found = self.steps()
            if step in found:
                return found[step]
            self.page.wait_for_timeout(200)
        raise AssertionError(f"the driver did not come to `{step}`: {self.steps()}")

    @contextmanager
    def person_at(self, step: str) -> Iterator[Any]:
        """The page at a step that needs a person; after the block the driver looks at what the person has done."""
        assert self.wait_for(step) == "shown", self.steps()
        yield self.page
        self.verdict.with_name(f"{self.verdict.name}.{step}").touch()
        end = time.monotonic() + PATIENCE
        while self.steps()[step] == "shown" and time.monotonic() < end:
            self.page.wait_for_timeout(100)
        assert self.steps()[step] == "ok", self.steps()[step]


@contextmanager
def workbench(
    folder: Path,
    workspace: Path,
    steps: str,
    *,
    settings: Mapping[str, Any] | None = None,
    environment: Mapping[str, str] | None = None,
    others: Sequence[str] = (),
) -> Iterator[Workbench]:
    """The editor with a workspace open.

    Args:
        folder: where it keeps its own things.
        workspace: what it opens.
        steps: what the driver does, separated by commas.
        settings: the user's, besides those above.
        environment: variables, besides the test's own.
        others: further extensions, by their folders beside the driver's.
    """
    sync_api = pytest.importorskip("playwright.sync_api")
    _install(packed(), folder / "extensions", ("driver", *others))
    (folder / "data" / "User").mkdir(parents=True, exist_ok=True)
    written = json.dumps({**SETTINGS, **(settings or {})})
    (folder / "data" / "User" / "settings.json").write_text(written, encoding="utf-8")
    verdict = folder / "verdict.json"
    port = _free_port()
    command = [
        str(SERVER), "--auth", "none", "--bind-addr", f"127.0.0.1:{port}", "--user-data-dir", str(folder / "data"),
        "--extensions-dir", str(folder / "extensions"), "--disable-telemetry", "--disable-update-check", str(workspace),
    ]  # fmt: skip
    variables = {
        **{name: value for name, value in os.environ.items() if name != "VIRTUAL_ENV"},
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "HOME": str(folder),
        "MAZE_MACHINE_VERDICT": str(verdict),
        "MAZE_MACHINE_STEPS": steps,
        **(environment or {}),
    }
    with (folder / "log.txt").open("w") as log:
        process = subprocess.Popen(command, env=variables, stdout=log, stderr=log, start_new_session=True)
    try:
        _listening(port, process)
        with sync_api.sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
            page = browser.new_page(viewport={"width": 1500, "height": 900})
            page.goto(f"http://127.0.0.1:{port}/?folder={workspace}")
            yield Workbench(page, verdict)
            browser.close()
    finally:
        os.killpg(process.pid, signal.SIGTERM)
        process.wait(20)


def _install(extension: Path, folder: Path, others: Sequence[str]) -> None:
    with zipfile.ZipFile(extension) as archive:
        archive.extractall(folder / "unpacked")
    (folder / "unpacked" / "extension").rename(folder / "maze-machine.maze-machine-0.1.0")
    shutil.rmtree(folder / "unpacked")
    for other in others:
        told = json.loads((EXTENSION / "test" / other / "package.json").read_text(encoding="utf-8"))
        shutil.copytree(EXTENSION / "test" / other, folder / f"{told['publisher']}.{told['name']}-{told['version']}")


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
    return port


def _listening(port: int, process: subprocess.Popen[bytes]) -> None:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end and process.poll() is None:
        with socket.socket() as one:
            if one.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)  # a process elsewhere: there is nothing to wait on
    raise AssertionError("code-server does not listen")
