"""How long an editor waits for the language server, beside two of Python on a file of the same length.

    pip install jedi-language-server basedpyright
    python benchmarks/editor.py [LINES] [ROUNDS] [EDITS]

All servers run as child processes over standard input and output. A round asks each of them once, in turn: a keystroke
and then diagnostics (pulled, except for jedi-language-server, which publishes them), completion, document symbols. The
medians are printed. With EDITS, our server then takes this many more edits, with diagnostics after every twentieth, and
its memory is printed before, in the middle and at the end.
"""

from __future__ import annotations

import asyncio
import logging
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter

from lsprotocol import types
from pygls.lsp.client import LanguageClient

STATE = (
    "state s{0}\n    do drive(speed = 0.3 m/s)\n    when space.left and space.front -> s{1}\n    on blocked -> s{0}\n\n"
)
FUNCTION = "def f{0}(left, front):\n    if left and not front:\n        return f{1}(left, front)\n    return {0}\n\n"


def machine(lines: int) -> str:
    """A machine of about this many lines."""
    count = lines // 5
    body = "".join(STATE.format(number, (number + 1) % count) for number in range(count))
    return f"machine long\n\ninitial s0\n\n{body}"


def module(lines: int) -> str:
    """A Python module of about this many lines."""
    count = lines // 5
    return "".join(FUNCTION.format(number, (number + 1) % count) for number in range(count))


class Server(LanguageClient):
    """A client of one of the servers."""

    def __init__(self) -> None:
        super().__init__("benchmark", "1")
        self.published = 0

        @self.feature(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
        def published(_params: types.PublishDiagnosticsParams) -> None:
            self.published += 1

    async def begin(self, command: list[str], path: Path, text: str, *, pulls: bool) -> float:
        """Start the server and open the file; the time until it answers `initialize`, s."""
        began = perf_counter()
        await self.start_io(*command)
        asked = types.TextDocumentClientCapabilities(diagnostic=types.DiagnosticClientCapabilities() if pulls else None)
        await self.initialize_async(
            types.InitializeParams(types.ClientCapabilities(text_document=asked), root_uri=path.parent.as_uri())
        )
        taken = perf_counter() - began
        self.initialized(types.InitializedParams())
        self.item = types.TextDocumentIdentifier(path.as_uri())
        self.version, self.pulls = 1, pulls
        self.text_document_did_open(
            types.DidOpenTextDocumentParams(types.TextDocumentItem(path.as_uri(), path.suffix, 1, text))
        )
        return taken

    async def keystroke(self, line: int) -> float:
        """Type a letter into a comment at the end of a line and wait for the diagnostics; s."""
        self.version += 1
        before, began = self.published, perf_counter()
        where = types.Range(types.Position(line, 999), types.Position(line, 999))
        change = types.TextDocumentContentChangePartial(where, "  # x" if self.version == 2 else "x")
        self.text_document_did_change(
            types.DidChangeTextDocumentParams(
                types.VersionedTextDocumentIdentifier(self.version, self.item.uri), [change]
            )
        )
        if self.pulls:
            await self.text_document_diagnostic_async(types.DocumentDiagnosticParams(self.item))
        else:
            while self.published == before:
                await asyncio.sleep(0.001)
        return perf_counter() - began

    async def complete(self, line: int, column: int) -> float:
        """Ask what could be at a position; s."""
        began = perf_counter()
        await self.text_document_completion_async(types.CompletionParams(self.item, types.Position(line, column)))
        return perf_counter() - began

    async def symbols(self) -> float:
        """Ask for the outline; s."""
        began = perf_counter()
        await self.text_document_document_symbol_async(types.DocumentSymbolParams(self.item))
        return perf_counter() - began

    def memory(self) -> float:
        """Resident memory of the server, MiB; on Linux."""
        pages = int(Path(f"/proc/{self._server.pid}/statm").read_text(encoding="ascii").split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 2**20

    async def many_edits(self, lines: int, edits: int) -> list[float]:
        """Type and take back letters all over the file; the memory before, in the middle and at the end, MiB."""
        found = [self.memory()]
        for number in range(edits):
            line = 5 * (number // 2 % (lines // 5)) + 5
            typed = number % 2 == 0
            end = 0 if typed else 1
            where = types.Range(types.Position(line, 0), types.Position(line, end))
            change = types.TextDocumentContentChangePartial(where, "#" if typed else "")
            self.version += 1
            identifier = types.VersionedTextDocumentIdentifier(self.version, self.item.uri)
            self.text_document_did_change(types.DidChangeTextDocumentParams(identifier, [change]))
            if number % 20 == 19:
                await self.text_document_diagnostic_async(types.DocumentDiagnosticParams(self.item))
            if number in (edits // 2, edits - 1):
                found.append(self.memory())
        return found


@dataclass(frozen=True, slots=True)
class Contestant:
    """A language server with a file for it.

    Attributes:
        name: the column's heading.
        command: what starts it.
        file: the file's name.
        text: what is in it.
        pulls: whether it is asked for diagnostics; else it publishes them.
    """

    name: str
    command: list[str]
    file: str
    text: str
    pulls: bool


def contestants(lines: int) -> list[Contestant]:
    """This project's server and those of Python beside it."""
    programs = Path(sys.executable).parent
    python = module(lines)
    jedi = [sys.executable, "-c", "from jedi_language_server.cli import cli; cli()"]
    pyright = [sys.executable, "-c", "from basedpyright.langserver import main; main()", "--stdio"]
    return [
        Contestant(
            "maze-machine", [str(programs / "maze-machine"), "lsp"], "long.maze-machine", machine(lines), pulls=True
        ),
        Contestant("jedi-language-server", jedi, "jedi.py", python, pulls=False),
        Contestant("basedpyright", pyright, "pyright.py", python, pulls=True),
    ]


async def measure(lines: int, rounds: int, edits: int) -> None:
    """Ask all servers in turn and print the medians."""
    asked = contestants(lines)
    with TemporaryDirectory() as folder:
        servers, starts = [Server() for _ in asked], []
        for server, one in zip(servers, asked, strict=True):
            file = Path(folder, one.file)
            file.write_text(one.text, encoding="utf-8")
            starts.append(await server.begin(one.command, file, one.text, pulls=one.pulls))
        taken = {name: [list[float]() for _ in asked] for name in ("keystroke to diagnostics", "completion", "symbols")}
        for number in range(rounds):
            line = 5 * (number + 1) + 1
            for place, server in enumerate(servers):
                taken["keystroke to diagnostics"][place].append(await server.keystroke(line))
                taken["completion"][place].append(await server.complete(line + 1, 9))
                taken["symbols"][place].append(await server.symbols())
        print(f"{lines} lines, ms".ljust(28), *(one.name.rjust(20) for one in asked))
        print("initialize".ljust(28), *(f"{1e3 * start:20.1f}" for start in starts))
        for name, times in taken.items():
            print(name.ljust(28), *(f"{1e3 * median(each):20.1f}" for each in times))
        if edits:
            before, middle, after = await servers[0].many_edits(lines, edits)
            print(f"memory over {edits} edits, MiB: {before:.1f} before, {middle:.1f} in the middle, {after:.1f} after")
        for server in servers:
            await server.shutdown_async(None)
            server.exit(None)
            await server.stop()


if __name__ == "__main__":
    given = [int(one) for one in sys.argv[1:]]
    logging.disable(logging.WARNING)  # what the servers report of themselves
    asyncio.run(measure(*(given + [2000, 20, 0][len(given) :])))
