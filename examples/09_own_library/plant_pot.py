"""Shows a library of your own: the signals, activities and actions of a plant pot that waters itself.

$ maze-machine check pot.maze-machine --library plant_pot:LIBRARY
> no problems found
$ python plant_pot.py
> moisture 0.4 at 3 s: watering
> moisture 1.0 at 7 s: resting
"""

from dataclasses import dataclass

import hsm


@dataclass(frozen=True)
class Facts:
    """The facts of the pot: moisture of the soil, 0 is dry and 1 is wet."""

    moisture: float


LIBRARY: hsm.Library[Facts, float] = hsm.Library("pot")


@LIBRARY.signal("moisture")
def moisture(facts: Facts) -> float:
    """Moisture of the soil, 0 is dry and 1 is wet."""
    return facts.moisture


@LIBRARY.activity("pump", outcomes=("done",), holds=("valve",))
class Pump:
    """Open the valve for some ticks."""

    def __init__(self, ticks: int = 3) -> None:
        self.left = ticks

    def tick(self, _facts: Facts) -> float | hsm.Outcome:
        """Return the opening of the valve, 0 to 1."""
        self.left -= 1
        return 1.0 if self.left >= 0 else hsm.Outcome("done")


if __name__ == "__main__":
    run = hsm.load("pot.maze-machine", LIBRARY).start(facts=Facts(1.0))
    level = 1.0
    for second in range(1, 9):
        step = run.step(float(second), facts=Facts(level))
        if step:
            print(f"moisture {level:.1f} at {second} s: {', '.join(run.configuration)}")
        level += sum(0.6 * opening for _, opening in run.act(Facts(level))) - 0.3
