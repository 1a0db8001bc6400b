"""Mutated inputs of every format: each is read, or refused by the format's own error, never by anything else.

The engine is Hypothesis rather than Atheris: it runs wherever the other tests run, without an interpreter of its own,
and shrinks what it finds to a few bytes. It mutates the files of the committed corpus, ``corpus/TARGET/``; an input
that failed once belongs there.

``FUZZ_EXAMPLES=1000000 FUZZ_SEED=$(date +%Y%m%d) pytest tests/fuzz`` tries more, and others every night.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, seed, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from hsm.dsl.loading import check_text, load_model
from hsm.dsl.lsp.editing import Document
from hsm.dsl.lsp.navigation import definition, outline, references
from hsm.interchange.scxml import read_text as read_scxml
from hsm.model.diagnostics import MachineError
from hsm.testing.scenarios.reading import parse_suite
from maze_machine.catalogue.library import robot_library
from maze_machine.catalogue.profile import Profile
from sim.formats import read_maze
from sim.maze import MazeError
from transport import codec
from transport.recording import RecordingError, read_recording
from transport.session import Lease, SessionState, read_answer, respond
from transport.toml import TomlError, parse_toml

CORPUS = Path(__file__).parent / "corpus"
SEED = os.environ.get("FUZZ_SEED")
ASKED = os.environ.get("FUZZ_EXAMPLES")
WORDS = (
    *(b"\0", b"\xff", b"\xef\xbb\xbf", b"\n", b"\r", b"\x1b[2J", b"\xc2\xa0", b" " * 9, b"state x\n"),
    *(b"(", b")", b"[", b"{", b"<", b'"', b"#", b"&", b" -> ", b" m/s"),
    *(b"-1", b"1e300", b"1e-300", b"nan", b"inf", b"9" * 40, b"0x1", b"null", b"true"),
)


def mutated(target: str) -> st.SearchStrategy[tuple[str, bytes]]:
    """The name of a file of the corpus, and its content after a few changes."""
    files = {path.name: path.read_bytes() for path in sorted((CORPUS / target).iterdir())}
    # One number a change: Hypothesis draws it several times as fast as its parts.
    changes = st.lists(st.integers(0, 2**40 - 1), min_size=1, max_size=4)
    return st.tuples(st.sampled_from(sorted(files)), changes).map(
        lambda drawn: (drawn[0], changed(files[drawn[0]], drawn[1]))
    )


def changed(content: bytes, changes: list[int]) -> bytes:
    """A content with parts cut out, doubled, replaced or put in."""
    for change in changes:
        rest, how = divmod(change, 4)
        rest, length = divmod(rest, 40)
        rest, word = divmod(rest, len(WORDS))
        at = rest % (len(content) + 1)
        part = content[at : at + length]
        content = content[:at] + (b"", part + part, WORDS[word], WORDS[word] + part)[how] + content[at + length :]
    return content


@cache
def library() -> object:
    return robot_library()


def machine(_name: str, content: bytes, _folder: Path) -> None:
    checked = check_text(content.decode("utf-8", "replace"), library())
    assert checked.model is not None or checked.diagnostics


def editor(_name: str, content: bytes, _folder: Path) -> None:
    text = content.decode("utf-8", "replace")
    document = Document(text, "fuzz.maze-machine", library())
    outline(document)
    for line in (1, 2 + len(content) % (text.count("\n") + 1)):
        for column in (1, 9):
            document.hover(line, column)
            document.completions(line, column)
            definition(document, line, column)
            references(document, line, column)


@cache
def two() -> object:
    return load_model(CORPUS / "machine" / "two.maze-machine", library())


def suite(_name: str, content: bytes, _folder: Path) -> None:
    try:
        parse_suite(content.decode("utf-8", "replace"), two(), library())
    except MachineError as error:
        refused = error.diagnostics
        assert refused


def scxml(_name: str, content: bytes, _folder: Path) -> None:
    try:
        read_scxml(content)
    except MachineError as error:
        refused = error.diagnostics
        assert refused


def maze(name: str, content: bytes, folder: Path) -> None:
    path = folder / name
    path.write_bytes(content)
    try:
        read_maze(path)
    except MazeError as error:
        refused = "\n" not in str(error)
        assert refused


def profile(_name: str, content: bytes, _folder: Path) -> None:
    try:
        Profile.model_validate(parse_toml(content.decode("utf-8", "replace")))
    except (TomlError, ValidationError):
        return


DECODERS = (
    *(codec.decode_scan, codec.decode_odometry, codec.decode_twist, codec.decode_clock),
    *(codec.decode_door_reply, codec.decode_text),
)


def wire(_name: str, content: bytes, _folder: Path) -> None:
    for decode in DECODERS:
        try:
            decode(content)
        except codec.CodecError:
            continue


class Desk:
    """A robot's side that nobody holds."""

    lease = Lease(1.0, lambda: 0.0)

    def close(self, _: object) -> SessionState:
        return SessionState(held=False)

    open = state = again = close


def question(_name: str, content: bytes, _folder: Path) -> None:
    read_answer(respond(Desk(), b"%s\n%08x" % (content, zlib.crc32(content)))[0])


def recording(_name: str, content: bytes, folder: Path) -> None:
    path = folder / "fuzz.mcap"
    path.write_bytes(content)
    try:
        read_recording(path)
    except RecordingError as error:
        refused = "\n" not in str(error)
        assert refused


TARGETS: dict[str, tuple[Callable[[str, bytes, Path], None], str, int]] = {
    "machine": (machine, "machine", 300),
    "editor": (editor, "machine", 200),
    "suite": (suite, "suite", 600),
    "scxml": (scxml, "scxml", 1000),
    "maze": (maze, "maze", 200),
    "profile": (profile, "profile", 1000),
    "codec": (wire, "codec", 2000),
    "question": (question, "question", 2000),
    "recording": (recording, "recording", 500),
}
"""What is called, its folder of the corpus, and how many inputs are tried where nobody asks for more."""


@pytest.mark.parametrize("target", TARGETS)
def test_any_input_is_read_or_refused(target: str, tmp_path: Path) -> None:
    read, folder, usual = TARGETS[target]

    @settings(
        max_examples=int(ASKED or usual),
        deadline=None,
        derandomize=SEED is None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(mutated(folder))
    def run(drawn: tuple[str, bytes]) -> None:
        read(*drawn, tmp_path)

    (run if SEED is None else seed(int(SEED))(run))()


@pytest.mark.parametrize("target", TARGETS)
def test_the_corpus_itself_is_read(target: str, tmp_path: Path) -> None:
    read, folder, _ = TARGETS[target]
    for path in sorted((CORPUS / folder).iterdir()):
        read(path.name, path.read_bytes(), tmp_path)
