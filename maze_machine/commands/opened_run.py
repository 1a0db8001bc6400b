"""A run that others see and operate while it runs: over the network, on a page, or both."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from maze_machine.errors import UsageError

if TYPE_CHECKING:
    from maze_machine.drive.mission import Mission, TickWatcher
    from maze_machine.remote.operated import OperatedRun
    from maze_machine.simulated.world import SimulatedWorld
    from maze_machine.view.drawings import Drawings
    from maze_machine.view.live import LivePage

GRACE = 3.0
"""A page that was closed for that long is not being reloaded, s."""


@dataclass(frozen=True, slots=True)
class Openings:
    """How a run is open to others.

    Attributes:
        endpoint: where it listens on the network; None for not at all.
        identity: the folder with the certificates for it.
        view: whether it is shown on a page.
        host: where the page is served.
        port: the page's port; 0 for any that is free.
        watched: whether a person watches: a simulation then keeps real time where nothing else is said.
    """

    endpoint: str | None
    identity: Path | None
    view: bool
    host: str
    port: int
    watched: bool = False


@contextmanager
def opened_run(
    openings: Openings, mission: Mission, world: SimulatedWorld | None, speed: float | None
) -> Iterator[tuple[OperatedRun, Sequence[TickWatcher]]]:
    """The operator of a run and the watchers that show it, for as long as the block runs.

    Where it is shown on a page, this waits for a browser before it begins, and at the end until the page is closed.

    Args:
        openings: how it is open to others.
        mission: the run.
        world: where it takes place, if that is in this process.
        speed: the pace of a simulation as a multiple of real time; None for real time where a person watches.

    Raises:
        LinkError: the endpoint is taken.
        UsageError: the page's port is taken.
    """
    from maze_machine.remote.operated import OperatedRun

    pace = 1.0 if speed is None and openings.watched and world is not None else speed
    operated = OperatedRun(mission, pausable=world is not None, speed=pace)
    if openings.endpoint is None and not openings.view:
        yield operated, (operated,)
        return
    from maze_machine.report.pages import run_head
    from maze_machine.view.drawings import Drawings

    head, drawings = run_head(mission, world), Drawings(mission.machine)
    with ExitStack() as stack:
        watchers: list[TickWatcher] = []
        if openings.endpoint is not None:
            watchers.append(stack.enter_context(_on_network(openings, mission, operated, head, drawings)))
        if openings.view:
            watchers.append(stack.enter_context(_on_page(openings, operated, head, drawings)))
        yield operated, (*watchers, operated)


@contextmanager
def _on_network(
    openings: Openings, mission: Mission, operated: OperatedRun, head: dict[str, Any], drawings: Drawings
) -> Iterator[TickWatcher]:
    from maze_machine.arguments.network import secured
    from maze_machine.remote.opened import OpenRun
    from maze_machine.report.pages import network_head
    from transport.connect import listening

    endpoint = str(openings.endpoint)
    security = secured(endpoint, openings.identity, mission.profile.link, listens=True)
    told = network_head(head, drawings)
    with listening(endpoint, security=security) as bus, OpenRun(bus, mission, operated, told) as opened:
        yield opened


@contextmanager
def _on_page(
    openings: Openings, operated: OperatedRun, head: dict[str, Any], drawings: Drawings
) -> Iterator[TickWatcher]:
    from maze_machine.report.pages import ShownRun
    from maze_machine.view.live import SimulatedTime

    page = served(
        openings.host,
        openings.port,
        head,
        operate=operated.answer,
        drawn=drawings.drawn,
        simulation=lambda: SimulatedTime(operated.pausable, operated.paused),
    )
    with page:
        announce(page)
        print("the run begins when a browser shows the page; Ctrl-C cancels it", file=sys.stderr, flush=True)
        page.seen.wait()
        try:
            yield ShownRun(page.publish, page.end)
        except Exception as error:  # the page says it, too; a world that waits for its controller is at rest
            page.end({"line": str(error), "solved": False, "at_rest": operated.pausable})
            linger(page)
            raise
        linger(page)


def served(host: str, port: int, head: dict[str, Any], **what: Any) -> LivePage:
    """A page's server, not yet begun.

    Raises:
        UsageError: the port is taken, or the host is not an address of this computer.
    """
    from maze_machine.view.live import LivePage

    try:
        return LivePage(head, port, host=host, **what)
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise UsageError(f"--host {host} --port {port}: {reason}", "port 0 takes any") from None


def announce(page: LivePage) -> None:
    """Print the page's address, and open it where a person sits before this computer."""
    print(f"page: {page.address}", file=sys.stderr, flush=True)
    if sys.stderr.isatty() and sys.stdin.isatty():
        import webbrowser

        webbrowser.open(page.address)


def linger(page: LivePage) -> None:
    """Keep a page that has come to its end until nobody shows it any more."""
    print("the page stays until you close it or press Ctrl-C", file=sys.stderr, flush=True)
    page.wait_until_closed(GRACE)
