"""Shows two robots that take turns: the follower's machine gets the event `go` once the leader is on its way.

Each robot has a controller process of its own. The leader's knows where the follower's machine is open, and hands it
over Zenoh what its machine sends.

$ python two_robots.py
> leader: leader in straight, seed 0: out of the maze
> follower: follower in straight, seed 0: out of the maze
"""

import os
import subprocess
from pathlib import Path

FOLLOWER = "tcp/127.0.0.1:" + os.environ.get("FOLLOWER_PORT", "7482")
OPTIONS = "--maze ../straight.maze --speed 8 --simulate rules.still_limit=600 --no-picture"


def run(robot: str, option: str) -> subprocess.Popen[str]:
    """Start the controller of one robot."""
    Path(f"{robot}.toml").write_text(f'[robot]\nname = "{robot}"\n')
    command = f"maze-machine run {robot}.maze-machine --robot {robot}.toml {OPTIONS} {option}"
    return subprocess.Popen(command.split(), stdout=subprocess.PIPE, text=True)


follower = run("follower", f"--open {FOLLOWER}")
leader = run("leader", f"--tell follower@{FOLLOWER}")
print("leader:", leader.communicate(timeout=60)[0])
print("follower:", follower.communicate(timeout=60)[0])
