"""The analysed grammar is kept from run to run; what cannot be trusted or read is analysed again."""

import json
import os
import pickle
from hashlib import sha256
from pathlib import Path

import pytest

from hsm.dsl.syntax import table_cache
from hsm.dsl.syntax.parse_table import TableParser
from hsm.dsl.syntax.parser import Grammar, analysed, parse

MACHINES = [Path(__file__).parents[2] / "machines" / f"{name}.maze-machine" for name in ("pledge", "explorer")]
PLAIN = analysed()


class Analysis:
    """Counts how often the grammar is analysed."""

    def __init__(self):
        self.count = 0

    def __call__(self):
        self.count += 1
        return PLAIN


def kept(folder):
    analyse = Analysis()
    table_cache.kept("grammar", analyse, folder)
    (file,) = folder.iterdir()
    return file, analyse


def again(folder, grammar="grammar"):
    analyse = Analysis()
    found = table_cache.kept(grammar, analyse, folder)
    return found, analyse.count


def with_checksum(payload):
    return sha256(payload).digest() + payload


class Code:
    """What a file must not be able to run."""

    def __reduce__(self):
        return os.mkdir, ("harm",)


@pytest.mark.parametrize("machine", MACHINES, ids=lambda one: one.stem)
def test_a_kept_grammar_reads_what_the_grammar_reads(machine, tmp_path):
    _, first = kept(tmp_path)
    found, count = again(tmp_path)
    assert (first.count, count) == (1, 0)
    assert found == PLAIN
    text = machine.read_text(encoding="utf-8")
    grammar = Grammar.of(found)
    assert isinstance(grammar.begin(), TableParser)
    for one in (text, text.replace("->", "- >", 3)):
        assert parse(one, "m", grammar) == parse(one, "m", Grammar.of(PLAIN))


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"x",
        with_checksum(b""),
        with_checksum(b"{}"),
        with_checksum(b"[1, 2, 3]"),
        with_checksum(b'["a", {}, [], [1], 0, 0]'),
        with_checksum(b"[" * 100_000),
        with_checksum(json.dumps(PLAIN).encode()[:-1]),
        with_checksum(pickle.dumps(Code())),
        json.dumps(PLAIN).encode(),
    ],
    ids=["empty", "short", "nothing", "no table", "three", "a rule", "deep", "cut", "code", "no checksum"],
)
def test_a_damaged_or_foreign_file_is_replaced(content, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "cache"
    file, _ = kept(folder)
    right = file.read_bytes()
    file.write_bytes(content)
    assert again(folder)[1] == 1
    assert file.read_bytes() == right
    assert again(folder)[1] == 0
    assert not (tmp_path / "harm").exists()


def test_every_cut_and_every_changed_byte_is_noticed(tmp_path):
    file, _ = kept(tmp_path)
    right = file.read_bytes()
    for place in range(0, len(right), len(right) // 5):
        for content in (right[:place], right[:place] + bytes([right[place] ^ 1]) + right[place + 1 :]):
            file.write_bytes(content)
            assert again(tmp_path)[1] == 1


def test_another_grammar_is_another_file(tmp_path):
    kept(tmp_path)
    assert again(tmp_path, "another grammar")[1] == 1
    assert again(tmp_path)[1] == 0


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="files have no owners here")
def test_a_file_that_others_can_write_to_is_not_read(tmp_path):
    file, _ = kept(tmp_path)
    assert file.stat().st_mode & 0o077 == 0
    file.chmod(0o666)
    assert again(tmp_path)[1] == 1
    assert file.stat().st_mode & 0o077 == 0


def test_a_folder_that_cannot_be_written_costs_nothing_but_time(tmp_path):
    (tmp_path / "cache").write_text("a file, not a folder")
    assert again(tmp_path / "cache") == (PLAIN, 1)
