"""How much processor time short commands take from a cold start, beside Python itself.

    python benchmarks/commands.py [ROUNDS]

A round runs each command once, in turn, as a process of its own; the medians of its processor time are printed, also in
multiples of `python -c pass`. The language server's is the time until it has answered the request `initialize`. The
first round, which writes Python's caches and the analysed grammar, does not count.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median

PROGRAM = [sys.executable, "-m", "maze_machine"]
PLEDGE = str(Path(__file__).parents[1] / "machines" / "pledge.maze-machine")
HELLO = {"processId": None, "rootUri": None, "capabilities": {"general": {"positionEncodings": ["utf-8", "utf-16"]}}}


def taken(command: Sequence[str]) -> float:
    """The processor time of a command, s."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(command)} failed")
    return used.ru_utime + used.ru_stime


def taken_to_initialize() -> float:
    """The processor time that the language server takes until it has answered its first request, s."""
    with subprocess.Popen([*PROGRAM, "lsp"], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as server:
        assert server.stdin is not None
        assert server.stdout is not None
        asked = json.dumps({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": HELLO}).encode()
        server.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(asked), asked))
        server.stdin.flush()
        size = 0
        while line := server.stdout.readline().strip():
            name, _, value = line.partition(b":")
            size = int(value) if name.lower() == b"content-length" else size
        assert b"capabilities" in server.stdout.read(size)
        threads = Path(f"/proc/{server.pid}/task").iterdir()  # each with its time in nanoseconds, which ticks are not
        used = sum(int((one / "schedstat").read_text().split()[0]) for one in threads)
        server.kill()
        return used / 1e9


COMMANDS: dict[str, Callable[[], float]] = {
    "python -c pass": lambda: taken([sys.executable, "-c", "pass"]),
    "check pledge": lambda: taken([*PROGRAM, "check", PLEDGE]),
    "fmt --check": lambda: taken([*PROGRAM, "fmt", "--check", PLEDGE]),
    "list signals": lambda: taken([*PROGRAM, "list", "signals"]),
    "lsp, initialize": taken_to_initialize,
    "--help": lambda: taken([*PROGRAM, "--help"]),
    "--version": lambda: taken([*PROGRAM, "--version"]),
}


def main(rounds: int = 15) -> None:
    """Measure and print a table."""
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    found: dict[str, list[float]] = {name: [] for name in COMMANDS}
    for number in range(rounds + 1):
        for name, measure in COMMANDS.items():
            time = measure()
            if number:
                found[name].append(time)
    alone = median(found["python -c pass"])
    print("| processor time | ms | times Python's own start |")
    print("|---|---|---|")
    for name, times in found.items():
        print(f"| `{name}` | {median(times) * 1e3:.0f} | {median(times) / alone:.1f} |")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
