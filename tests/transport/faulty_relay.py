"""A bad network between two programs: ``faulty_relay.py INSIDE OUTSIDE SEED [SHARE]``.

It dials the toy's side at INSIDE and listens for controllers at OUTSIDE. Of all messages and questions each way it
loses a SHARE, says as many twice, holds as many back until after their successor, and flips a bit in as many.
"""

from __future__ import annotations

import random
import signal
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from threading import Lock, Thread

from transport.bus import Message, Request
from transport.connect import dialling, listening
from transport.keys import RobotKeys

SHARE = 0.05


class Faults:
    """What becomes of messages, drawn from a seed; on each key apart.

    Attributes:
        counts: how often something was done to a message, by what it was.
    """

    def __init__(self, seed: int, share: float) -> None:
        self.counts: defaultdict[str, int] = defaultdict(int)
        self._random, self._share, self._lock = random.Random(seed), share, Lock()
        self._held: dict[str, list[Message]] = defaultdict(list)

    def __call__(self, key: str, message: Message) -> list[Message]:
        """What arrives where this message was sent: nothing, it, another, or several."""
        with self._lock:
            held, self._held[key] = self._held[key], []
            return [*self._arriving(key, message), *held]

    def _arriving(self, key: str, message: Message) -> Iterator[Message]:
        kinds = ("lost", "doubled", "late", "damaged", "whole")
        kind = self._random.choices(kinds, [self._share] * 4 + [1 - 4 * self._share])[0]
        self.counts[kind] += 1
        if kind == "late":
            self._held[key].append(message)
        elif kind == "damaged":
            yield self._flipped(message)
        elif kind != "lost":
            yield from [message] * (2 if kind == "doubled" else 1)

    def _flipped(self, message: Message) -> Message:
        whole = bytearray(message.payload + message.attachment)
        whole[self._random.randrange(len(whole))] ^= 1 << self._random.randrange(8)
        split = len(message.payload)
        return Message(bytes(whole[:split]), bytes(whole[split:]))


def main() -> None:
    """Relay until ended; then say what was done."""
    inside_endpoint, outside_endpoint, seed = sys.argv[1:4]
    faults = Faults(int(seed), float(sys.argv[4]) if sys.argv[4:] else SHARE)
    keys = RobotKeys("toy")
    # Blocked in all threads that begin later, so that only the wait below receives it.
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
    with ExitStack() as stack:
        inside = stack.enter_context(dialling(inside_endpoint))
        outside = stack.enter_context(listening(outside_endpoint))

        def passed_on(key: str, put: Callable[[bytes, bytes], None]) -> Callable[[Message], None]:
            def relay(message: Message) -> None:
                for arriving in faults(key, message):
                    put(*arriving)

            return relay

        def ask(request: Request) -> None:
            for question in faults("question", Message(request.payload)):
                reply = inside.ask(keys.session, question.payload, 1.0)
                for answer in faults("answer", Message(reply or b""))[:1]:
                    request.reply(answer.payload)
                    return

        for key in (keys.odometry, keys.scan, keys.clock):
            inside.subscribe(key, passed_on(key, outside.publisher(key, urgent=True).put))
        outside.subscribe(keys.command, passed_on(keys.command, inside.publisher(keys.command, urgent=True).put))
        outside.serve(keys.session, lambda request: Thread(target=ask, args=(request,), daemon=True).start())
        print("ready", flush=True)
        signal.sigwait({signal.SIGTERM})
        print(dict(faults.counts), flush=True)


if __name__ == "__main__":
    main()
