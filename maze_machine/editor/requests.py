"""What the language server answers beyond the protocol; the names of its methods begin with ``maze-machine/``."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, partial
from typing import TYPE_CHECKING, Any

from lsprotocol import types

from hsm.dsl.lsp.server import MachineServer
from maze_machine.editor.libraries import EditorLibraries

if TYPE_CHECKING:
    from maze_machine.editor.diagram import PictureJson
    from maze_machine.editor.live import LiveRun
    from maze_machine.editor.scenarios import ScenarioDocument

TESTS = ".maze-test"
"""What the names of files with scenarios end with."""
DIAGRAM = "maze-machine/diagram"
"""Request with ``uri``: the picture of a file."""
WATCH = "maze-machine/watch"
"""Notification with ``endpoint`` and ``robot``: begin to relay a run."""
UNWATCH = "maze-machine/unwatch"
"""Notification: relay it no more."""
STEP = "maze-machine/step"
"""Notification of the server: the active states of the run that is watched."""


def add_requests(server: MachineServer, libraries: EditorLibraries) -> None:
    """Have a language server answer them, and heed what the editor says of trust when it starts.

    Args:
        server: the server.
        libraries: what its files are checked against.
    """

    def notify(news: Mapping[str, Any]) -> None:
        server.protocol.notify(STEP, news)

    @cache
    def live() -> LiveRun:
        from maze_machine.editor.live import LiveRun  # noqa: PLC0415 - the server starts without the network
        from maze_machine.remote.reaching import reaching  # noqa: PLC0415

        return LiveRun(partial(reaching, identity=None), notify)

    def scenarios(file: str, text: str, opened: Mapping[str, str]) -> ScenarioDocument | None:
        if not file.endswith(TESTS):
            return None
        from maze_machine.editor.scenarios import ScenarioDocument  # noqa: PLC0415 - nor does it wait for tests

        return ScenarioDocument(text, file, libraries(file), opened)

    server.forget_libraries = libraries.refresh
    server.other_language = scenarios

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
        options = params.initialization_options
        libraries.trusted = options.get("trusted") if isinstance(options, dict) else None

    @server.feature(types.SHUTDOWN)
    def shutdown(_params: None) -> None:
        if live.cache_info().currsize:
            live().stop()
