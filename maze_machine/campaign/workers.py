"""Run the jobs of a campaign on the cores of this computer, in isolated processes."""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess

from maze_machine.campaign.jobs import Job, Record, Setup, crashed, run_job
from maze_machine.errors import CommandError, ExitStatus

ATTEMPTS = 2
"""How often a job is tried if its process dies: the cause may be something other than the job."""


STARTS = 5
"""How many processes in a row may die before they are ready."""


_NEEDED = ["maze_machine.campaign.workers", "hsm.dsl.loading", "perception.signals", "skills.catalogue"]
"""The modules that a job needs, with what they import."""


class WorkerError(CommandError):
    """No process can be started to do the jobs."""

    status = ExitStatus.FAILED


@contextmanager
def on_cores(setup: Setup, jobs: Iterable[Job], workers: int) -> Generator[Iterator[Record]]:
    """Do jobs in that many processes: a context in which the results come as they are ready.

    A process that dies is replaced; a job whose process has died twice has the outcome ``crashed``. Leaving the context
    before the last result, also by Ctrl-C, drops unfinished jobs; no process remains, even if this process is killed.

    Raises:
        WorkerError: no process can be started.
    """
    crew = _Crew(setup, deque(jobs), workers)
    try:
        yield crew.records()
    finally:
        crew.dismiss()


class _Worker:
    """One process with its own pipe, which does one job at a time."""

    def __init__(self, context: BaseContext, setup: Setup) -> None:
        self.pipe, theirs = context.Pipe()
        self.job: Job | None = None
        self.ready = False
        self._process: BaseProcess = context.Process(target=_work, args=(setup, theirs), daemon=True)  # type: ignore[attr-defined]
        self._process.start()
        theirs.close()

    def give(self, job: Job) -> None:
        """Send it a job; if it has died, reading the answer reports it."""
        self.job = job
        with suppress(OSError):
            self.pipe.send(job)

    def died(self) -> str:
        """How a process whose pipe has closed ended."""
        self._process.join(5.0)
        self.end()
        code = self._process.exitcode or 0
        return f"killed by {signal.Signals(-code).name}" if code < 0 else f"ended with status {code}"

    def end(self) -> None:
        """Close the process and the pipe."""
        self._process.kill()
        self._process.join()
        self.pipe.close()


class _Crew:
    """The processes at work, and the jobs that wait for one."""

    def __init__(self, setup: Setup, waiting: deque[Job], size: int) -> None:
        self._setup, self._waiting = setup, waiting
        self._context = _clean_context()
        self._tried: dict[Job, int] = {}
        self._failed_starts = 0
        self._workers = [_Worker(self._context, setup) for _ in range(min(size, len(waiting)))]

    def records(self) -> Iterator[Record]:
        """The results, as they are ready."""
        while self._workers:
            ready = wait([worker.pipe for worker in self._workers])
            for worker in [worker for worker in self._workers if worker.pipe in ready]:
                try:
                    answer = worker.pipe.recv()
                except (EOFError, OSError):
                    record = self._replaced(worker)
                else:
                    record = answer if worker.ready else None
                    worker.ready, worker.job, self._failed_starts = True, None, 0
                    self._employ(worker)
                if record is not None:
                    yield record

    def _employ(self, worker: _Worker) -> None:
        """Give a worker the next job, or stop it."""
        if self._waiting:
            worker.give(self._waiting.popleft())
        else:
            self._workers.remove(worker)
            worker.end()

    def _replaced(self, worker: _Worker) -> Record | None:
        """Replace a dead process; return the record of its job if that is not tried again."""
        how, job = worker.died(), worker.job
        self._workers.remove(worker)
        if not worker.ready:
            self._failed_starts += 1
            if self._failed_starts == STARTS:
                raise WorkerError(f"no worker can be started: the last one {how}", "is there enough memory?")
        record = None
        if job is not None:
            self._tried[job] = self._tried.get(job, 0) + 1
            if self._tried[job] < ATTEMPTS:
                self._waiting.appendleft(job)
            else:
                record = crashed(job, f"the process was {how}" if how.startswith("killed") else f"the process {how}")
        if self._waiting:
            self._workers.append(_Worker(self._context, self._setup))
        return record

    def dismiss(self) -> None:
        """End all processes."""
        for worker in self._workers:
            worker.end()
        self._workers.clear()


def _clean_context() -> BaseContext:
    """How a worker is started so that it inherits no thread, socket or lock of this process.

    Where the platform has it, a server that has imported what the jobs need, and nothing else, forks each worker in
    some 10 ms; else each worker is a fresh interpreter, which imports all of it again.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(_NEEDED)
    return context


def _work(setup: Setup, pipe: Connection) -> None:
    """Do jobs until the pipe is closed; a worker ends silently on Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    gc.freeze()
    pipe.send("ready")
    while True:
        try:
            job: Job = pipe.recv()
            pipe.send(run_job(setup, job))
        except (EOFError, OSError):
            return


def _end_with_parent() -> None:
    """Wait for the end of the process that started this one, and end at once."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
