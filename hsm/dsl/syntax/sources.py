"""The files of machines: which a folder has, and their texts."""

from __future__ import annotations

import os
from collections.abc import Iterator
from difflib import get_close_matches
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from hsm.model.codes import finding
from hsm.model.diagnostics import MachineError

SUFFIX = ".maze-machine"
"""The suffix of machine files."""

_LARGEST = 2**25


def files_in(folder: Path, suffix: str, most_folders: int | None = None) -> Iterator[Path]:
    """The files with a suffix in a folder and below it, in the order of their names.

    Hidden folders, virtual environments, ``node_modules`` and links to folders are left out.

    Args:
        folder: where to search.
        suffix: what the names of the files end with.
        most_folders: how many folders are searched; None for all.
    """
    for place, below, files in islice(os.walk(folder), most_folders):
        below[:] = sorted(name for name in below if not _foreign(Path(place, name)))
        yield from (Path(place, name) for name in sorted(files) if name.endswith(suffix))


def _foreign(folder: Path) -> bool:
    return folder.name.startswith(".") or folder.name == "node_modules" or (folder / "pyvenv.cfg").exists()


def read_text(path: str | Path) -> str:
    """The text of a file.

    Raises:
        MachineError: it cannot be read, or is not text.
    """
    try:
        if Path(path).is_fifo():  # opening one waits for a writer
            raise _unreadable(path, "it is a pipe", "give the path of a file")
        with Path(path).open("rb") as file:
            return text_in(file, path)
    except FileNotFoundError as error:
        raise _unreadable(path, _reason(error), _beside(Path(path))) from None
    except (OSError, ValueError) as error:
        raise _unreadable(path, _reason(error), "give the path of a file that you may read") from None


def text_in(stream: BinaryIO, name: str | Path) -> str:
    """The text of a stream, which is read to its largest length only: a device may have no end.

    Args:
        stream: where to read.
        name: what messages call it.

    Raises:
        MachineError: it is too long, or is not text.
    """
    content = stream.read(_LARGEST + 1)
    if len(content) > _LARGEST:
        raise _unreadable(name, "it is larger than 32 MiB", "move parts of it into machines that it imports")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _unreadable(name, f"byte {error.start + 1} is not UTF-8", "save it as UTF-8") from None


def _unreadable(path: str | Path, reason: str, suggestion: str) -> MachineError:
    return MachineError([finding("E0107", None, f"{path} cannot be read: {reason}", suggestion)])


def _beside(path: Path) -> str:
    """The file that was probably meant instead of one that does not exist."""
    suffix = path.suffix or SUFFIX
    close = get_close_matches(path.stem, sorted(other.stem for other in path.parent.glob(f"*{suffix}")), n=1)
    return f"did you mean `{path.with_name(close[0] + suffix)}`?" if close else "give the path of an existing file"


def _reason(error: OSError | ValueError) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
