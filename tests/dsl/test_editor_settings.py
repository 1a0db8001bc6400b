"""What an editor sets, and what the server tells it of its files' surroundings."""

import asyncio
import sys
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from lsprotocol import types

from maze_machine.editor.settings import read_settings, too_old
from tests.dsl.test_server import Client, opened

MACHINE = """machine ring

initial waiting

state waiting
    when door.near -> ringing

state ringing
    do ring()
    on accepted -> waiting
    on refused  -> waiting
    after 9 s   -> waiting
"""
TEST = """test ring

scenario it rings
    when door.near
    expect ringing
    when ring reports accepted, not door.near
    expect waiting
"""


def test_the_configuration_wins_over_the_options_of_the_start():
    both = read_settings(
        {"library": "one:ONE", "inlayHints": False, "ignore": ["N07"], "trusted": True, "requires": "9.1"},
        {"library": "two:TWO", "inlayHints": None, "ignore": ["W0505", "N07"], "trusted": False},
    )
    assert (both.library, both.hints, both.ignore) == ("two:TWO", False, ("N07", "W0505"))
    assert both.trusted is True  # a folder's settings cannot say that the folder is trusted


@pytest.mark.parametrize("given", [None, 3, [], {"library": 4, "ignore": "N", "inlayHints": "no", "requires": []}])
def test_what_is_not_of_its_type_is_passed_over(given):
    assert read_settings(given, given) == read_settings(None, None)


@pytest.mark.parametrize(
    ("version", "required", "old"),
    [("0.1.0", "0.2", True), ("0.2.0.dev1", "0.2", False), ("1.10", "1.9", False), ("1", "", False)],
)
def test_versions(version, required, old):
    assert too_old(version, required) is old


@asynccontextmanager
async def configured(folders, configuration, options=None):
    """A server with an editor that has settings, watches files and has several folders."""
    client = Client()
    client.registered = []
    client.refreshed = asyncio.Event()

    @client.feature(types.WORKSPACE_CONFIGURATION)
    def configure(params):
        assert [one.section for one in params.items] == ["maze-machine"]
        return [configuration]

    @client.feature(types.CLIENT_REGISTER_CAPABILITY)
    def register(params):
        client.registered += params.registrations

    @client.feature(types.WORKSPACE_CODE_LENS_REFRESH)
    def refreshed(_params):
        client.refreshed.set()

    await client.start_io(str(Path(sys.executable).parent / "maze-machine"), "lsp")
    able = types.ClientCapabilities(
        workspace=types.WorkspaceClientCapabilities(
            configuration=True,
            did_change_watched_files=types.DidChangeWatchedFilesClientCapabilities(dynamic_registration=True),
            code_lens=types.CodeLensWorkspaceClientCapabilities(refresh_support=True),
            workspace_folders=True,
        ),
        text_document=types.TextDocumentClientCapabilities(diagnostic=types.DiagnosticClientCapabilities()),
    )
    listed = [types.WorkspaceFolder(one.as_uri(), one.name) for one in folders]
    answer = await client.initialize_async(
        types.InitializeParams(able, initialization_options=options, workspace_folders=listed)
    )
    client.server_info = answer.server_info
    client.initialized(types.InitializedParams())
    try:
        yield client
    finally:
        await client.shutdown_async(None)
        client.exit(None)
        await client.stop()


async def codes(client, document):
    report = await client.text_document_diagnostic_async(types.DocumentDiagnosticParams(document))
    return [one.code for one in report.items]


def served(work):
    asyncio.run(asyncio.wait_for(work(), 60))


def test_settings_watching_coverage_and_a_handshake(tmp_path):
    path = tmp_path / "ring.maze-machine"
    path.write_text(MACHINE, encoding="utf-8")
    path.with_suffix(".maze-test").write_text(TEST, encoding="utf-8")

    async def work():
        async with configured([tmp_path], {"ignore": ["N", "W"]}, {"requires": "99.0"}) as client:
            assert client.server_info.version
            while not client.registered or not client.messages:
                await asyncio.sleep(0)
            globs = [one["globPattern"] for one in client.registered[0].register_options["watchers"]]
            assert "**/*.py" in globs
            assert "needs maze-machine 99.0" in client.messages[0]
            document = opened(client, path, MACHINE.replace("after 9 s   -> waiting", "when door.near -> waiting"))
            assert await codes(client, document) == []  # what there would be is not to be shown
            await client.refreshed.wait()
            lenses = await client.text_document_code_lens_async(types.CodeLensParams(document))
            titles = {one.range.start.line: one.command.title for one in lenses if one.range.start.line}
            assert titles[4] == "entered 2 times, 1 of 1 transitions taken"
            assert titles[7] == "entered 1 time, 1 of 3 transitions taken"
            assert client.errors == []

    served(work)


def test_several_folders_each_with_a_project_of_its_own(tmp_path):
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        (folder / f"{name}.maze-machine").write_text(MACHINE.replace("machine ring", f"machine {name}"))
    (tmp_path / "two" / "maze-machine.toml").write_text('ignore = ["N", "W"]\n')
    text = MACHINE.replace("    after 9 s   -> waiting\n", "").replace("    on refused  -> waiting\n", "")

    async def work():
        async with configured([tmp_path / "one", tmp_path / "two"], None) as client:
            documents = [opened(client, tmp_path / one / f"{one}.maze-machine", text) for one in ("one", "two")]
            assert [bool(await codes(client, one)) for one in documents] == [True, False]
            symbols = await client.workspace_symbol_async(types.WorkspaceSymbolParams("waiting"))
            assert {Path(one.location.uri).parent.name for one in symbols} == {"one", "two"}
            assert client.errors == []

    served(work)


def test_a_library_that_is_edited_elsewhere_is_imported_anew(tmp_path):
    (tmp_path / "maze-machine.toml").write_text('library = "watched_lamp:LIBRARY"\n')
    source = (
        "from hsm import Library\nprint('a library that prints')\nLIBRARY = Library('lamp')\n\n\n"
        "@LIBRARY.signal('{}')\ndef signal(facts) -> bool:\n    '''A signal.'''\n    return True\n"
    )
    library = tmp_path / "watched_lamp.py"
    library.write_text(source.format("dark"))
    path = tmp_path / "lamp.maze-machine"
    text = "machine lamp\n\ninitial off\n\nstate off\n    when gloomy -> on_\n\nstate on_\n    when not gloomy -> off\n"
    path.write_text(text)

    async def work():
        async with configured([tmp_path], None, {"trusted": True}) as client:
            document = opened(client, path, text)
            assert "E0202" in await codes(client, document) or await codes(client, document)
            library.write_text(source.format("gloomy") + "# longer\n")
            changed = [types.FileEvent(library.as_uri(), types.FileChangeType.Changed)]
            client.workspace_did_change_watched_files(types.DidChangeWatchedFilesParams(changed))
            assert [one for one in await codes(client, document) if one.startswith("E")] == []
            assert client.errors == []

    served(work)


def test_a_line_is_laid_out_when_it_is_ended(tmp_path):
    path = tmp_path / "ring.maze-machine"
    text = MACHINE.replace("    do ring()\n", "    do   ring()\n\n")

    async def work():
        async with configured([tmp_path], None) as client:
            document = opened(client, path, text)
            asked = types.DocumentOnTypeFormattingParams(
                document, types.Position(9, 0), "\n", types.FormattingOptions(4, insert_spaces=True)
            )
            edits = await client.text_document_on_type_formatting_async(asked)
            assert [(one.range.start.line, one.new_text) for one in edits] == [(8, "    do ring()")]
            assert client.errors == []

    served(work)


def test_each_code_of_a_diagnostic_leads_to_its_page(tmp_path):
    path = tmp_path / "ring.maze-machine"

    async def work():
        async with configured([tmp_path], None) as client:
            document = opened(client, path, MACHINE.replace("-> ringing", "-> rining"))
            report = await client.text_document_diagnostic_async(types.DocumentDiagnosticParams(document))
            page, _, line = report.items[0].code_description.href.partition("#L")
            explained = Path(page.removeprefix("file://")).read_text(encoding="utf-8").splitlines()[int(line) - 1]
            assert explained.startswith(f"### {report.items[0].code}: ")

    served(work)
