"""Where each code of a diagnostic is explained, as a link that an editor opens."""

from __future__ import annotations

import re

from maze_machine.installation import HOME

_HEADING = re.compile(r"^### ([EWN]\d{4}):")


def code_pages() -> dict[str, str]:
    """The explanation of each code, by the code: a file's URI with a line; empty where the page was not installed."""
    page = HOME / "maze_machine" / "catalogue" / "diagnostics.md"
    try:
        lines = page.read_text(encoding="utf-8").splitlines()
    except OSError:
        return {}
    uri = page.resolve().as_uri()
    headings = ((number, _HEADING.match(line)) for number, line in enumerate(lines, 1))
    return {found[1]: f"{uri}#L{number}" for number, found in headings if found is not None}
