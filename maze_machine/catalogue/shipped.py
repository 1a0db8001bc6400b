"""Find files: shipped ones by name, others by path."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path

from maze_machine.errors import FileError


def find_file(kind: str, name: str, shipped: Mapping[str, Path], error: type[FileError] = FileError) -> Path:
    """The file for a name or path.

    Args:
        kind: its kind, such as ``maze``.
        name: a path, or the name of a shipped one, which comes first.
        shipped: the files that come with the project, by name.
        error: what is raised if there is neither.

    Raises:
        FileError: there is neither; the message has a suggestion.
    """
    path = shipped.get(name, Path(name))
    if path.is_file():
        return path
    if path.exists():
        raise error(f"`{name}` is not a regular file")
    listed = f"shipped {kind}s: {', '.join(shipped)}"
    close = get_close_matches(name, shipped, n=1)
    raise error(f"there is no {kind} `{name}`", f"did you mean `{close[0]}`? ({listed})" if close else listed)
