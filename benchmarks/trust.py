"""What trust costs and what it finds: proofs, tests, coverage, mutants, planted mistakes, and a cross-check of proofs.

Run as ``python -P benchmarks/trust.py PART``, where PART is one of

    proofs [MACHINE ...]       each shipped machine: properties by verdict, method, time, memory, locations
    tests [MACHINE ...]        each shipped machine: coverage's share of a step, generated tests, mutants
    mutation [MACHINE ...]     each shipped machine: mutants killed by its tests, proved equivalent, left
    regions [COUNT]            parallel regions of four states, independent and coupled; six of them
    planted                    twenty mistakes in ten machines that are not robots in mazes
    cross-check FROM TO RUNS [FILE]
                               random machines, drawn from these seeds: what was proved against as many random runs;
                               a file keeps what was found, so that a run that was stopped continues there.
                               Machines from seed 1000000 on have events with data and deferred ones

Times are of the processor.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections import Counter
from pathlib import Path
from time import process_time

# Before the folder of the benchmarks, where a script has the name of a package.
sys.path.insert(0, str(Path(__file__).parents[1]))

from hsm.dsl import load_model
from hsm.engine.coverage import Coverage
from hsm.engine.machine import Machine
from hsm.testing.coverage.data import Measured
from hsm.testing.coverage.items import ItemKind
from hsm.testing.generation.generating import generate
from hsm.testing.mutation.mutating import survey
from hsm.testing.proofs.proving import check
from hsm.testing.proofs.verdicts import Method, Status
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


def proofs(names):
    """Each machine in a process of its own, for its memory."""
    print(f"{'machine':18}{'proved':>8}{'bounded':>9}{'violated':>10}{'undecided':>11}{'zones':>7}{'states':>8}"
          f"{'s':>7}{'MiB':>6}")  # fmt: skip
    for name in names:
        subprocess.run([sys.executable, "-P", __file__, "one-proof", name], check=True)


def one_proof(name):
    import resource

    model = load_model(shipped_machines()[name], robot_library())
    begin = process_time()
    verdicts = check(model)
    seconds = process_time() - begin
    count = Counter(one.status for one in verdicts)
    zones = max((one.states for one in verdicts if one.method is Method.ZONES), default=0)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{name:18}{count[Status.PROVED]:8}{count[Status.BOUNDED]:9}{count[Status.VIOLATED]:10}"
          f"{count[Status.UNDECIDED]:11}{zones:7}{verdicts[0].states:8}{seconds:7.1f}{memory:6.0f}",
          flush=True)  # fmt: skip


def tests(names):
    """What measuring coverage costs, what generated tests cover, what the machine's own tests notice."""
    print(f"{'machine':18}{'step us':>9}{'coverage %':>12}{'generate s':>12}{'tests':>7}"
          f"{'states %':>10}{'trans %':>9}{'guards %':>10}{'mutants %':>11}")  # fmt: skip
    for name in names:
        path = shipped_machines()[name]
        trial = load_tested_machine(path, robot_library())
        model = trial.machine.model
        micro, share = coverage_share(model)
        begin = process_time()
        found = generate(model)
        generating = process_time() - begin
        coverage = Coverage()
        for suite in trial.suites:
            for one in run_suite(suite, trial.machine):
                coverage = coverage.merge(one.coverage)
        measured = Measured(model, coverage)
        shares = [measured.share(kind) for kind in (ItemKind.STATE, ItemKind.TRANSITION, ItemKind.GUARD)]
        score = survey(model, trial.suites).score
        print(f"{name:18}{micro:9.2f}{share:12.1f}{generating:12.1f}{len(found.scenarios):7}"
              f"{shares[0]:10.1f}{shares[1]:9.1f}{shares[2]:10.1f}{score:11.1f}", flush=True)  # fmt: skip


def mutation(names):
    """The mutants of each machine: killed by its tests, proved equivalent, left."""
    print(f"{'machine':18}{'mutants':>9}{'killed':>8}{'equivalent':>12}{'left':>6}{'score %':>9}{'s':>7}")
    left = []
    for name in names:
        trial = load_tested_machine(shipped_machines()[name], robot_library())
        begin = process_time()
        found = survey(trial.machine.model, trial.suites)
        seconds = process_time() - begin
        total = found.killed + len(found.survivors) + len(found.equivalent)
        print(f"{name:18}{total:9}{found.killed:8}{len(found.equivalent):12}{len(found.survivors):6}"
              f"{found.score:9.1f}{seconds:7.1f}", flush=True)  # fmt: skip
        left += [f"{name}: line {one.place.line if one.place else '-'}: {one.kind}: {one.text}: {word}"
                 for word, some in (("equivalent", found.equivalent), ("left", found.survivors))
                 for one in some]  # fmt: skip
    print("\n".join(left))


def planted():
    """Mistakes in machines of other kinds."""
    from tests.trust.foreign import MACHINES, MISTAKES, foreign_machine

    begin = process_time()
    sound = [one for name in MACHINES for one in check(foreign_machine(name))]
    print(f"{len(MACHINES)} machines: {sum(one.proved for one in sound)} of {len(sound)} properties proved")
    found = 0
    for mistake in MISTAKES:
        (verdict,) = check(foreign_machine(mistake.machine, mistake), only={mistake.broken})
        found += verdict.violated
        print(f"{mistake.machine:15}{mistake.what:28}{mistake.broken:10}{verdict.status.value}", flush=True)
    print(f"{found} of {len(MISTAKES)} found; {process_time() - begin:.1f} s")


def regions(count):
    """Parallel regions of four states: independent ones, and such that depend on one another."""
    import resource
    from tempfile import TemporaryDirectory

    from tests.trust.coupled import COUPLINGS, coupled_text
    from tests.trust.library import make_library
    from tests.trust.regions import regions_text

    texts = {"independent": regions_text(count)} | {kind: coupled_text(kind, count) for kind in COUPLINGS}
    print(f"{count} regions  {'proved':>10}{'states':>8}{'s':>7}{'MiB':>6}")
    for kind, text in texts.items():
        with TemporaryDirectory() as folder:
            path = Path(folder) / "regions.maze-machine"
            path.write_text(text)
            model = load_model(path, make_library())
        begin = process_time()
        verdicts = check(model)
        seconds = process_time() - begin
        proved = f"{sum(one.proved for one in verdicts)} of {len(verdicts)}"
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"{kind:11}{proved:>10}{verdicts[0].states:8}{seconds:7.2f}{memory:6.0f}")


def cross_check(first, last, runs, kept):
    """Proofs of random machines against random runs."""
    from dataclasses import asdict

    from tests.trust.random_machines import cross_checked

    found = {}
    if kept is not None and kept.exists():
        found = {one["seed"]: one for one in map(json.loads, kept.read_text().splitlines()) if one["runs"] == runs}
    for seed in range(first, last):
        if seed not in found:
            begin = process_time()
            found[seed] = asdict(cross_checked(seed, runs)) | {"runs": runs, "seconds": process_time() - begin}
            if kept is not None:
                with kept.open("a") as lines:
                    lines.write(json.dumps(found[seed]) + "\n")
        if found[seed]["contradicted"]:
            print(f"seed {seed}: proved and violated: {', '.join(found[seed]['contradicted'])}", flush=True)
    some = [found[seed] for seed in range(first, last)]
    proved, violated, undecided, contradicted = (
        sum(len(one[what]) for one in some) for what in ("proved", "shown", "undecided", "contradicted")
    )
    every = proved + violated + undecided
    print(f"{last - first} machines, {every} properties: {proved} proved, {violated} violated (all replayed), "
          f"{undecided} not decided or bounded ({100 * undecided / every:.1f}%); {contradicted} proved and then "
          f"violated in {runs} random runs of each machine; {sum(one['seconds'] for one in some):.0f} s")  # fmt: skip


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = parser.add_subparsers(dest="part", required=True)
    for part in ("proofs", "tests", "mutation"):
        parts.add_parser(part).add_argument("machines", nargs="*", metavar="MACHINE", help="shipped machines; all")
    parts.add_parser("one-proof").add_argument("machine")
    parts.add_parser("planted")
    parts.add_parser("regions").add_argument("count", type=int, nargs="?", default=6)
    crossing = parts.add_parser("cross-check")
    for name in ("first", "last", "runs"):
        crossing.add_argument(name, type=int)
    crossing.add_argument("kept", type=Path, nargs="?")
    given = parser.parse_args()
    match given.part:
        case "proofs" | "tests" | "mutation":
            {"proofs": proofs, "tests": tests, "mutation": mutation}[given.part](
                given.machines or list(shipped_machines())
            )
        case "one-proof":
            one_proof(given.machine)
        case "planted":
            planted()
        case "regions":
            regions(given.count)
        case _:
            cross_check(given.first, given.last, given.runs, given.kept)


if __name__ == "__main__":
    main()
