"""The tree-sitter grammar, built for the tests with the C compiler of this computer."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from tempfile import mkdtemp

import pytest

FOLDER = Path(__file__).parents[2] / "editors" / "tree-sitter-maze-machine"
_tree_sitter = pytest.importorskip("tree_sitter")
_CASE = re.compile(r"^={80}\n(.*?)\n={80}\n\n(.*?)\n-{80}\n\n(.*?)(?=\n\n=|\Z)", re.DOTALL | re.MULTILINE)
_COMPILER = shutil.which("gcc")

if _COMPILER is None:
    pytest.skip("there is no C compiler", allow_module_level=True)


def build(folder: Path) -> Path:
    """The grammar as a shared library in a folder."""
    library = folder / "maze_machine.so"
    source = FOLDER / "src"
    files = [source / "parser.c", source / "scanner.c"]
    subprocess.run([_COMPILER, "-O1", "-shared", "-fPIC", "-I", source, *files, "-o", library], check=True)
    return library


@cache
def language() -> _tree_sitter.Language:
    """The language of machines."""
    folder = Path(mkdtemp())
    try:
        loaded = ctypes.CDLL(str(build(folder)))
    finally:
        shutil.rmtree(folder)
    loaded.tree_sitter_maze_machine.restype = ctypes.c_void_p
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a language made of a pointer is deprecated in favour of a capsule
        return _tree_sitter.Language(loaded.tree_sitter_maze_machine())


@cache
def parser() -> _tree_sitter.Parser:
    """A parser of machines."""
    return _tree_sitter.Parser(language())


def query(name: str) -> _tree_sitter.Query:
    """One of the grammar's queries."""
    return _tree_sitter.Query(language(), (FOLDER / "queries" / f"{name}.scm").read_text(encoding="utf-8"))


def captures(name: str, text: str) -> dict[str, list[str]]:
    """What a query finds in a text, by the names of its captures, in the order of the text."""
    root = parser().parse(text.encode()).root_node
    found = _tree_sitter.QueryCursor(query(name)).captures(root)
    ordered = {kind: sorted(nodes, key=lambda node: node.start_byte) for kind, nodes in found.items()}
    return {kind: [node.text.decode() for node in nodes] for kind, nodes in ordered.items()}


def corpus(file: Path) -> Iterator[tuple[str, str, str]]:
    """Title, text and tree of each case of a corpus file, as the tree-sitter command reads them."""
    text = file.read_text(encoding="utf-8")
    for title, source, tree in _CASE.findall(text):
        yield title, source, re.sub(r"\s+", " ", tree).strip().replace(" )", ")")
