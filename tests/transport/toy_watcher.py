"""Somebody who looks on and cannot keep up: ``toy_watcher.py ENDPOINT`` reads the toy's messages slowly."""

from __future__ import annotations

import sys
import time

from transport.bus import Message
from transport.connect import dialling
from transport.keys import RobotKeys


def main() -> None:
    """Say when the first message has come, and take twenty a second."""
    seen = 0

    def read(_message: Message) -> None:
        nonlocal seen
        seen += 1
        if seen == 1:
            print("watching", flush=True)
        time.sleep(0.05)

    with dialling(sys.argv[1]) as bus:
        for key in (RobotKeys("toy").scan, RobotKeys("toy").odometry):
            bus.subscribe(key, read)
        print("ready", flush=True)
        while True:
            time.sleep(3600)


if __name__ == "__main__":
    main()
