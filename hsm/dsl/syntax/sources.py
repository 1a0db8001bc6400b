"""The texts of machines' files."""

from __future__ import annotations

from difflib import get_close_matches
from pathlib import Path

from hsm.model.codes import finding
from hsm.model.diagnostics import MachineError

SUFFIX = ".maze-machine"
"""The suffix of machine files."""

_LARGEST = 2**25


def read_text(path: str | Path) -> str:
    """The text of a file.

    Raises:
        MachineError: it cannot be read, or is not text.
    """
    try:
        if Path(path).is_fifo():  # opening one waits for a writer
            raise _unreadable(path, "it is a pipe", "give the path of a file")
        with Path(path).open("rb") as file:  # not to the end: a device may have none
            content = file.read(_LARGEST + 1)
        if len(content) > _LARGEST:
            raise _unreadable(path, "it is larger than 32 MiB", "move parts of it into machines that it imports")
        return content.decode("utf-8-sig")
    except FileNotFoundError as error:
        raise _unreadable(path, _reason(error), _beside(Path(path))) from None
    except UnicodeDecodeError as error:
        raise _unreadable(path, f"byte {error.start + 1} is not UTF-8", "save it as UTF-8") from None
    except (OSError, ValueError) as error:
        raise _unreadable(path, _reason(error), "give the path of a file that you may read") from None


def _unreadable(path: str | Path, reason: str, suggestion: str) -> MachineError:
    return MachineError([finding("E0107", None, f"{path} cannot be read: {reason}", suggestion)])


def _beside(path: Path) -> str:
    """The file that was probably meant instead of one that does not exist."""
    suffix = path.suffix or SUFFIX
    close = get_close_matches(path.stem, sorted(other.stem for other in path.parent.glob(f"*{suffix}")), n=1)
    return f"did you mean `{path.with_name(close[0] + suffix)}`?" if close else "give the path of an existing file"


def _reason(error: OSError | ValueError) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
