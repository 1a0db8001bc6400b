"""What the compiled kernels gain: whole runs with them and with the plain functions, in turns.

    python benchmarks/kernels.py [MACHINE ...] [--maze MAZE] [--rounds N]

Each run is a process of its own that runs once to warm up and then measures simulated time over processor time; the
ratio is the median of the ratios within a round, so that a busy computer slows both.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from statistics import median

# Before the folder of the benchmarks, where a script has the name of a package.
sys.path.insert(0, str(Path(__file__).parents[1]))

from transport.compiled import PLAIN, arithmetic_in_use

RUN = Path(__file__).with_name("run.py")


def factor(machine: str, maze: str, *, plain: bool) -> float:
    """Simulated time over processor time of one run."""
    environment = {**os.environ, PLAIN: "1" if plain else "", "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, RUN, machine, "--maze", maze, "--runs", "1", "--bare"]
    return float(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout)


def main() -> None:
    """Measure and print a row for each machine."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("machines", nargs="*", default=["pledge", "pledge_smooth", "tremaux"])
    parser.add_argument("--maze", default="final_2015")
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    print(f"here: {arithmetic_in_use()}; simulated time over processor time in {arguments.maze}")
    print(f"{'machine':16}{'plain':>8}{'compiled':>10}{'ratio':>8}")
    for machine in arguments.machines:
        rounds = [
            (factor(machine, arguments.maze, plain=True), factor(machine, arguments.maze, plain=False))
            for _ in range(arguments.rounds)
        ]
        plain, compiled = (median(values) for values in zip(*rounds, strict=True))
        print(f"{machine:16}{plain:>8.0f}{compiled:>10.0f}{median(one / other for other, one in rounds):>8.2f}")


if __name__ == "__main__":
    main()
