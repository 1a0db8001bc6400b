"""Find files: those that have a name by their name, others by path."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path

from maze_machine.errors import FileError


def find_file(kind: str, name: str, known: Mapping[str, Path], error: type[FileError] = FileError) -> Path:
    """The file for a name or path.

    Args:
        kind: its kind, such as ``maze``.
        name: a path, or a known name, which comes first.
        known: the files that have a name.
        error: what is raised if there is neither.

    Raises:
        FileError: there is neither; the message has a suggestion.
    """
    path = known.get(name, Path(name))
    if path.is_file():
        return path
    if path.exists():
        raise error(f"`{name}` is not a regular file")
    listed = f"known {kind}s: {', '.join(known)}"
    close = get_close_matches(name, known, n=1)
    raise error(f"there is no {kind} `{name}`", f"did you mean `{close[0]}`? ({listed})" if close else listed)
