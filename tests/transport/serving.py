"""What goes on in a thread of its own beside a test, such as a robot's side that answers."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

from transport.gate import Gate
from transport.lockstep import LockstepServer


@contextmanager
def working(work: Callable[[Callable[[], bool]], object]) -> Iterator[None]:
    """Have work done for the time of the block; it is given what says whether to end."""
    stop = threading.Event()
    thread = threading.Thread(target=lambda: work(stop.is_set))
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join(60)
        assert not thread.is_alive()


def serving(server: LockstepServer | Gate) -> AbstractContextManager[None]:
    """Have a robot's side answer for the time of the block."""
    return working(lambda stop: deque(server.episodes(stop, heartbeat=0.02), maxlen=0))
