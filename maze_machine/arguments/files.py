"""Files that a command reads and writes: each output is a file of its own, with a suffix that names its format."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from maze_machine.errors import FileError, UsageError

PICTURES = (".png", ".svg", ".pdf", ".jpg")
"""The suffixes of a picture of a run or a map."""


def check_outputs(outputs: Mapping[str, Path | None], inputs: Iterable[Path | str] = ()) -> None:
    """Make sure that nothing is written over what the same command reads or writes.

    Args:
        outputs: files to write, by the option that names each; None where it was not given.
        inputs: files that are read; names of shipped things among them, which are not files, do no harm.

    Raises:
        UsageError: an output is an input, or two outputs are one file.
    """
    given = {option: path for option, path in outputs.items() if path is not None and not _is_device(path)}
    for option, path in given.items():
        if any(_same(path, Path(read)) for read in inputs):
            raise UsageError(f"{option} {path} would overwrite what is read", "choose another file")
    named = list(given.items())
    for number, (option, path) in enumerate(named):
        for other, written in named[:number]:
            if _same(path, written):
                raise UsageError(f"{other} and {option} are the same file, {path}", "choose another file")


def check_suffix(option: str, path: Path | None, known: Sequence[str]) -> None:
    """Make sure that the suffix of an output names a format that the command writes.

    Args:
        option: the option that names the output.
        path: the output; None where the option was not given. A device, such as ``/dev/null``, needs no suffix.
        known: the suffixes that the command knows, with their dots.

    Raises:
        UsageError: the suffix is another one, or missing.
    """
    if path is None or path.suffix in known or _is_device(path):
        return
    wrong = f"there is no format `{path.suffix}`" if path.suffix else "the name has no suffix"
    raise UsageError(f"{option} {path}: {wrong}", f"use {' or '.join(known)}")


def check_folder(option: str, path: Path | None) -> None:
    """Make sure that an output that is written at the end of long work has a folder.

    Args:
        option: the option that names the output.
        path: the output; None where the option was not given.

    Raises:
        FileError: the folder does not exist.
    """
    if path is not None and not path.parent.is_dir():
        raise FileError(f"{option} {path}: there is no folder {path.parent}", "make it, or choose another file")


def _is_device(path: Path) -> bool:
    """Whether a path is something that several may write to, such as ``/dev/null``."""
    return path.exists() and not path.is_file()


def _same(one: Path, other: Path) -> bool:
    if os.path.realpath(one) == os.path.realpath(other):
        return True
    return one.exists() and other.exists() and one.samefile(other)
