"""Files are replaced whole or not at all."""

from __future__ import annotations

import os
import resource
import stat
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from transport.files import PART, BusyFileError, Stream, locked, replacing, write_bytes, write_text

OLD, NEW = b"what was there before", b"x" * 50_000


@contextmanager
def little_room(most: int = 10_000) -> Iterator[None]:
    """No file may grow larger than so many bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def names(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir()]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "file"
    path.write_bytes(OLD)
    return path


def test_a_file_is_made_and_replaced_and_nothing_is_left_beside(tmp_path: Path) -> None:
    path = tmp_path / "new"
    write_text(path, "one\r\ntwo\n")
    assert path.read_bytes() == b"one\r\ntwo\n"
    umask = os.umask(0)
    os.umask(umask)
    assert stat.S_IMODE(path.stat().st_mode) == 0o666 & ~umask
    write_bytes(path, NEW)
    assert path.read_bytes() == NEW
    assert names(tmp_path) == ["new"]


def test_permissions_stay_and_a_link_stays_a_link(file: Path) -> None:
    file.chmod(0o640)
    link = file.with_name("link")
    link.symlink_to("file")
    write_bytes(link, NEW)
    assert link.is_symlink()
    assert file.read_bytes() == NEW
    assert stat.S_IMODE(file.stat().st_mode) == 0o640


def test_all_names_of_a_file_name_its_new_contents(file: Path) -> None:
    other = file.with_name("other")
    other.hardlink_to(file)
    write_bytes(file, NEW)
    assert other.samefile(file)
    assert other.read_bytes() == NEW
    write_bytes(file, OLD)
    assert other.read_bytes() == OLD


def test_a_link_that_leads_nowhere_yet_leads_to_the_new_file(tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to("to come")
    write_bytes(link, NEW)
    assert link.is_symlink()
    assert (tmp_path / "to come").read_bytes() == NEW


@pytest.mark.parametrize("hard_link", [False, True])
def test_a_full_disk_costs_nothing_that_was_there_and_names_the_file(file: Path, *, hard_link: bool) -> None:
    if hard_link:
        file.with_name("other").hardlink_to(file)
    with little_room(), pytest.raises(OSError, match="File too large") as caught:
        write_bytes(file, NEW)
    assert caught.value.filename == str(file)
    assert file.read_bytes() == OLD
    assert {path.name for path in file.parent.iterdir()} <= {"file", "other"}


def test_an_exception_while_it_is_written_costs_nothing(file: Path) -> None:
    def fails() -> None:
        with replacing(file) as written:
            written.write(NEW)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fails()
    assert file.read_bytes() == OLD
    assert names(file.parent) == ["file"]


def test_what_may_not_be_written_is_not_replaced(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write everything
    with pytest.raises(PermissionError) as caught:
        write_bytes(file, NEW)
    assert caught.value.filename == str(file)


def test_a_device_is_written_to_as_it_is(tmp_path: Path) -> None:
    write_bytes(Path(os.devnull), NEW)
    with pytest.raises(OSError, match="No space left on device") as caught:
        write_bytes(Path("/dev/full"), NEW)
    assert caught.value.filename == "/dev/full"
    assert stat.S_ISCHR(Path("/dev/full").stat().st_mode)
    stream = Stream(Path(os.devnull))
    stream.write(NEW)
    stream.close()
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_bytes(pipe, OLD)
    assert os.read(reader, 100) == OLD
    os.close(reader)


def test_a_name_that_is_none_is_an_error_of_the_file(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "no" / "folder", tmp_path / "x\0y"):
        with pytest.raises(OSError, match=r".") as caught:
            write_bytes(path, NEW)
        assert caught.value.filename == str(path)


def test_a_stream_is_there_while_it_is_written_if_nothing_was_there_before(tmp_path: Path) -> None:
    path = tmp_path / "new"
    stream = Stream(path)
    stream.write(NEW)
    stream.file.flush()
    assert path.read_bytes() == NEW
    stream.close()
    stream.close()
    assert names(tmp_path) == ["new"]


def test_a_stream_replaces_what_was_there_when_it_is_closed(file: Path) -> None:
    stream = Stream(file)
    stream.write(NEW)
    stream.file.flush()
    assert file.read_bytes() == OLD
    assert stream.place.name == "file" + PART
    stream.close()
    assert file.read_bytes() == NEW
    assert names(file.parent) == ["file"]


@pytest.mark.parametrize("share", [9_000, 6_000], ids=["while it is written", "when it is closed"])
def test_a_stream_on_a_full_disk_keeps_what_was_there_and_what_could_be_written(file: Path, share: int) -> None:
    stream = Stream(file)

    def written() -> None:
        stream.write(NEW[:share])
        stream.write(NEW[:share])
        stream.close()

    with little_room(), pytest.raises(OSError, match="File too large") as caught:
        written()
    stream.close()
    assert caught.value.filename == str(file)
    assert f"{file}{PART}" in str(caught.value)
    assert file.read_bytes() == OLD
    assert Path(f"{file}{PART}").stat().st_size > 0


@pytest.mark.parametrize("there", [False, True])
def test_two_streams_to_one_file_are_not_begun(tmp_path: Path, *, there: bool) -> None:
    path = tmp_path / "file"
    if there:
        path.write_bytes(OLD)
    stream = Stream(path)
    stream.write(NEW)
    with pytest.raises(BusyFileError, match="being written by another program"):
        Stream(path)
    stream.close()
    assert path.read_bytes() == NEW
    stream = Stream(path)
    stream.write(OLD)
    stream.close()
    assert path.read_bytes() == OLD


def test_a_lock_names_its_holder_and_leaves_nothing(file: Path) -> None:
    with locked(file, "host, process 7"):
        with pytest.raises(BusyFileError, match="host, process 7") as caught, locked(file, "me"):
            pass
        assert caught.value.filename == str(file)
    with locked(file, "me"):
        pass
    assert names(file.parent) == ["file"]


HOLDER = """
import os, pathlib, sys
from transport.files import locked
with locked(pathlib.Path(sys.argv[1]), "somebody"):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_the_lock_of_a_killed_process_is_free(file: Path) -> None:
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(file)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert holder.stdout is not None
    assert holder.stdout.readline() == "held\n"
    with pytest.raises(BusyFileError, match="somebody"), locked(file, "me"):
        pass
    holder.kill()
    holder.communicate()
    with locked(file, "me"):
        pass


def test_of_many_that_want_a_lock_one_at_a_time_has_it(tmp_path: Path) -> None:
    counter = tmp_path / "counter"
    counter.write_text("0")
    program = """
import pathlib, sys
from transport.files import BusyFileError, locked
counter = pathlib.Path(sys.argv[1])
done = 0
while done < 100:
    try:
        with locked(counter, "one"):
            counter.write_text(str(int(counter.read_text()) + 1))
            done += 1
    except BusyFileError:
        pass
"""
    others = [subprocess.Popen([sys.executable, "-c", program, str(counter)]) for _ in range(3)]
    assert [other.wait(60) for other in others] == [0, 0, 0]
    assert counter.read_text() == "300"
