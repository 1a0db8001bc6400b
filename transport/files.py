"""Files that are replaced completely or not at all: written beside, and renamed when complete on the disk.

What is replaced keeps its permissions, and a symbolic link stays one: the file that it leads to is replaced. Something
that is not a regular file (a pipe, a terminal, ``/dev/null``) is written to as it is.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

try:
    import fcntl
except ImportError:  # pragma: no cover - Windows has no such locks
    fcntl = None  # type: ignore[assignment, unused-ignore]

PART = ".part"
"""Ending of a file that is being written beside the one that it will replace."""


class BusyFileError(OSError):
    """Another program is writing this file."""

    def __init__(self, path: Path, holder: str = "another program") -> None:
        super().__init__(errno.EBUSY, f"is being written by {holder}: wait for it, or choose another file", str(path))


def read_at_most(path: Path, size: int) -> bytes:
    """The beginning of a regular file: a device or a named pipe, which may have no end, is refused.

    Args:
        path: the file.
        size: how many bytes are read at most.

    Raises:
        OSError: it cannot be read, or is a folder or another thing than a regular file.
    """
    status = path.stat()
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(status.st_mode):
        raise OSError(errno.EINVAL, "it is not a regular file", str(path))
    with path.open("rb") as file:
        # No more than there is: a reader allocates as much memory as it requests.
        return file.read(min(status.st_size + 1, size))


def write_bytes(path: Path, content: bytes) -> None:
    """Replace a file, or make it.

    Raises:
        OSError: it cannot be written, with its name; what was there before is there still.
    """
    with replacing(path) as file:
        file.write(content)


def write_text(path: Path, text: str) -> None:
    """Replace a file, or make it, with a text in UTF-8 whose line ends stay as they are.

    Raises:
        OSError: as `write_bytes`.
    """
    write_bytes(path, text.encode("utf-8"))


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A file to write the next contents of ``path`` to, which take their place when the block ends without exception.

    Raises:
        OSError: it cannot be written, with its name.
    """
    with _named(path):
        target = _followed(path)
        before = _status(target)
        if before is not None and not stat.S_ISREG(before.st_mode):
            with target.open("wb") as file:
                yield file
            return
        _check_writable(target, before)
        beside = target.with_name(f".{target.name[:200]}.{os.urandom(4).hex()}{PART}")
        try:
            with beside.open("xb") as file:
                yield file
                _settle(file, before)
            _put(beside, target, before)
        finally:
            with suppress(OSError):
                beside.unlink(missing_ok=True)


def append_line(path: Path, line: str) -> None:
    """Add a line to a file, whole or not at all.

    Args:
        path: the file.
        line: with its line feed.

    Raises:
        OSError: it cannot be written, with its name; the file ends as it did before.
    """
    with _named(path), path.open("ab", buffering=0) as file:
        end = file.seek(0, os.SEEK_END)
        content = line.encode()
        try:
            written = file.write(content)
            if written != len(content):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError:
            file.truncate(end)
            raise


class Stream:
    """A file that grows while something runs, such as the trace or the recording of a run.

    Where nothing is replaced it is written in its place, so that a crash leaves it there; otherwise beside, and it
    takes the other one's place when it is closed. One program at a time writes it.

    Attributes:
        file: to write to.
        path: its name.
        place: where it is written until it is closed.
    """

    def __init__(self, path: Path) -> None:
        """Begin to write.

        Raises:
            BusyFileError: another program writes it.
            OSError: it cannot be written, with its name.
        """
        self.path = path
        with _named(path):
            self._target = _followed(path)
            self._before = _status(self._target)
            self.place = self._target
            if self._before is None:
                self.file: BinaryIO = self._target.open("xb")
                _claim(self.file, path)
            elif not stat.S_ISREG(self._before.st_mode):
                self.file = self._target.open("wb")
            else:
                _check_writable(self._target, self._before)
                with self._target.open("rb") as old:
                    _claim(old, path)
                self.place = self._target.with_name(self._target.name + PART)
                self.file = _claimed(self.place, path)
                self.file.truncate()

    def write(self, content: bytes) -> None:
        """Write more.

        Raises:
            OSError: the disk failed, with the file's name and where what could be written is; the stream is over.
        """
        try:
            self.file.write(content)
        except OSError as error:
            self.abandon()
            raise OSError(error.errno, self.cause(error), str(self.path)) from None

    def close(self) -> None:
        """Finish: the file takes its place; a second call does nothing.

        Raises:
            OSError: the disk failed, with the file's name and where what could be written is.
        """
        if self.file.closed:
            return
        with _named(self.path):
            try:
                with self.file as file:
                    if self.place != self._target or self._before is None:
                        _settle(file, self._before)
                if self.place != self._target:
                    _put(self.place, self._target, self._before)
            except OSError as error:
                raise OSError(error.errno, self.cause(error), str(self.path)) from None

    def abandon(self) -> None:
        """Stop writing after a failure; what could be written stays where it is."""
        with suppress(OSError):
            self.file.close()

    def cause(self, error: OSError) -> str:
        """The error, and the place of the written part."""
        kept = "" if self.place == self._target else f" (what was written before is in {self.place})"
        return f"{error.strerror or error}{kept}"


@contextmanager
def locked(path: Path, holder: str) -> Iterator[None]:
    """Lock ``path`` for this program, while the block runs or this process lives.

    The lock is a file beside it, with the holder's name in it.

    Args:
        path: the file, which need not be there yet.
        holder: who this is, for people.

    Raises:
        BusyFileError: another program holds it; the message names it.
        OSError: the lock cannot be made, with its name.
    """
    with _named(path):
        followed = _followed(path)
    beside = followed.with_name(followed.name + ".lock")
    with _named(beside):
        file = _claimed(beside, path)
    try:
        with _named(beside):
            file.truncate()
            file.write(holder.encode())
            file.flush()
        yield
    finally:
        # While it is held: a program that waits for it notices that its name is gone and takes another.
        with suppress(OSError):
            beside.unlink()
        with suppress(OSError):
            file.close()


def _claimed(beside: Path, path: Path) -> BinaryIO:
    """An unlocked file to read and write, created if necessary."""
    while True:
        file = os.fdopen(os.open(beside, os.O_RDWR | os.O_CREAT, 0o666), "r+b")
        try:
            _claim(file, path)
        except BusyFileError:
            holder = file.read(300).decode(errors="replace") if beside.suffix == ".lock" else ""
            file.close()
            raise BusyFileError(path, *([holder] if holder else [])) from None
        # The previous holder may have renamed or removed it in between.
        with suppress(OSError):
            if os.path.samestat(os.fstat(file.fileno()), beside.stat()):
                return file
        file.close()


def _claim(file: BinaryIO, path: Path) -> None:
    """Lock a file until it is closed."""
    if fcntl is None:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise BusyFileError(path) from None
    except OSError:  # some network file systems have no locks
        return


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Make an error of the operating system name this file: a failed write names none, or the temporary one."""
    try:
        yield
    except BusyFileError:
        raise
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None


def _followed(path: Path) -> Path:
    """The file at the end of symbolic links."""
    return Path(os.path.realpath(path)) if path.is_symlink() else path


def _status(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except FileNotFoundError:
        return None
    except ValueError as error:  # a NUL in a name
        raise OSError(errno.EINVAL, str(error), str(path)) from None


def _check_writable(target: Path, before: os.stat_result | None) -> None:
    """Refuse what may not be written, though it could be replaced."""
    if before is not None and not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(target))


def _settle(file: BinaryIO, before: os.stat_result | None) -> None:
    """Flush a file to the disk, with the permissions of the one that it replaces."""
    file.flush()
    if before is not None:
        os.chmod(file.fileno(), stat.S_IMODE(before.st_mode))  # noqa: PTH101 - of the open file
        with suppress(OSError):  # only root may give files away
            os.chown(file.fileno(), before.st_uid, before.st_gid)
    os.fsync(file.fileno())


def _put(beside: Path, target: Path, before: os.stat_result | None) -> None:
    """Move a finished file to its place.

    One with other names (hard links) is written over from the finished copy, so that all of them name the new contents.
    """
    if before is None or before.st_nlink == 1:
        beside.replace(target)
        return
    content = beside.read_bytes()
    with target.open("r+b") as file:
        if hasattr(os, "posix_fallocate") and content:
            os.posix_fallocate(file.fileno(), 0, len(content))  # a full disk shows before anything is lost
        file.write(content)
        file.truncate()
        file.flush()
        os.fsync(file.fileno())
    beside.unlink()
