"""Requests to the language server beyond the protocol; their methods begin with ``maze-machine/``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING, Any

from lsprotocol import types

from hsm.dsl.lsp.machine_server import MachineServer
from hsm.dsl.syntax.sources import SUFFIX
from maze_machine.editor.libraries import EditorLibraries
from maze_machine.editor.pages import code_pages
from maze_machine.editor.settings import SECTION, read_settings, too_old

if TYPE_CHECKING:
    from maze_machine.editor.coverage import TestedStates
    from maze_machine.editor.diagram import PictureJson
    from maze_machine.editor.live import LiveRun
    from maze_machine.editor.scenarios import ScenarioDocument

TESTS = ".maze-test"
"""The suffix of scenario files."""
WATCHED = ("**/*.maze-machine", "**/*.maze-test", "**/maze-machine.toml", "**/pyproject.toml", "**/*.py")
"""The files to watch for changes."""
DIAGRAM = "maze-machine/diagram"
"""Request with ``uri``: the picture of a file."""
WATCH = "maze-machine/watch"
"""Notification with ``endpoint`` and ``robot``: begin to relay a run."""
UNWATCH = "maze-machine/unwatch"
"""Notification: stop relaying it."""
STEP = "maze-machine/step"
"""Notification of the server: the active states of the run that is watched."""


def add_requests(server: MachineServer, libraries: EditorLibraries, version: str) -> None:
    """Register them with a language server, and read the editor's trust setting at the start.

    Args:
        server: the server.
        libraries: the libraries of its files.
        version: of this program.
    """
    started = _Started(version)

    def notify(news: Mapping[str, Any]) -> None:
        server.protocol.notify(STEP, news)

    @cache
    def live() -> LiveRun:
        from maze_machine.editor.live import LiveRun  # noqa: PLC0415 - the server starts without the network
        from maze_machine.remote.reaching import reaching  # noqa: PLC0415

        return LiveRun(partial(reaching, identity=None), notify)

    server.forget_libraries = libraries.refresh
    server.other_language = _Scenarios(libraries)
    server.ignored = libraries.ignored
    server.pages = code_pages()

    @cache
    def tested() -> TestedStates:
        from maze_machine.editor.coverage import TestedStates  # noqa: PLC0415 - the server starts without tests

        return TestedStates()

    def run_tests(file: str) -> None:
        if not libraries.settings.coverage:
            return
        machine = file.removesuffix(TESTS) + SUFFIX if file.endswith(TESTS) else file
        tested().run(machine, libraries(machine))
        capable = server.client_capabilities.workspace
        if capable is not None and capable.code_lens is not None and capable.code_lens.refresh_support:
            server.workspace_code_lens_refresh(None)

    server.run_tests = run_tests
    server.tested = lambda file: tested().texts(file) if libraries.settings.coverage else {}
    server.started = partial(_ask_settings, server, libraries, started)

    @server.feature(DIAGRAM)
    def draw(params: Any) -> PictureJson:
        from maze_machine.editor.diagram import diagram  # noqa: PLC0415 - the server starts without pictures

        return diagram(server.document(params.uri))

    @server.feature(WATCH)
    def watch(params: Any) -> None:
        live().start(params.endpoint, params.robot)

    @server.feature(UNWATCH)
    def unwatch(_params: Any) -> None:
        live().stop()

    @server.feature(types.INITIALIZE)
    def initialize(params: types.InitializeParams) -> None:
        started.options = params.initialization_options
        libraries.settings = read_settings(started.options, None)

    @server.feature(types.SHUTDOWN)
    def shutdown(_params: None) -> None:
        if live.cache_info().currsize:
            live().stop()


@dataclass(frozen=True, slots=True)
class _Scenarios:
    """The language of scenarios."""

    libraries: EditorLibraries
    suffix = TESTS

    def file(self, name: str, text: str, opened: Mapping[str, str]) -> ScenarioDocument:
        """A file of scenarios as it is in the editor."""
        from maze_machine.editor.scenarios import ScenarioDocument  # noqa: PLC0415 - nor does it wait for tests

        return ScenarioDocument(text, name, self.libraries(name), opened)


@dataclass(slots=True)
class _Started:
    """The properties of an editor, known from its start."""

    version: str
    options: object = None
    watching: bool = False


async def _ask_settings(server: MachineServer, libraries: EditorLibraries, started: _Started) -> None:
    """Ask the editor for its settings and to watch files, as far as it can do that."""
    capable = server.client_capabilities.workspace
    configuration = None
    if capable is not None and capable.configuration:
        asked = types.ConfigurationParams([types.ConfigurationItem(section=SECTION)])
        configuration = next(iter(await server.workspace_configuration_async(asked)), None)
    libraries.settings = settings = read_settings(started.options, configuration)
    libraries.refresh()
    server.hints = settings.hints
    if too_old(started.version, settings.requires):
        message = (
            f"the editor's extension needs maze-machine {settings.requires}, and this is {started.version}: "
            "update it with pip install --upgrade maze-machine"
        )
        server.window_show_message(types.ShowMessageParams(types.MessageType.Warning, message))
    watching = capable.did_change_watched_files if capable is not None else None
    if watching is not None and watching.dynamic_registration and not started.watching:
        started.watching = True
        watchers = types.DidChangeWatchedFilesRegistrationOptions([types.FileSystemWatcher(one) for one in WATCHED])
        registered = types.Registration("watched", types.WORKSPACE_DID_CHANGE_WATCHED_FILES, watchers)
        await server.client_register_capability_async(types.RegistrationParams([registered]))
