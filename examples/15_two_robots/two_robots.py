"""Shows two robots that take turns, each with its own controller process, connected over Zenoh.

$ python two_robots.py
> leader: leader in straight, seed 0: out of the maze
> follower: follower in straight, seed 0: out of the maze
"""

import os
import subprocess

FOLLOWER = "tcp/127.0.0.1:" + os.environ.get("FOLLOWER_PORT", "7482")
OPTIONS = "--maze ../straight.maze --speed 8 --simulate rules.still_limit=600 --no-picture"


def run(robot: str, option: str) -> subprocess.Popen[str]:
    """Start the controller of one robot."""
    command = f"maze-machine run {robot}.maze-machine --set robot.name={robot} {OPTIONS} {option}"
    return subprocess.Popen(command.split(), stdout=subprocess.PIPE, text=True)


follower = run("follower", f"--open {FOLLOWER}")
leader = run("leader", f"--tell follower@{FOLLOWER}")
print("leader:", leader.communicate(timeout=60)[0])
print("follower:", follower.communicate(timeout=60)[0])
