"""Too little memory for a library is said, where the library itself would wait for ever."""

import subprocess
import sys

import pytest

from maze_machine.memory import NEEDED, MemoryForLibraries

SHORT = """
import resource
import sys

room = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize() + (100 << 20)
resource.setrlimit(resource.RLIMIT_AS, (room, room))
sys.argv[1:] = {arguments!r}
from maze_machine.__main__ import main
main()
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="address space is limited by Linux")
@pytest.mark.parametrize(
    ("arguments", "status"),
    [(["run", "right_hand", "--maze", "corridor", "--no-picture"], 3), (["--version"], 0)],
    ids=["needs it", "does not"],
)
def test_a_command_that_is_short_of_memory_ends_at_once(arguments, status):
    code = SHORT.format(arguments=arguments)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == status, done.stderr
    assert done.stderr == ("maze-machine: there is not enough memory for this\n" if status else "")


def test_only_what_maps_much_is_looked_at(monkeypatch):
    monkeypatch.setitem(NEEDED, "numpy", 1 << 30)
    finder = MemoryForLibraries()
    assert finder.find_spec("numpy.linalg", None) is None
    with pytest.raises(MemoryError, match="numpy"):
        finder.find_spec("numpy", None)
