"""Coverage data of several machines: kept in files, merged over processes, counted."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from dataclasses import field
from pathlib import Path

from hsm.engine.coverage import Coverage
from hsm.model.chart import Model
from hsm.model.values import dataclass
from hsm.testing.coverage.items import CoverageItem, ItemKind, points, share

DATA = ".machine-coverage"
"""Folder of the data files; each process writes its own."""


@dataclass(frozen=True, slots=True)
class Measured:
    """One machine and what was exercised of it.

    Attributes:
        model: the machine.
        coverage: what was exercised.
        unreachable: keys of the items that are proved to be unreachable; they do not count.
    """

    model: Model
    coverage: Coverage
    unreachable: frozenset[tuple[object, ...]] = frozenset()

    @property
    def file(self) -> str:
        """The machine's file, or its name where it has none."""
        return self.model.files[0] if self.model.files else self.model.name

    @property
    def points(self) -> list[CoverageItem]:
        """All coverage items."""
        return [one for one in points(self.model, self.coverage) if one.covered or one.key not in self.unreachable]

    @property
    def left_out(self) -> list[CoverageItem]:
        """What does not count."""
        return [one for one in points(self.model, self.coverage) if not one.covered and one.key in self.unreachable]

    def share(self, *kinds: ItemKind) -> float:
        """Percentage covered of the given kinds of items; of all if none is given."""
        return share(one for one in self.points if not kinds or one.kind in kinds)


@dataclass(slots=True)
class Measurements:
    """The machines of a test run with their coverage, by the machine's file."""

    machines: dict[str, Measured] = field(default_factory=dict)

    def add(self, model: Model, coverage: Coverage) -> None:
        """Record the coverage of a run; a changed machine starts again."""
        key = str(Path(model.files[0]).resolve()) if model.files else model.name
        known = self.machines.get(key)
        if known is not None and fingerprint(known.model) == fingerprint(model):
            coverage = known.coverage.merge(coverage)
        self.machines[key] = Measured(model, coverage)

    def save(self, folder: Path, name: str | None = None) -> None:
        """Write a data file into a folder."""
        folder.mkdir(parents=True, exist_ok=True)
        listed = [
            {"machine": key, "fingerprint": fingerprint(one.model), "coverage": one.coverage.to_json()}
            for key, one in sorted(self.machines.items())
        ]
        text = json.dumps({"version": 1, "machines": listed}, separators=(",", ":"))
        (folder / f"{name or os.getpid()}.json").write_text(text, encoding="utf-8", newline="\n")

    def load(self, folder: Path, models: Iterable[Model]) -> list[str]:
        """Add the data files of a folder for some machines.

        Returns:
            Files of machines with data, but without a model or with a changed one.
        """
        by_key = {str(Path(one.files[0]).resolve()) if one.files else one.name: one for one in models}
        left: list[str] = []
        for path in sorted(folder.glob("*.json")):
            for one in json.loads(path.read_text(encoding="utf-8"))["machines"]:
                model = by_key.get(one["machine"])
                if model is not None and fingerprint(model) == one["fingerprint"]:
                    self.add(model, Coverage.from_json(one["coverage"]))
                elif one["machine"] not in left:
                    left.append(one["machine"])
        return left


def measured_files(folder: Path) -> list[str]:
    """The files of the machines of which a folder holds data."""
    found = {
        one["machine"]
        for path in sorted(folder.glob("*.json"))
        for one in json.loads(path.read_text(encoding="utf-8"))["machines"]
    }
    return sorted(found)


def fingerprint(model: Model) -> str:
    """Distinguishes a machine from the same file's machine before a change."""
    parts = [
        *(
            (state.name, state.kind.value, state.activity and state.activity.activity.outcomes)
            for state in model.states
        ),
        *(
            (one.source, one.targets, type(one.trigger).__name__, one.place and one.place.line)
            for one in model.transitions
        ),
    ]
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]
