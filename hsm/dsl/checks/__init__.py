"""What can be said of a machine whose every line makes sense: each check is a module, and yields diagnostics."""

from __future__ import annotations

from collections.abc import Iterator

from hsm.dsl.checks import conflicts, flow, guards, outcomes, regions, spin, unused
from hsm.dsl.semantics.analysis import AnalysisInput
from hsm.model.diagnostics import Diagnostic


def errors(subject: AnalysisInput) -> Iterator[Diagnostic]:
    """What keeps a machine from being built although every line makes sense."""
    yield from conflicts.check(subject)


def remarks(subject: AnalysisInput) -> Iterator[Diagnostic]:
    """Warnings and notes."""
    for module in (flow, outcomes, guards, spin, regions, unused):
        yield from module.check(subject)
