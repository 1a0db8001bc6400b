"""Perception's section of a robot profile: thresholds and sizes."""

from __future__ import annotations

from transport.description import Settings


class PerceptionSettings(Settings):
    """Thresholds and sizes of perception, one section for each skill."""
