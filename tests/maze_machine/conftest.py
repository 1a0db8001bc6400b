"""Real processes of the command line, and ports that nobody else uses."""

import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

BIN = Path(sys.executable).parent
LIMIT = 60.0
ROOT = Path(__file__).parents[2]


@pytest.fixture
def driving(start, tmp_path):
    """Start a run and wait until the robot drives, which its trace shows."""

    def run(*arguments):
        trace = tmp_path / "driving.jsonl"
        process = start("run", *arguments, "--trace", trace, "--no-picture")
        deadline = time.monotonic() + LIMIT
        while not (trace.exists() and trace.stat().st_size > 0):
            assert time.monotonic() < deadline, "waited too long"
            assert process.poll() is None, process.stderr.read()
            time.sleep(0.01)
        return process

    return run


@pytest.fixture
def start(tmp_path):
    """Start ``maze-machine`` in a folder of the test's own; whatever still runs is killed at the end."""
    started = []

    def run(*arguments, program=(BIN / "maze-machine",)):
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
        process = subprocess.Popen(
            [*program, *map(str, arguments)],
            cwd=tmp_path,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        started.append(process)
        return process

    yield run
    for process in started:
        # With all that it has started: whoever holds its pipes would hold up the test.
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate(timeout=LIMIT)


@pytest.fixture
def finish(start):
    """Run ``maze-machine`` to its end: exit status, standard output, standard error."""

    def run(*arguments):
        process = start(*arguments)
        out, err = process.communicate(timeout=LIMIT)
        return process.returncode, out, err

    return run


@pytest.fixture
def endpoint():
    """An address on the loopback that was free a moment ago."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def simulator(start, endpoint):
    """A simulator process that is ready, and its address."""

    def run(maze="final_2015", *arguments):
        process = start("sim", maze, "--listen", endpoint, *arguments)
        assert endpoint in process.stdout.readline(), process.stderr.read()
        return process, endpoint

    return run
