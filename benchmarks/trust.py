"""What trust costs: coverage's share of a step, generating tests, checking properties on all runs.

Situations and steps are those of the widest search for violations.

Run as ``python benchmarks/trust.py [MACHINE ...]``; without names all shipped machines.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from time import perf_counter, process_time

# Before the folder of the benchmarks, where a script bears the name of a package.
sys.path.insert(0, str(Path(__file__).parents[1]))

from hsm.dsl import load_model
from hsm.engine.coverage import Coverage
from hsm.engine.machine import Machine
from hsm.testing.coverage.data import Measured
from hsm.testing.coverage.items import ItemKind
from hsm.testing.exploration.checking import check
from hsm.testing.generation.generating import generate
from hsm.testing.mutation.mutating import survey
from hsm.testing.scenarios.driver import TICK
from hsm.testing.scenarios.running import run_suite
from hsm.testing.scenarios.script import Script, scripted
from hsm.testing.scenarios.tested_machine import load_tested_machine
from maze_machine.catalogue.library import robot_library
from maze_machine.catalogue.machines import shipped_machines

STEPS = 4_000
ROUNDS = 60


def step_time(machine, signals):
    """Seconds a step takes on the processor, over many steps in which nothing fires."""
    script = Script(signals)
    run = machine.start(facts=script)
    begin = process_time()
    for count in range(STEPS):
        run.step(count * TICK * 1e-6, (), script)
    return (process_time() - begin) / STEPS


def without_marks(model):
    """The machine with generated code from which the marking of paths is left out."""
    from hsm.engine import codegen

    machine = Machine(model)
    original = codegen.Generator._function

    def stripped(self, writer, name):
        kept = [
            (line, place)
            for line, place in zip(writer.lines, writer.places, strict=True)
            if not line.strip().startswith("h[")
        ]
        lines = [line for line, _ in kept]
        for at, line in enumerate(lines):  # a branch that only marked needs something in it
            depth = len(line) - len(line.lstrip())
            following = lines[at + 1] if at + 1 < len(lines) else ""
            if line.rstrip().endswith(":") and len(following) - len(following.lstrip()) <= depth:
                lines[at] = f"{line} pass"
        writer.lines[:] = lines
        writer.places[:] = [place for _, place in kept]
        return original(self, writer, name)

    machine.generator._function = stripped.__get__(machine.generator)
    return machine


def coverage_share(model):
    """Microseconds of a step, and percent of it that marking takes: the least of rounds that alternate.

    Whatever else runs on the processor only ever adds to a round.
    """
    signals = {"space.front": True, "speed": 1.0, "distance.front": 5.0}
    plain, bare = Machine(scripted(model)), without_marks(scripted(model))
    with_marks, none = [], []
    for _ in range(ROUNDS):
        with_marks.append(step_time(plain, signals))
        none.append(step_time(bare, signals))
    return min(with_marks) * 1e6, 100 * (1 - min(none) / min(with_marks))


def main():
    parser = argparse.ArgumentParser(description="What trust costs.")
    parser.add_argument("machines", nargs="*", metavar="MACHINE", help="shipped machines; all of them")
    library = robot_library()
    known = shipped_machines()
    names = parser.parse_args().machines or list(known)
    if unknown := [name for name in names if name not in known]:
        parser.error(f"there is no shipped machine {', '.join(unknown)}; there are {', '.join(known)}")
    print(f"{'machine':18}{'step us':>9}{'coverage %':>12}{'generate s':>12}{'tests':>7}{'check s':>9}"
          f"{'situations':>12}{'steps':>8}{'states %':>10}{'trans %':>9}{'guards %':>10}{'mutants %':>11}")  # fmt: skip
    for name in names:
        path = known[name]
        model = load_model(path, library)
        micro, share = coverage_share(model)
        begin = process_time()
        found = generate(model)
        generating = process_time() - begin
        begin = process_time()
        verdicts = check(model, steps=5000)
        checking = process_time() - begin
        trial = load_tested_machine(path, library)
        coverages = [one.coverage for suite in trial.suites for one in run_suite(suite, trial.machine)]
        measured = Measured(model, coverages[0] if coverages else Coverage())
        for one in coverages[1:]:
            measured = Measured(model, measured.coverage.merge(one))
        shares = [measured.share(kind) for kind in (ItemKind.STATE, ItemKind.TRANSITION, ItemKind.GUARD)]
        score = survey(model, trial.suites).score
        print(f"{name:18}{micro:9.2f}{share:12.1f}{generating:12.1f}{len(found.scenarios):7}{checking:9.1f}"
              f"{max(one.situations for one in verdicts):12}{max(one.steps for one in verdicts):8}"
              f"{shares[0]:10.1f}{shares[1]:9.1f}{shares[2]:10.1f}{score:11.1f}", flush=True)  # fmt: skip


if __name__ == "__main__":
    began = perf_counter()
    main()
    print(f"{perf_counter() - began:.0f} s in all; times are of the processor")
