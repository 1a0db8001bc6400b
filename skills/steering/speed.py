"""The speed that the way ahead allows."""

from __future__ import annotations

from skills.settings import MotionSettings


def speed_ahead(speed: float, ahead: float, motion: MotionSettings) -> float:
    """A wanted speed (m/s), less where the way ahead is not free for far (m)."""
    return max(0.0, min(speed, motion.slow_gain * (ahead - motion.standoff)))
