"""The same scene in ir-sim, for `simulator.py`; this file runs where only ir-sim is installed.

The first line on standard input is the scene as JSON; each further one a number of ticks, answered by the processor
time that they took, s.
"""

import json
import sys
import tempfile
import time

import irsim  # type: ignore[import-not-found]
import numpy as np
import yaml


def main() -> None:
    scene = json.loads(sys.stdin.readline())
    lidar = {"name": "lidar2d", "range_max": 10, "angle_range": 4.0, "number": 1000, "noise": True, "std": 0.006}
    world = {
        "world": {"width": 60, "height": 60, "offset": [-20, -20], "step_time": 0.1, "collision_mode": "stop"},
        "robot": [
            {
                "kinematics": {"name": "diff"},
                "shape": {"name": "rectangle", "length": 0.2, "width": 0.4},
                "state": scene["state"],
                "sensors": [lidar],
            }
        ],
        "obstacle": [
            {"shape": {"name": "linestring", "vertices": [[ax, ay], [bx, by]]}, "state": [0, 0, 0]}
            for ax, ay, bx, by in scene["walls"]
        ],
    }
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        yaml.safe_dump(world, file)
        file.flush()
        environment = irsim.make(file.name, display=False, disable_all_plot=True)
    action = np.array(scene["action"])[:, None]
    for line in sys.stdin:
        began = time.process_time()
        for _ in range(int(line)):
            environment.step(action)
        print(f"took {time.process_time() - began}", flush=True)


if __name__ == "__main__":
    main()
