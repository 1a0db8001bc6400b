"""Who does the jobs of a campaign: this machine's cores, or a cluster."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from functools import partial

from maze_machine.campaign.jobs import Job, Record, Setup, run_job
from maze_machine.errors import CommandError, ExitStatus


class ClusterError(CommandError):
    """The cluster cannot be used."""

    status = ExitStatus.UNREACHABLE


@contextmanager
def on_cores(setup: Setup, jobs: Iterable[Job], workers: int) -> Generator[Iterator[Record]]:
    """Do jobs in so many processes: a context in which the results come as they are ready.

    Who leaves it before the last one, by Ctrl-C too, throws away what has been begun: no process stays behind.
    """
    # A fresh interpreter for each worker: no thread, socket or lock of this process is inherited.
    context = multiprocessing.get_context("spawn")
    others = multiprocessing.active_children()
    with ProcessPoolExecutor(workers, mp_context=context, initializer=_quiet) as pool:
        try:
            futures = [pool.submit(run_job, setup, job) for job in jobs]
            yield (future.result() for future in as_completed(futures))
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
            begun = [process for process in multiprocessing.active_children() if process not in others]
            for process in begun:
                process.terminate()
            for process in begun:
                process.join()


def _quiet() -> None:
    """A worker ends without a word when the user presses Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextmanager
def on_cluster(setup: Setup, jobs: Iterable[Job], address: str) -> Generator[Iterator[Record]]:
    """Do jobs as ``on_cores`` does on a dask.distributed cluster that runs already and has this project installed.

    Raises:
        ClusterError: dask is not installed, or no scheduler answers.
    """
    try:
        from distributed import Client  # noqa: PLC0415 - an extra
        from distributed import as_completed as as_they_come  # noqa: PLC0415
    except ImportError:
        raise ClusterError("--scheduler needs dask.distributed", "pip install 'maze-machine[cluster]'") from None
    try:
        client = Client(address, timeout="10s")
    except (OSError, ValueError) as error:
        raise ClusterError(f"no scheduler at {address}: {error}") from None
    with client:
        futures = client.map(partial(run_job, setup), list(jobs), pure=False)
        try:
            yield (record for _, record in as_they_come(futures, with_results=True))
        finally:
            client.cancel(futures)
