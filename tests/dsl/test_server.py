"""The language server under a real client over standard input and output, with machines under random edits."""

import asyncio
import random
import sys
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from lsprotocol import types
from pygls.exceptions import JsonRpcException, JsonRpcInvalidParams, JsonRpcRequestCancelled
from pygls.lsp.client import LanguageClient

from hsm.dsl import check_text
from hsm.dsl.lsp import navigation
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.server import make_server
from maze_machine.catalogue.library import robot_library
from maze_machine.catalogue.machines import SHIPPED
from maze_machine.catalogue.trust import trust

PLEDGE = (SHIPPED / "pledge.maze-machine").read_text(encoding="utf-8")
DEADLINE = 60.0


class Client(LanguageClient):
    """A client that keeps what the server says unasked."""

    def __init__(self):
        super().__init__("tests", "1")
        self.published = {}
        self.messages = []
        self.progress = []
        self.refreshed = 0
        self.errors = []

        @self.feature(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
        def published(params):
            self.published[params.uri] = params

        @self.feature(types.WINDOW_SHOW_MESSAGE)
        def shown(params):
            self.messages.append(params.message)

        @self.feature(types.WINDOW_WORK_DONE_PROGRESS_CREATE)
        def created(params):
            self.progress.append((params.token, "created"))

        @self.feature(types.WORKSPACE_DIAGNOSTIC_REFRESH)
        def asked_again(_params):
            self.refreshed += 1

        @self.feature(types.PROGRESS)
        def progressed(params):
            self.progress.append((params.token, params.value["kind"]))

    def report_server_error(self, error, source):
        self.errors.append(error)


@asynccontextmanager
async def serving(folder, *, pulls=True, options=None, command=None):
    client = Client()
    await client.start_io(*(command or [str(Path(sys.executable).parent / "maze-machine"), "lsp"]))
    text = types.TextDocumentClientCapabilities(
        completion=types.CompletionClientCapabilities(
            completion_item=types.ClientCompletionItemOptions(snippet_support=True)
        ),
        diagnostic=types.DiagnosticClientCapabilities() if pulls else None,
    )
    await client.initialize_async(
        types.InitializeParams(
            types.ClientCapabilities(
                text_document=text,
                workspace=types.WorkspaceClientCapabilities(
                    diagnostics=types.DiagnosticWorkspaceClientCapabilities(refresh_support=True)
                ),
                window=types.WindowClientCapabilities(work_done_progress=True),
            ),
            root_uri=folder.as_uri(),
            initialization_options=options,
            workspace_folders=[types.WorkspaceFolder(folder.as_uri(), folder.name)],
        )
    )
    client.initialized(types.InitializedParams())
    try:
        yield client
    finally:
        await client.shutdown_async(None)
        client.exit(None)
        said = await client._server.stderr.read()
        await client.stop()
    assert said == b""  # requests that are refused or cancelled are no errors of the server


def opened(client, path, text):
    item = types.TextDocumentItem(path.as_uri(), "maze-machine", 1, text)
    client.text_document_did_open(types.DidOpenTextDocumentParams(item))
    return types.TextDocumentIdentifier(path.as_uri())


def served(work):
    asyncio.run(asyncio.wait_for(work, DEADLINE))


async def until(condition):
    while not condition():
        await asyncio.sleep(0)


def test_random_edits_leave_the_server_with_the_text_of_the_editor(tmp_path):
    chance = random.Random(20)
    library = robot_library()
    path = tmp_path / "edited.maze-machine"
    pieces = [
        "\n",
        " ",
        "->",
        "state x\n    do stop()\n",
        "(",
        ")",
        "on done",
        "é",
        "\U0001f6aa",
        "space.left",
        "#",
        "",
        "",
        "",
    ]

    async def work():
        text = PLEDGE
        async with serving(tmp_path) as client:
            document = opened(client, path, text)
            for version in range(2, 25):
                lines = text.split("\n")
                first = chance.randrange(len(lines))
                last = min(first + chance.choice([0, 0, 0, 1, 2]), len(lines) - 1)
                begin, end = chance.randint(0, len(lines[first])), chance.randint(0, len(lines[last]))
                if first == last:
                    begin, end = sorted((begin, end))
                new = chance.choice(pieces)
                where = types.Range(
                    types.Position(first, len(lines[first][:begin].encode("utf-16-le")) // 2),
                    types.Position(last, len(lines[last][:end].encode("utf-16-le")) // 2),
                )
                head, tail = [*lines[:first], lines[first][:begin]], [lines[last][end:], *lines[last + 1 :]]
                text = "\n".join(head) + new + "\n".join(tail)
                change = types.TextDocumentContentChangePartial(where, new)
                client.text_document_did_change(
                    types.DidChangeTextDocumentParams(
                        types.VersionedTextDocumentIdentifier(version, document.uri), [change]
                    )
                )
                report = await client.text_document_diagnostic_async(types.DocumentDiagnosticParams(document))
                fresh = check_text(text, library, str(path)).diagnostics
                own = [one for one in fresh if one.place is not None and one.place.file == str(path)]
                assert sorted(one.code for one in report.items) == sorted(one.code for one in own)
                symbols = await client.text_document_document_symbol_async(types.DocumentSymbolParams(document))
                expected = navigation.outline(Document(text, str(path), library))
                assert [one.name for one in symbols] == [one.name for one in expected]
                position = types.Position(first, chance.randint(0, 40))
                for ask in requests(client, document, position):
                    await ask()
        assert client.errors == []

    served(work())


def requests(client, document, position):
    """Every request about a position, as functions; each must be answered without an internal error."""
    at = {"text_document": document, "position": position}
    whole = types.Range(types.Position(0, 0), types.Position(999, 0))
    options = types.FormattingOptions(4, insert_spaces=True)
    yield lambda: client.text_document_completion_async(types.CompletionParams(**at))
    yield lambda: client.text_document_hover_async(types.HoverParams(**at))
    yield lambda: client.text_document_definition_async(types.DefinitionParams(**at))
    yield lambda: client.text_document_signature_help_async(types.SignatureHelpParams(**at))
    yield lambda: client.text_document_document_highlight_async(types.DocumentHighlightParams(**at))
    context = types.ReferenceContext(include_declaration=True)
    yield lambda: client.text_document_references_async(types.ReferenceParams(context=context, **at))
    yield lambda: client.text_document_folding_range_async(types.FoldingRangeParams(document))
    yield lambda: client.text_document_semantic_tokens_full_async(types.SemanticTokensParams(document))
    yield lambda: client.text_document_inlay_hint_async(types.InlayHintParams(document, whole))
    yield lambda: client.text_document_code_lens_async(types.CodeLensParams(document))
    yield lambda: client.text_document_formatting_async(types.DocumentFormattingParams(document, options))
    actions = types.CodeActionContext([])
    yield lambda: client.text_document_code_action_async(types.CodeActionParams(document, whole, actions))

    async def rename():
        try:
            await client.text_document_rename_async(types.RenameParams(new_name="other_name", **at))
        except (JsonRpcInvalidParams, JsonRpcException) as error:
            assert error.code == JsonRpcInvalidParams.CODE  # noqa: PT017 - an internal error has another code

    yield rename


def test_a_client_that_does_not_ask_is_told_when_typing_pauses(tmp_path):
    path = tmp_path / "m.maze-machine"

    async def work():
        async with serving(tmp_path, pulls=False) as client:
            document = opened(client, path, "machine m\n\ninitial a\n\nfinal b\n")
            await until(lambda: document.uri in client.published)
            assert [one.code for one in client.published[document.uri].diagnostics] == ["E0201"]
            for version in range(2, 12):
                text = f"machine m\n\ninitial a\n\nfinal {'a' if version == 11 else 'b'}\n"
                client.text_document_did_change(
                    types.DidChangeTextDocumentParams(
                        types.VersionedTextDocumentIdentifier(version, document.uri),
                        [types.TextDocumentContentChangeWholeDocument(text)],
                    )
                )
            await until(lambda: client.published[document.uri].version == 11)
            assert not client.published[document.uri].diagnostics
            client.text_document_did_close(types.DidCloseTextDocumentParams(document))

    served(work())


def test_an_import_that_is_edited_elsewhere_is_read_again(tmp_path):
    part, whole = tmp_path / "part.maze-machine", tmp_path / "whole.maze-machine"
    part.write_text("machine part\n\ninitial a\n\nfinal a\n", encoding="utf-8")

    async def work():
        async with serving(tmp_path) as client:
            text = "machine whole\n\nimport part\n\ninitial p\n\nstate p = part()\n    on a -> e\n\nfinal e\n"
            document = opened(client, whole, text)
            report = await client.text_document_diagnostic_async(types.DocumentDiagnosticParams(document))
            assert not report.items
            part.write_text("machine part\n\ninitial b\n\nfinal b\n", encoding="utf-8")
            change = types.FileEvent(part.as_uri(), types.FileChangeType.Changed)
            client.workspace_did_change_watched_files(types.DidChangeWatchedFilesParams([change]))
            await until(lambda: client.refreshed)
            report = await client.text_document_diagnostic_async(types.DocumentDiagnosticParams(document))
            assert report.items

    served(work())


@pytest.fixture
def stranger(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "configuration"))
    folder = tmp_path / "downloaded"
    folder.mkdir()
    (folder / "maze-machine.toml").write_text('library = "stranger:library"\n', encoding="utf-8")
    (folder / "stranger.py").write_text(
        "from pathlib import Path\nfrom hsm import Library\nPath(__file__).with_name('ran').touch()\n"
        "LIBRARY = Library('stranger')\nLIBRARY.event('knock')\ndef library(): return LIBRARY\n",
        encoding="utf-8",
    )
    return folder


@pytest.mark.parametrize("trusted", [False, True])
def test_code_of_a_folder_runs_only_if_it_is_trusted(stranger, trusted):
    if trusted:
        trust(stranger)

    async def work():
        async with serving(stranger) as client:
            text = "machine m\n\ninitial a\n\nstate a\n    on \n\nfinal b\n"
            document = opened(client, stranger / "m.maze-machine", text)
            at = {"text_document": document, "position": types.Position(5, 7)}
            found = await client.text_document_completion_async(types.CompletionParams(**at))
            assert ("knock" in {one.label for one in found}) == trusted
            assert (stranger / "ran").exists() == trusted
            assert any("is not trusted" in one for one in client.messages) != trusted

    served(work())


def test_completion_replaces_what_was_typed(tmp_path):
    async def work():
        async with serving(tmp_path) as client:
            text = "machine m\n\ninitial a\n\nstate a\n    when space.l\n\nfinal b\n"
            document = opened(client, tmp_path / "m.maze-machine", text)
            at = {"text_document": document, "position": types.Position(5, 16)}
            found = await client.text_document_completion_async(types.CompletionParams(**at))
            assert [one.label for one in found] == ["space.left"]
            assert found[0].text_edit.range == types.Range(types.Position(5, 9), types.Position(5, 16))

    served(work())


@pytest.mark.parametrize("long", [0.0, 1.0])
def test_a_check_that_takes_long_is_shown_as_work_in_progress(tmp_path, long):
    run = f"from hsm.dsl.lsp import machine_server\nmachine_server.LONG = {long}\n"
    run += "from maze_machine.commands.lsp import lsp\nlsp()"

    async def work():
        async with serving(tmp_path, command=[sys.executable, "-c", run]) as client:
            document = opened(client, tmp_path / "m.maze-machine", "machine m\n\ninitial a\n\nfinal b\n")
            for _ in range(2):
                report = await client.text_document_diagnostic_async(types.DocumentDiagnosticParams(document))
                assert [one.code for one in report.items] == ["E0201"]
            shown = [kind for _, kind in client.progress]
            assert shown == ([] if long else ["created", "begin", "end"] * 2)
            assert len({token for token, _ in client.progress}) == len(shown) / 3

    served(work())


def test_requests_that_are_cancelled_are_not_done(tmp_path):
    async def work():
        async with serving(tmp_path) as client:
            document = opened(client, tmp_path / "m.maze-machine", "machine m\n\ninitial a\n\nfinal b\n")
            asked = types.DocumentDiagnosticParams(document)
            await client.text_document_diagnostic_async(asked)
            sent = []
            for number in range(20):
                asked_again = client.protocol.send_request(types.TEXT_DOCUMENT_DIAGNOSTIC, asked, msg_id=f"n{number}")
                sent.append(asyncio.wrap_future(asked_again))
                if number < 19:
                    client.protocol.notify(types.CANCEL_REQUEST, types.CancelParams(f"n{number}"))
            answers = await asyncio.gather(*sent, return_exceptions=True)
            cancelled = [one for one in answers if isinstance(one, JsonRpcRequestCancelled)]
            assert cancelled  # those that were not begun
            reports = [one for one in answers if isinstance(one, types.RelatedFullDocumentDiagnosticReport)]
            assert len(cancelled) + len(reports) == 20
            assert [one.code for one in answers[-1].items] == ["E0201"]
            assert client.errors == []

    served(work())


def test_nothing_is_kept_of_notifications(tmp_path):
    async def work():
        server = make_server(lambda _: robot_library(), "1")
        handled = asyncio.Event()

        async def later(_params):
            handled.set()

        server.protocol._execute_handler("one", later, lambda _: None, args=(None,))
        server.protocol._execute_handler("two", lambda _params: None, lambda _: None, args=(None,))
        await handled.wait()
        await asyncio.sleep(0)
        assert server.protocol._request_futures == {}

    served(work())
