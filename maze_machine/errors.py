"""Errors for the user: one clear message, and an exit status for programs."""

from __future__ import annotations

import errno
import os
import re
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from enum import IntEnum
from pathlib import Path
from types import FrameType
from typing import Any

import typer

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""The errors of a disk that takes no more."""


class ExitStatus(IntEnum):
    """How a command ended."""

    OK = 0
    FAILED = 1
    USAGE = 2
    BAD_FILE = 3
    UNREACHABLE = 4
    INTERRUPTED = 130
    TERMINATED = 143


STATUS_OF = {
    ("hsm.model.diagnostics", "MachineError"): ExitStatus.BAD_FILE,
    ("hsm.model.faults", "MachineFault"): ExitStatus.FAILED,
    ("perception.map_document", "MapError"): ExitStatus.BAD_FILE,
    ("sim.maze", "MazeError"): ExitStatus.BAD_FILE,
    ("transport.recording.values", "RecordingError"): ExitStatus.BAD_FILE,
    ("transport.endpoints", "EndpointError"): ExitStatus.USAGE,
    ("transport.robot", "LinkError"): ExitStatus.UNREACHABLE,
}
"""The errors of the other packages that a user can act on, by module and name."""


class CommandError(Exception):
    """An error that the user can fix.

    Attributes:
        status: the exit status that it leads to.
        way_out: how to fix it, or empty.
    """

    status = ExitStatus.USAGE

    def __init__(self, message: str, way_out: str = "") -> None:
        self.way_out = way_out
        super().__init__(message)


class UsageError(CommandError):
    """Arguments that exclude each other or name something unknown."""


def missing_package(subject: str, package: str, extra: str) -> UsageError:
    """The error where an extra is not installed.

    Args:
        subject: what needs it.
        package: the missing package.
        extra: the extra of this project that brings it.
    """
    return UsageError(f"{subject} needs {package}, which is not installed", f'pip install "maze-machine[{extra}]"')


class FileError(CommandError):
    """A file that is missing or cannot be used."""

    status = ExitStatus.BAD_FILE


class Terminated(KeyboardInterrupt):
    """A request to end this process (SIGTERM); the robot is stopped as by Ctrl-C."""


@contextmanager
def reported() -> Iterator[None]:
    """End the command with a message and an exit status on an expected error.

    An unexpected error is a defect of this program and keeps its traceback.
    """
    previous = _raise_on_termination()
    try:
        with _written_out():
            yield
    except KeyboardInterrupt as interrupt:
        ended = isinstance(interrupt, Terminated)
        _tell("terminated" if ended else "interrupted")
        raise typer.Exit(ExitStatus.TERMINATED if ended else ExitStatus.INTERRUPTED) from None
    except typer.Exit:
        raise
    except Exception as error:
        known = explain(error)
        if known is None:
            raise
        status, message = known
        _tell(message)
        raise typer.Exit(status) from None
    finally:
        if previous is not None:
            signal.signal(signal.SIGTERM, previous)


_NO_MEMORY = re.compile("failed to map segment|[Cc]annot allocate memory")
"""The messages of the library loader when memory runs out."""


def explain(error: Exception) -> tuple[ExitStatus, str] | None:
    """The exit status and the message for an error that a user can act on; None for any other."""
    if isinstance(error, CommandError):
        return error.status, _readable(f"{error}; {error.way_out}" if error.way_out else str(error))
    for (module, name), status in STATUS_OF.items():
        # An error's module has been imported by the code that raised it; nothing heavy is imported here.
        loaded = sys.modules.get(module)
        if loaded is not None and isinstance(error, getattr(loaded, name)):
            return status, _underlined(error) if name == "MachineError" else _readable(str(error))
    if isinstance(error, BrokenPipeError):
        return None  # the reader of the output has closed it, which the command-line library handles
    if isinstance(error, OSError):
        if error.filename is not None:
            return ExitStatus.BAD_FILE, _readable(f"{error.filename}: {error.strerror}")
        if error.errno in NO_ROOM:  # named files report their own errors
            return ExitStatus.BAD_FILE, f"the output cannot be written: {error.strerror}"
    if isinstance(error, MemoryError) or (isinstance(error, ImportError) and _NO_MEMORY.search(str(error))):
        return ExitStatus.BAD_FILE, "there is not enough memory for this"
    return None


_LONGEST = 600
"""The longest line of a message, in characters: an argument or a name in it may have any length."""


def _readable(message: str) -> str:
    """A message without control characters for a terminal, its lines cut in the middle where they are too long."""
    from transport.wording import printable

    lines = [printable(line) for line in message.split("\n")]
    half = _LONGEST // 2
    return "\n".join(line if len(line) <= _LONGEST else f"{line[:half]} ... {line[-half:]}" for line in lines)


def _underlined(error: Any) -> str:
    """A machine's errors, each with its source line; warnings are for ``maze-machine check``."""
    from hsm.dsl.reporting import render
    from hsm.model.diagnostics import Severity

    errors = [found for found in error.diagnostics if found.severity is Severity.ERROR]
    files = {found.place.file for found in errors if found.place is not None}
    sources = {
        file: Path(file).read_text(encoding="utf-8-sig", errors="replace") for file in files if Path(file).is_file()
    }
    text = render.as_text(errors, sources, colour=sys.stderr.isatty())
    return f"the machine cannot be used: {render.summary(errors)}\n\n{text}"


@contextmanager
def _written_out() -> Iterator[None]:
    """Flush the output when the block ends, so that a full disk is reported here and not at exit."""
    try:
        yield
    finally:
        try:
            sys.stdout.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            # The buffered rest would fail again at exit, with a message from the interpreter.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise FileError(f"the output cannot be written: {error.strerror}") from None


def _tell(message: str) -> None:
    with suppress(OSError):  # a full disk takes no message
        print(f"maze-machine: {message}", file=sys.stderr)


def _raise_on_termination() -> signal._HANDLER:
    def terminate(_number: int, _frame: FrameType | None) -> None:
        raise Terminated

    try:
        return signal.signal(signal.SIGTERM, terminate)
    except ValueError:  # not in the main thread: the caller keeps its handlers
        return None
