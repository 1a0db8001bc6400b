"""Helix with the lines of the how-to page, in a terminal of tmux: diagnostics, a completion, colours."""

import re
import shutil
import subprocess
import time

import pytest

from tests.editors.grammar import FOLDER, build
from tests.editors.page import MACHINE, TEXT, lines_for, surroundings

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

    def until(self, text, *, shown=True):
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if bool(re.search(text, self.screen())) == shown:
                return
            time.sleep(0.1)  # a program elsewhere: there is nothing to wait on
        raise AssertionError(f"{text} did not {'come' if shown else 'go'}:\n{self.screen()}")

    def debugger(self, key):
        """Press a key of the menu of the debugger; Escape leaves what is open before."""
        self.keys("Escape")
        self.until(r"Debug \(experimental\)", shown=False)
        self.keys("Space", "G", key)

    def end(self):
        subprocess.run([*self._tmux, "kill-server"], check=False)


needs_helix = pytest.mark.skipif(HELIX is None or TMUX is None, reason="Helix or tmux is not installed")


@needs_helix
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


@needs_helix
def test_helix_debugs_a_machine(tmp_path):
    helix = tmp_path / ".config" / "helix"
    helix.mkdir(parents=True)
    (languages,), (debugger,) = lines_for("Helix", "toml"), lines_for("Helix", "toml", "debugging")
    first, *others = languages.split("[[language]]\n")[1:]
    (helix / "languages.toml").write_text("[[language]]\n".join(["", first + debugger, *others]), encoding="utf-8")
    (tmp_path / "m.maze-machine").write_text(MACHINE, encoding="utf-8")
    terminal = Terminal(tmp_path / "tmux", [HELIX, "m.maze-machine"], tmp_path, surroundings(tmp_path))
    try:
        terminal.until(r"1 +machine m")
        terminal.keys("9", "g", "g")
        terminal.debugger("b")
        terminal.until(r"◯ +9 ")
        terminal.debugger("l")
        terminal.until("> without a robot")
        terminal.keys("Enter")
        terminal.until("machine:")
        terminal.keys("-l", "m.maze-machine")
        terminal.keys("Enter")
        terminal.until(r"▶ +5 +state idle(.|\n)*stopped because of entry")
        terminal.debugger("v")
        terminal.until("after 1 s -> moving: not due")
        terminal.keys("Escape")
        terminal.until("not due", shown=False)
        terminal.debugger("c")
        terminal.until(r"▶ +9 +state moving(.|\n)*stopped because of breakpoint")
        terminal.debugger("n")
        terminal.until("stopped because of step")
        terminal.debugger("t")
        terminal.until("▶", shown=False)
        assert "expected unit" not in terminal.screen()
    finally:
        terminal.end()


def colour_of(screen, word):
    """The colour that was set last before a word."""
    before = screen.partition(word)[0]
    found = re.findall(r"\x1b\[(?:\d+;)*(38;[\d;]+)m|\x1b\[(?:\d+;)*(3\d)m", before)
    return next((one for one in found[-1] if one), None) if found else None
