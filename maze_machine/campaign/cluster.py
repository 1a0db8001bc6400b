"""Run the jobs of a campaign on a dask.distributed cluster."""

from __future__ import annotations

import asyncio
import logging
import re
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from functools import partial
from typing import TYPE_CHECKING

from maze_machine.campaign.jobs import Job, Record, Setup, crashed, run_job
from maze_machine.errors import CommandError, ExitStatus, UsageError, missing_package

if TYPE_CHECKING:
    from distributed import Client, Future

FIRST, AGAIN = 10.0, 60.0
"""The timeout for connecting to a scheduler: when a campaign begins, and after it was lost, s."""
_ADDRESS = re.compile(r"((?P<scheme>tcp|tls|ws|wss)://)?(\[[0-9A-Fa-f:.%\w]+\]|[\w.-]+):(?P<port>[0-9]+)")
FRUITLESS = 5
"""How often in a row a scheduler may be lost without a result in between."""


class ClusterError(CommandError):
    """The cluster cannot be used."""

    status = ExitStatus.UNREACHABLE


@contextmanager
def on_cluster(setup: Setup, jobs: Iterable[Job], address: str) -> Generator[Iterator[Record]]:
    """Do jobs like ``on_cores``, on a running dask.distributed cluster that has this project installed.

    Dask gives the jobs of a dead worker to another one; a job that kills several workers has the outcome ``crashed``.
    If the scheduler is lost and comes back, the unfinished jobs are submitted again.

    Raises:
        UsageError: dask is not installed, or the address is none of a scheduler. ClusterError: no scheduler answers,
            or it is lost for good.
    """
    clients = [_client(_checked(address), FIRST)]
    with _quiet():
        try:
            yield _records(clients, setup, list(jobs), address)
        finally:
            with suppress(Exception):  # a scheduler that is gone needs no message
                clients[-1].close(timeout=2)


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence dask's loggers, which print a traceback for every lost connection."""
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] == "distributed"]
    levels = {logger: logger.level for logger in map(logging.getLogger, names)}
    for logger in levels:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in levels.items():
            logger.setLevel(level)


def _checked(address: str) -> str:
    """The address itself, if it is one of a scheduler.

    Raises:
        UsageError: it is not.
    """
    found = _ADDRESS.fullmatch(address)
    if found is None or len(found["port"]) > 5 or not 0 < int(found["port"]) < 2**16:
        raise UsageError(f"`{address}` is not the address of a scheduler", "write HOST:PORT, such as 127.0.0.1:8786")
    return address


def _client(address: str, patience: float) -> Client:
    try:
        from distributed import Client, Security  # noqa: PLC0415 - an extra
    except ImportError:
        raise missing_package("--scheduler", "dask.distributed", "cluster") from None
    if address.startswith(("tls:", "wss:")) and Security().get_connection_args("client").get("ssl_context") is None:
        raise UsageError(f"{address} needs certificates", "name them in dask's `distributed.comm.tls`")
    try:
        return Client(address, timeout=patience, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ClusterError(f"no scheduler at {address}: {error}") from None


def _records(clients: list[Client], setup: Setup, jobs: list[Job], address: str) -> Iterator[Record]:
    """The results as they arrive; the last of the clients is the one in use."""
    left, fruitless = dict.fromkeys(jobs), 0
    while left:
        before = len(left)
        for job, record in _round(clients[-1], setup, list(left)):
            del left[job]
            yield record
        if not left:
            return
        fruitless = fruitless + 1 if len(left) == before else 0
        if fruitless == FRUITLESS:
            raise ClusterError(f"the scheduler at {address} was lost repeatedly", "start the sweep again later")
        with suppress(Exception):
            clients[-1].close(timeout=2)
        clients.append(_client(address, AGAIN))


def _round(client: Client, setup: Setup, jobs: list[Job]) -> Iterator[tuple[Job, Record]]:
    """The results of jobs, except for those whose scheduler was lost."""
    from distributed import as_completed  # noqa: PLC0415 - an extra

    futures = client.map(partial(run_job, setup), jobs, pure=False)
    job_of = dict(zip((future.key for future in futures), jobs, strict=True))
    try:
        for future in as_completed(futures, loop=client.loop):
            # With `with_results` dask would wait for ever for a result that was on its way when the scheduler died.
            record = None
            with suppress(OSError, asyncio.CancelledError, CancelledError):
                record = _record(future, job_of[future.key])
            if record is not None:
                yield job_of[future.key], record
    finally:
        with suppress(Exception):
            client.cancel(futures, force=True)


def _record(future: Future[Record], job: Job) -> Record | None:
    """The result of a job that has ended, or nothing if dask dropped it.

    Raises:
        OSError, CancelledError: the scheduler was lost on the way.
    """
    if future.status == "finished":
        record: Record = future.result(timeout=AGAIN)
        return record
    if future.status == "error":
        return crashed(job, _reason(future.exception(timeout=AGAIN)))
    return None


def _reason(error: BaseException) -> str:
    """Why dask dropped a job."""
    if type(error).__name__ == "KilledWorker":
        return "several workers of the cluster died while running it"
    return f"{type(error).__name__}: {error}"
