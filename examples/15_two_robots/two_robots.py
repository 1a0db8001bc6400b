"""Shows two robots that take turns: the follower's machine gets the event `go` once the leader has left its maze.

Each robot has a controller process of its own; this program watches one and sends to the other, over Zenoh.

$ python two_robots.py
> leader: driving
> leader has left: go, follower
> out of the maze
"""

import json
import os
import subprocess
from pathlib import Path

LEADER = "tcp/127.0.0.1:" + os.environ.get("LEADER_PORT", "7481")
FOLLOWER = "tcp/127.0.0.1:" + os.environ.get("FOLLOWER_PORT", "7482")
OPTIONS = "--maze ../straight.maze --speed 8 --simulate rules.still_limit=600 --no-picture"


def run(robot: str, machine: str, endpoint: str) -> subprocess.Popen[str]:
    """Start the controller of one robot, with its machine open to others."""
    Path(f"{robot}.toml").write_text(f'[robot]\nname = "{robot}"\n')
    command = f"maze-machine run {machine} --robot {robot}.toml {OPTIONS} --open {endpoint}"
    return subprocess.Popen(command.split(), stdout=subprocess.PIPE, text=True)


follower = run("follower", "follower.maze-machine", FOLLOWER)
leader = run("leader", "../01_smallest/smallest.maze-machine", LEADER)
watch = f"maze-machine watch --connect {LEADER} --robot leader.toml --json"
with subprocess.Popen(watch.split(), stdout=subprocess.PIPE, text=True) as watching:
    assert watching.stdout is not None
    seen = ""
    for line in watching.stdout:
        step = json.loads(line)
        states = ", ".join(step["states"])
        if states != seen:
            print("leader:", states)
            seen = states
        if step.get("outcome") == "outside":
            break
    watching.terminate()
print("leader has left: go, follower")
subprocess.run(f"maze-machine send go --connect {FOLLOWER} --robot follower.toml".split(), check=True)
print("follower:", follower.communicate(timeout=60)[0])
leader.communicate(timeout=60)
