"""Too little memory for a library that would wait for it for ever."""

from __future__ import annotations

import mmap
import os
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from types import ModuleType

NEEDED = {"numpy": 150, "scipy": 150}
"""What each of them maps when it is loaded, and some room to work, MiB; measured with one thread of OpenBLAS."""


class MemoryForLibraries:
    """Refuses to load a library for which there is too little address space; it finds no modules itself.

    OpenBLAS, which NumPy and SciPy each bring along, asks for its buffers again and again where it does not get them
    (``ulimit -v``), and never returns.
    """

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Find nothing.

        Raises:
            MemoryError: the module is one of those libraries, and there is not enough memory.
        """
        if fullname in NEEDED:
            try:
                mmap.mmap(-1, NEEDED[fullname] << 20).close()
            except OSError:
                raise MemoryError(fullname) from None
        return None


def look_before_loading() -> None:
    """Let OpenBLAS have one buffer, as nothing here is worth a second thread of it, and look whether there is room."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    sys.meta_path.insert(0, MemoryForLibraries())
