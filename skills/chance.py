"""Chance, drawn so that one seed gives one run."""

from __future__ import annotations

import numpy as np

from perception.facts import Facts
from skills.library import LIBRARY


@LIBRARY.signal("chance")
def chance(facts: Facts, share: float, seed: int = 0) -> bool:
    """True in a given share of all ticks, drawn from the seed and the tick's time; the same for all uses in a tick."""
    entropy = np.random.SeedSequence((abs(seed), abs(facts.observation.stamp)))
    return bool(np.random.Generator(np.random.PCG64(entropy)).random() < share)
