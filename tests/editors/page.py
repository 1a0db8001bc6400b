"""The lines of the how-to page for an editor, and the surroundings that an editor runs in."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

PAGES = Path(__file__).parents[2] / "docs" / "how-to"
TEXT = "machine m\n\ninitial a\n\nstate a\n    do rotat(90 deg)\n    when space.l\n\nfinal b\n"
MACHINE = """machine m

initial idle

state idle
    after 1 s -> moving

# Stands still.
state moving
    do stop()
"""
"""A machine for debuggers."""


def lines_for(editor: str, language: str, page: str = "editor") -> list[str]:
    """The blocks in a language in the section of an editor."""
    text = (PAGES / f"{page}.md").read_text(encoding="utf-8")
    (section,) = re.findall(rf"^## {editor}[^\n]*\n(.*?)(?=^## |\Z)", text, re.DOTALL | re.MULTILINE)
    return re.findall(rf"^```{language}\n(.*?)^```$", section, re.DOTALL | re.MULTILINE)


def surroundings(home: Path) -> dict[str, str]:
    """Variables of an editor whose user has only what is in a folder."""
    return {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "HOME": str(home),
        "XDG_CONFIG_HOME": str(home / ".config"),
        "XDG_STATE_HOME": str(home / "state"),
        "XDG_DATA_HOME": str(home / "data"),
        "XDG_CACHE_HOME": str(home / "cache"),
    }
