"""Shows a library of your own: the signals and activities of a plant pot that waters itself.

The facts are one number, the moisture of the soil: 0 is dry and 1 is wet. An effect is the opening of the valve.

$ maze-machine check pot.maze-machine --library plant_pot:LIBRARY
> no problems found
$ python plant_pot.py
> moisture 0.4 at 3 s: watering
> moisture 1.0 at 7 s: resting
"""

import hsm

LIBRARY: hsm.Library[float, float] = hsm.Library("pot")


@LIBRARY.signal("moisture")
def moisture(facts: float) -> float:
    """Moisture of the soil."""
    return facts


@LIBRARY.activity("pump", outcomes=("done",), holds=("valve",))
class Pump:
    """Open the valve for some ticks."""

    def __init__(self, ticks: int = 3) -> None:
        self.left = ticks

    def tick(self, _facts: float) -> float | hsm.Outcome:
        """Return the opening of the valve, 0 to 1."""
        self.left -= 1
        return 1.0 if self.left >= 0 else hsm.Outcome("done")


if __name__ == "__main__":
    level = 1.0
    run = hsm.load("pot.maze-machine", LIBRARY).start(facts=level)
    for second in range(1, 9):
        step = run.step(float(second), facts=level)
        if step:
            print(f"moisture {level:.1f} at {second} s: {', '.join(run.configuration)}")
        level += sum(0.6 * opening for _, opening in run.act(level)) - 0.3
