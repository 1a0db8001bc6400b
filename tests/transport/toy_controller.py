"""A controller that drives the toy until it is ended: ``toy_controller.py ENDPOINT SEED [STEPS] [identity=...]``.

In lockstep it prints a digest of all that it saw and did after STEPS. In real time it prints ``driving``,
``stopped`` and ``stale`` as these begin, and takes a stopped robot again; on SIGUSR1 it hangs for a while, with the
interpreter locked.
"""

from __future__ import annotations

import ctypes
import hashlib
import signal
import sys

from toy_world import answer_to, identity, seen, wander

from transport.connect import connect_robot
from transport.description import RobotDescription
from transport.lockstep import RemoteLockstep
from transport.messages import STOP, Command
from transport.realtime import RealtimeRobot
from transport.settings import LinkSettings

HANG = 1.0
STALE = LinkSettings().stale


def hang(*_: object) -> None:
    # PyDLL keeps the interpreter's lock, as a stuck extension module does.
    ctypes.PyDLL(None).usleep(int(1e6 * HANG))


def step_along(robot: RemoteLockstep, steps: int) -> None:
    digest = hashlib.sha256()
    for index in range(steps):
        observation = robot.observe()
        command = wander(observation)
        digest.update(repr((seen(observation), command)).encode())
        robot.command(command)
        if index == 0:
            print("driving", flush=True)
    print(digest.hexdigest(), robot.report()["steps"], flush=True)


def drive(robot: RealtimeRobot) -> None:
    was = None
    while True:
        observation = robot.observe()
        link, stopped = observation.link, observation.link.stopped
        now = "stale" if link.scan_age > STALE else "stopped" if stopped else "driving"
        if now != was:
            was = now
            print(now, flush=True)
        robot.command(Command(STOP if stopped else answer_to(observation.stamp), answers=observation.stamp))


def main() -> None:
    signal.signal(signal.SIGUSR1, hang)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    settings = LinkSettings(silence=30.0, step=30.0)
    known = identity()
    security = None if known is None else known.dialling()
    robot = connect_robot(sys.argv[1], RobotDescription(name="toy"), settings, seed=int(sys.argv[2]), security=security)
    try:
        if isinstance(robot, RemoteLockstep):
            step_along(robot, int(sys.argv[3]))
        else:
            drive(robot)
    finally:
        robot.close()


if __name__ == "__main__":
    main()
