"""Helix with the lines of the how-to page, in a terminal of tmux: diagnostics, a completion, colours."""

import re
import shutil
import subprocess
import time

import pytest

from tests.editors.grammar import FOLDER, build
from tests.editors.page import TEXT, lines_for, surroundings

HELIX = shutil.which("hx")
TMUX = shutil.which("tmux")
PATIENCE = 60.0


class Terminal:
    def __init__(self, socket, command, folder, variables):
        self._tmux = [TMUX, "-S", str(socket)]
        size = ["-x", "120", "-y", "30"]
        given = [*self._tmux, "-f", "/dev/null", "new-session", "-d", *size, "-c", str(folder), *command]
        subprocess.run(given, env={**variables, "TERM": "xterm-256color", "COLORTERM": "truecolor"}, check=True)

    def keys(self, *keys):
        subprocess.run([*self._tmux, "send-keys", *keys], check=True)

    def screen(self, *options):
        asked = [*self._tmux, "capture-pane", "-p", *options]
        return subprocess.run(asked, capture_output=True, text=True, check=True).stdout

    def until(self, text):
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if re.search(text, self.screen()):
                return
            time.sleep(0.1)  # a program elsewhere: there is nothing to wait on
        raise AssertionError(f"{text} did not come:\n{self.screen()}")

    def end(self):
        subprocess.run([*self._tmux, "kill-server"], check=False)


@pytest.mark.skipif(HELIX is None or TMUX is None, reason="Helix or tmux is not installed")
def test_helix_attaches_and_asks(tmp_path):
    helix = tmp_path / ".config" / "helix"
    (helix / "runtime" / "grammars").mkdir(parents=True)
    (lines,) = lines_for("Helix", "toml")
    (helix / "languages.toml").write_text(lines, encoding="utf-8")
    (helix / "config.toml").write_text("[editor]\ntrue-color = true\n", encoding="utf-8")
    build(tmp_path).rename(helix / "runtime" / "grammars" / "maze-machine.so")
    shutil.copytree(FOLDER / "queries" / "helix", helix / "runtime" / "queries" / "maze-machine")
    (tmp_path / "m.maze-machine").write_text(TEXT, encoding="utf-8")
    terminal = Terminal(tmp_path / "tmux", [HELIX, "m.maze-machine"], tmp_path, surroundings(tmp_path))
    try:
        terminal.until("state a")
        terminal.until(r"● +6 ")
        coloured = terminal.screen("-e")
        assert colour_of(coloured, "state") not in (None, colour_of(coloured, "rotat"))
        terminal.keys("7", "G", "A", "e")
        terminal.until(r"space\.left")
    finally:
        terminal.end()


def colour_of(screen, word):
    """The colour that was set last before a word."""
    before = screen.partition(word)[0]
    found = re.findall(r"\x1b\[(?:\d+;)*(38;[\d;]+)m|\x1b\[(?:\d+;)*(3\d)m", before)
    return next((one for one in found[-1] if one), None) if found else None
