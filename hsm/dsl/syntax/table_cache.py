"""The grammar as lark has analysed it, kept in the user's cache folder: the analysis takes as long as a small check.

What is kept is plain data, and nothing else is read back: a file cannot name code to run. It carries a checksum, and
its name a digest of the grammar and lark's version. A file that is damaged, of another version, or that somebody else
can write to is not used; the grammar is analysed again and the file replaced. Where nothing can be kept, each run
analyses it.
"""

from __future__ import annotations

import io
import os
import pickle
import stat
import tempfile
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any, NoReturn

import lark
from lark import Lark

_CHECKSUM = 32  # bytes


def analysed(grammar: str, transformer: object, analyse: Callable[[], Lark], folder: Path | None = None) -> Lark:
    """A grammar, from the cache where it is there.

    Args:
        grammar: its text.
        transformer: what builds the values of its rules.
        analyse: reads the grammar without a cache.
        folder: where it is kept; by default the user's cache folder.
    """
    try:
        file = _file(grammar, folder)
        return _restored(_read(file), transformer)
    except Exception:  # whatever is wrong with a kept file, the grammar itself is there
        found = analyse()
    with suppress(Exception):  # and what cannot be kept is analysed again the next time
        _write(_file(grammar, folder), _kept(found))
    return found


def _file(grammar: str, folder: Path | None) -> Path:
    if folder is None:
        from platformdirs import user_cache_path  # noqa: PLC0415 - part of what may fail without harm

        folder = user_cache_path("maze-machine")
    version = sha256(f"{lark.__version__}\n{grammar}".encode()).hexdigest()
    return folder / f"grammar-{version[:16]}.pickle"


def _read(file: Path) -> bytes:
    """What a file holds.

    Raises:
        OSError, ValueError: it is not there, not whole, or not the user's alone.
    """
    with file.open("rb") as source:
        found = os.fstat(source.fileno())
        if hasattr(os, "getuid") and (found.st_uid != os.getuid() or found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)):
            raise ValueError("other users can write to it")
        content = source.read()
    checksum, payload = content[:_CHECKSUM], content[_CHECKSUM:]
    if sha256(payload).digest() != checksum:
        raise ValueError("it is damaged")
    return payload


def _write(file: Path, payload: bytes) -> None:
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=file.parent, prefix=file.name, delete=False) as beside:  # for the user alone
        try:
            beside.write(sha256(payload).digest() + payload)
            beside.close()
            Path(beside.name).replace(file)
        except BaseException:
            Path(beside.name).unlink()
            raise


def _kept(grammar: Lark) -> bytes:
    from lark.grammar import Rule  # noqa: PLC0415 - only where there is no cache yet
    from lark.lexer import TerminalDef  # noqa: PLC0415

    data, memo = grammar.memo_serialize([TerminalDef, Rule])
    data["options"]["transformer"] = None
    return pickle.dumps((_plain(data), _plain(memo)))


def _plain(value: Any) -> Any:
    """The same data without lark's own types of text."""
    if isinstance(value, dict):
        return {_plain(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_plain(one) for one in value]
    if isinstance(value, tuple):
        return tuple(_plain(one) for one in value)
    return str(value) if isinstance(value, str) else value


class _PlainData(pickle.Unpickler):
    """Reads numbers, texts and containers of them."""

    def find_class(self, module: str, name: str) -> NoReturn:
        raise pickle.UnpicklingError(f"{module}.{name} is not a plain data")


def _restored(payload: bytes, transformer: object) -> Lark:
    data, memo = _PlainData(io.BytesIO(payload)).load()
    # As the parsers begin that lark generates.
    restored: Lark = Lark._load_from_dict(data, memo, transformer=transformer)  # type: ignore[no-untyped-call]
    return restored
