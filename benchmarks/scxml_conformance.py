"""How many of the W3C's SCXML implementation report tests pass, are refused, or go wrong.

    python benchmarks/scxml_conformance.py FOLDER...

Each folder holds tests as ``.scxml`` files that end in a final state called ``pass`` or ``fail``. None of them is part
of this project: several public repositories hold them. A test passes if it ends in ``pass`` within ten seconds of
logical time; what the reader refuses is listed by its reason; anything else is wrong.
"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path

from hsm import MachineError, MachineFault
from hsm.interchange.scxml import load

SECONDS = 10
TICKS_PER_SECOND = 20


def outcome_of(path: Path) -> tuple[str, str]:
    """``pass``, ``refused`` or ``wrong``, with the reason."""
    try:
        machine = load(path)
    except MachineError as error:
        return "refused", f"{error.diagnostics[0].code} {error.diagnostics[0].message}"
    try:
        run = machine.start()
        for tick in range(1, SECONDS * TICKS_PER_SECOND):
            if run.outcome is not None:
                break
            run.step(tick / TICKS_PER_SECOND)
    except MachineFault as error:
        return "wrong", str(error)
    return ("pass", "") if run.outcome == "pass" else ("wrong", f"ended in {run.outcome or sorted(run.configuration)}")


def main() -> None:
    """Print a table for each folder."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--list", action="store_true", help="name each test that does not pass")
    options = parser.parse_args()
    for folder in options.folders:
        files = [one for one in sorted(folder.glob("*.scxml")) if "sub" not in one.stem]
        results = {one.stem: outcome_of(one) for one in files}
        counts = Counter(kind for kind, _ in results.values())
        print(
            f"{folder}: {len(files)} tests, "
            + ", ".join(f"{counts[one]} {one}" for one in ("pass", "refused", "wrong"))
        )
        if options.list:
            for name, (kind, reason) in results.items():
                if kind != "pass":
                    print(f"  {kind:8} {name}: {reason}")


if __name__ == "__main__":
    main()
