"""Mutated inputs of every format: each is read, or refused by the format's own error, never by anything else.

The engine is Hypothesis rather than Atheris: it runs wherever the other tests run, under every Python that the project
supports, and shrinks what it finds to a few bytes. It draws a batch of changes at a time, which costs a tenth of
drawing them one by one; they are applied to the files of the committed corpus, ``corpus/TARGET/``. An input that
failed once belongs there. Small files stand beside larger ones, because an input costs what its file costs.

``FUZZ_INPUTS=1000000 FUZZ_SEED=$(date +%Y%m%d) pytest -n 0 -s tests/fuzz`` tries more, and others every night; portions
with different seeds add up. An input that takes more than ``LIMIT`` of processor time has failed.
"""

from __future__ import annotations

import asyncio
import gc
import json
import logging
import os
import resource
import signal
import time
import traceback
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import HealthCheck, Phase, given, note, seed, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from pygls.exceptions import JsonRpcException

from hsm.dsl.loading import ImportedMachines, check_tree, load_model
from hsm.dsl.lsp.completion import completions
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.hovering import hover
from hsm.dsl.lsp.machine_server import MachineServer
from hsm.dsl.lsp.navigation import definition, outline
from hsm.dsl.lsp.references import references
from hsm.dsl.lsp.server import make_server
from hsm.dsl.syntax.parser import parse
from hsm.interchange.scxml import read_text as read_scxml
from hsm.model.diagnostics import MachineError
from hsm.testing.scenarios.reading import parse_suite
from maze_machine.campaign.jobs import Setup, jobs_of
from maze_machine.campaign.results import Results
from maze_machine.catalogue.library import robot_library
from maze_machine.catalogue.profile import Profile
from maze_machine.errors import CommandError
from maze_machine.remote.messages import OperationError, read_operation
from sim.formats import read_maze
from sim.maze import MazeError
from transport import codec
from transport.description import RobotDescription
from transport.envelope import CommandTag, ObservationTag
from transport.recording import RecordingError, read_recording
from transport.session import Lease, SessionState, read_answer, respond
from transport.toml import TomlError, parse_toml

CORPUS = Path(__file__).parent / "corpus"
SEED = os.environ.get("FUZZ_SEED")
INPUTS = int(os.environ.get("FUZZ_INPUTS", "2000"))
LIMIT = 10.0
"""The most processor time that one input may take, s."""
MEMORY = Path("/dev/shm")
"""Where files cost the least, if there is such a place."""
BATCH, SIZE = 64, 22
"""How many inputs Hypothesis draws at once, and of how many bytes each."""
WORDS = (
    *(b"\0", b"\xff", b"\xef\xbb\xbf", b"\n", b"\r", b"\x1b[2J", b"\xc2\xa0", b" " * 9, b"state x\n"),
    *(b"(", b")", b"[", b"{", b"<", b'"', b"#", b"&", b" -> ", b" m/s"),
    *(b"-1", b"1e300", b"1e-300", b"nan", b"inf", b"9" * 40, b"0x1", b"null", b"true"),
)


def inputs(files: dict[str, bytes], drawn: bytes) -> Iterator[tuple[str, bytes]]:
    """The inputs that a batch of bytes stands for: the name of a file of the corpus, and its content after changes.

    The first byte of an input is the number of changes (none where it is 0, so that a batch shrinks to one input), the
    second the file, the others the changes.
    """
    names = sorted(files)
    for at in range(0, len(drawn), SIZE):
        many, which, *rest = drawn[at : at + SIZE]
        if many:
            changes = [int.from_bytes(rest[one : one + 5], "big") for one in range(0, 5 * (1 + many % 4), 5)]
            name = names[which % len(names)]
            yield name, changed(files[name], changes)


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


@cache
def imported() -> ImportedMachines:
    """What the machines import, read once."""
    return ImportedMachines()


def machine(_name: str, content: bytes, _folder: Path) -> None:
    text = content.decode("utf-8", "replace")
    checked = check_tree(*parse(text, "fuzz.maze-machine"), text, library(), imported())
    assert checked.model is not None or checked.diagnostics


def editor(_name: str, content: bytes, _folder: Path) -> None:
    text = content.decode("utf-8", "replace")
    document = Document(text, "fuzz.maze-machine", library())
    outline(document)
    where = zlib.crc32(content)
    line, column = 1 + where % (text.count("\n") + 2), 1 + (where >> 16) % 30
    for ask in (hover, completions, definition, references):
        ask(document, line, column)


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
        read_maze(path, radius=RobotDescription().radius)
    except MazeError as error:
        refused = "\n" not in str(error)
        assert refused


def profile(_name: str, content: bytes, _folder: Path) -> None:
    try:
        Profile.model_validate(parse_toml(content.decode("utf-8", "replace")))
    except (TomlError, ValidationError):
        return


TWO = (CORPUS / "machine" / "two.maze-machine").read_text(encoding="utf-8")
INITIALIZE = {"id": 1, "method": "initialize", "params": {"capabilities": {}, "processId": None, "rootUri": None}}
OPENED = {"uri": "file:///fuzz/fuzz.maze-machine", "languageId": "maze-machine", "version": 1, "text": TWO}
OPEN = {"method": "textDocument/didOpen", "params": {"textDocument": OPENED}}


@cache
def language_server() -> tuple[Callable[..., None], list[Exception]]:
    """What sends messages to a server, and what its own functions have raised; pygls answers what it cannot read."""
    logging.getLogger("pygls").setLevel(logging.CRITICAL)
    started, raised = make_server(lambda _file: library(), "1"), []

    def report(error: Exception, _source: object) -> None:
        refused = isinstance(error, JsonRpcException)
        if not refused and any("/hsm/" in frame.filename for frame in traceback.extract_tb(error.__traceback__)):
            raised.append(error)

    started.report_server_error = report
    editor = Editor()
    started.protocol.set_writer(editor)
    loop = asyncio.new_event_loop()
    loop.run_until_complete(tell(started, editor, INITIALIZE))
    return lambda *messages: loop.run_until_complete(tell(started, editor, *messages)), raised


def server(_name: str, content: bytes, _folder: Path) -> None:
    """A message of the language server protocol, with a machine open."""
    send, raised = language_server()
    try:
        message = json.loads(content)
    except ValueError:
        return
    if isinstance(message, dict):
        send(OPEN, message)
        assert not raised


async def tell(started: MachineServer, editor: Editor, *messages: dict[str, object]) -> None:
    for message in messages:
        receive(started, message)
        await asyncio.sleep(0)
    while editor.asked:
        receive(started, {"id": editor.asked.pop(), "result": None})


def receive(started: MachineServer, message: dict[str, object]) -> None:
    body = json.dumps({"jsonrpc": "2.0", **message})
    with suppress(JsonRpcException, AttributeError):  # of pygls: no request that it knows
        started.protocol.handle_message(json.loads(body, object_hook=started.protocol.structure_message))


class Editor:
    """Where the server's messages go; ``asked`` are the requests among them."""

    def __init__(self) -> None:
        self.asked: list[object] = []

    def write(self, data: bytes) -> None:
        message = json.loads(data.split(b"\r\n\r\n", 1)[1])
        if "method" in message and "id" in message:
            self.asked.append(message["id"])

    def close(self) -> None:
        return


DECODERS = (
    *(codec.decode_scan, codec.decode_odometry, codec.decode_twist, codec.decode_twist_stamped, codec.decode_clock),
    *(codec.decode_door_reply, codec.decode_text, codec.decode_transforms, codec.child_frame_of),
)


def wire(_name: str, content: bytes, _folder: Path) -> None:
    for decode in DECODERS:
        try:
            decode(content)
        except codec.CodecError:
            continue
    for tag in (CommandTag, ObservationTag):
        try:
            tag.decode(content, b"")
        except codec.CodecError:
            continue


def operation(_name: str, content: bytes, _folder: Path) -> None:
    try:
        read_operation(content)
    except OperationError as error:
        refused = "\n" not in str(error)
        assert refused


SETUP, JOBS = Setup(time_limit=1.0), jobs_of(["right_hand"], ["corridor"], 2)


def results(_name: str, content: bytes, folder: Path) -> None:
    """Taken up for no job, which reads no machine, and where that succeeds for two."""
    path = folder / "fuzz.jsonl"
    path.write_bytes(content)
    try:
        Results(path, SETUP, [])
        Results(path, SETUP, JOBS)
    except CommandError as error:
        refused = "\n" not in str(error)
        assert refused


class Desk:
    """A robot's side that nobody holds."""

    lease = Lease(1.0, lambda: 0.0)

    def close(self, _: object) -> SessionState:
        return SessionState(held=False)

    open = state = again = close


def question(_name: str, content: bytes, _folder: Path) -> None:
    read_answer(respond(Desk(), b"%s\n%08x" % (content, zlib.crc32(content)))[0])


def recording(name: str, content: bytes, folder: Path) -> None:
    path = folder / name
    path.write_bytes(content)
    try:
        read_recording(path)
    except RecordingError as error:
        refused = "\n" not in str(error)
        assert refused


TARGETS: dict[str, tuple[Callable[[str, bytes, Path], None], str]] = {
    "machine": (machine, "machine"),
    "editor": (editor, "machine"),
    "server": (server, "server"),
    "suite": (suite, "suite"),
    "scxml": (scxml, "scxml"),
    "maze": (maze, "maze"),
    "profile": (profile, "profile"),
    "codec": (wire, "codec"),
    "question": (question, "question"),
    "operation": (operation, "operation"),
    "results": (results, "results"),
    "recording": (recording, "recording"),
}
"""What is called, and its folder of the corpus."""


def corpus(folder: str) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((CORPUS / folder).iterdir())}


@pytest.fixture(autouse=True)
def no_search_for_garbage_in_what_stays() -> Iterator[None]:
    """The library, the grammar and Hypothesis are no garbage; looking at them again and again takes a tenth."""
    library()
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.fixture
def scratch(tmp_path: Path) -> Iterator[Path]:
    """A folder for inputs that are files, in memory where the system offers it."""
    if not MEMORY.is_dir():
        yield tmp_path
        return
    with TemporaryDirectory(dir=MEMORY) as folder:
        yield Path(folder)


@contextmanager
def limited(most: float) -> Iterator[None]:
    """Raises TimeoutError in what takes more processor time than this, s."""

    def late(_signal: int, _frame: object) -> None:
        raise TimeoutError(f"more than {most:g} s of processor time")

    before = signal.signal(signal.SIGVTALRM, late)
    signal.setitimer(signal.ITIMER_VIRTUAL, most)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


@pytest.mark.parametrize("target", TARGETS)
def test_any_input_is_read_or_refused(target: str, scratch: Path) -> None:
    read, folder = TARGETS[target]
    files, tried, begun = corpus(folder), 0, time.process_time()

    @settings(
        max_examples=2 + -(-INPUTS // (BATCH - 4)),  # Hypothesis begins with small ones
        phases=[Phase.generate, Phase.shrink],
        deadline=None,
        derandomize=SEED is None,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(st.binary(min_size=BATCH * SIZE, max_size=BATCH * SIZE))
    def run(drawn: bytes) -> None:
        nonlocal tried
        for name, content in inputs(files, drawn):
            tried += 1
            try:
                with limited(LIMIT):
                    read(name, content, scratch)
            except BaseException:
                note(f"{name}: {content!r}")
                raise

    (run if SEED is None else seed(int(SEED))(run))()
    rate, peak = tried / (time.process_time() - begun), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{target}: {tried} inputs, {rate:.0f} a second of processor time, {peak:.0f} MiB at most", flush=True)
    assert tried >= INPUTS


@pytest.mark.parametrize("target", TARGETS)
def test_the_corpus_itself_is_read(target: str, scratch: Path) -> None:
    read, folder = TARGETS[target]
    for name, content in corpus(folder).items():
        with limited(LIMIT):
            read(name, content, scratch)


def test_an_input_that_takes_too_long_has_failed() -> None:
    def hang() -> None:
        while True:
            pass

    with pytest.raises(TimeoutError), limited(0.05):
        hang()
