"""The analysed grammar, kept in the user's cache folder: its analysis takes longer than a small check.

What is kept is plain data in JSON: a file cannot name code to run. It carries a checksum, and its name a digest of the
grammar. A file that is damaged, of another version, or that somebody else can write to is not used; the grammar is
analysed again and the file replaced. Where nothing can be kept, each run analyses it.
"""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Callable
from contextlib import suppress
from hashlib import sha256
from pathlib import Path

from hsm.dsl.syntax.parse_table import GrammarRule, PlainGrammar

_CHECKSUM = 32  # bytes
_FORMAT = 2
"""Counts the forms in which grammars are kept."""


def kept(text: str, analyse: Callable[[], PlainGrammar], folder: Path | None = None) -> PlainGrammar:
    """An analysed grammar, from the cache where it is there.

    Args:
        text: the grammar.
        analyse: analyses it without a cache.
        folder: where it is kept; by default the user's cache folder.
    """
    try:
        return _restored(_read(_file(text, folder)))
    except Exception:  # whatever is wrong with a kept file, the grammar itself is there
        found = analyse()
    with suppress(Exception):  # and what cannot be kept is analysed again the next time
        _write(_file(text, folder), json.dumps(found).encode())
    return found


def _file(text: str, folder: Path | None) -> Path:
    if folder is None:
        from platformdirs import user_cache_path  # noqa: PLC0415 - part of what may fail without harm

        folder = user_cache_path("maze-machine")
    version = sha256(f"{_FORMAT}\n{text}".encode()).hexdigest()
    return folder / f"grammar-{version[:16]}.json"


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


def _restored(payload: bytes) -> PlainGrammar:
    """The grammar in a file.

    Raises:
        TypeError, ValueError: it holds something else.
    """
    pattern, symbols, rows, rules, start, end = json.loads(payload)
    restored = [
        GrammarRule(size, name, method, tuple(chosen), tuple(joined), passes)
        for size, name, method, chosen, joined, passes in rules
    ]
    return PlainGrammar(pattern, symbols, tuple(rows), tuple(restored), start, end)


def _write(file: Path, payload: bytes) -> None:
    import tempfile  # noqa: PLC0415 - only where no analysed grammar is kept

    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=file.parent, prefix=file.name, delete=False) as beside:  # for the user alone
        try:
            beside.write(sha256(payload).digest() + payload)
            beside.close()
            Path(beside.name).replace(file)
        except BaseException:
            Path(beside.name).unlink()
            raise
