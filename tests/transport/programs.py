"""Programs under test: started, listened to with a deadline, and always ended."""

from __future__ import annotations

import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent
LIMIT = 60.0
"""Nothing that is waited for takes longer, s."""


class Program:
    """A process whose lines are read as they come."""

    def __init__(self, *arguments: str, cwd: Path | None = None) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-u", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=cwd
        )
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        for line in self.process.stdout:
            self._lines.put(line.rstrip("\n"))
        self._lines.put(None)

    def line(self, limit: float = LIMIT) -> str:
        """The next line that it prints."""
        try:
            line = self._lines.get(timeout=limit)
        except queue.Empty:
            raise AssertionError(f"{self.process.args} printed nothing for {limit} s") from None
        if line is None:
            raise AssertionError(f"{self.process.args} ended: {self.process.stderr.read()}")
        return line

    def until(self, start: str, limit: float = LIMIT) -> str:
        """The next line that begins so."""
        deadline = time.monotonic() + limit
        while not (line := self.line(deadline - time.monotonic())).startswith(start):
            pass
        return line

    def send(self, number: signal.Signals) -> float:
        """Send a signal; when."""
        now = time.monotonic()
        self.process.send_signal(number)
        return now

    def end(self, limit: float = LIMIT) -> int:
        """Wait for its end; its exit status."""
        return self.process.wait(limit)

    def errors(self) -> str:
        """What it said on standard error, once it has ended."""
        return self.process.stderr.read()


@contextmanager
def program(*arguments: str, cwd: Path | None = None) -> Iterator[Program]:
    """A program that is killed at the end of the block if it still runs."""
    started = Program(*arguments, cwd=cwd)
    try:
        yield started
    finally:
        started.process.kill()
        started.process.wait(LIMIT)
        started._reader.join(LIMIT)
        started.process.stdout.close()
        started.process.stderr.close()


@dataclass(frozen=True)
class Told:
    """What a toy's base was told, and when, on the monotonic clock."""

    at: float
    moving: bool
    twist: tuple[float, float, float]


def told(robot: Program) -> Told:
    """The next thing that a toy's base was told."""
    # Verdicts on episodes are lines too.
    while len(line := robot.line().split()) != 5:
        pass
    at, moving, *twist = map(float, line)
    return Told(at, bool(moving), tuple(twist))


def base(robot: Program, moving: bool, after: float = 0.0) -> float:
    """When a toy's base was told to move, or to stand, first after a moment."""
    while True:
        order = told(robot)
        if order.moving == moving and order.at >= after:
            return order.at


def toy(name: str, *arguments: str) -> object:
    """One of the toy programs beside this file."""
    return program(str(HERE / f"{name}.py"), *arguments)


# Whoever starts tests in the background has Ctrl-C ignored, and so would they.
_COMMAND = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)
from maze_machine.cli import main
main()
"""


def command(*arguments: str, cwd: Path | None = None) -> object:
    """``maze-machine`` with arguments."""
    return program("-c", _COMMAND, *arguments, cwd=cwd)
