from __future__ import annotations

import socket
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
if str(HERE) not in sys.path:
    # The toy world is also a program of its own, so it cannot live in a fixture.
    sys.path.insert(0, str(HERE))


def free_endpoint() -> str:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        return f"tcp/127.0.0.1:{taken.getsockname()[1]}"


@pytest.fixture
def endpoint() -> str:
    """An endpoint on loopback that was free a moment ago."""
    return free_endpoint()


@pytest.fixture
def other() -> str:
    """Another one."""
    return free_endpoint()
