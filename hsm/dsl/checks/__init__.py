"""Checks of a machine whose lines are all valid: each check is a module that yields diagnostics."""

from __future__ import annotations

from collections.abc import Iterator

from hsm.dsl.checks import conflicts, flow, guards, outcomes, regions, spin, unused
from hsm.dsl.semantics.analysis import AnalysisInput
from hsm.model.diagnostics import Diagnostic


def errors(subject: AnalysisInput) -> Iterator[Diagnostic]:
    """Errors that keep a machine from being built although every line is valid."""
    yield from conflicts.check(subject)


def remarks(subject: AnalysisInput) -> Iterator[Diagnostic]:
    """Warnings and notes."""
    for module in (flow, outcomes, guards, spin, regions, unused):
        yield from module.check(subject)
