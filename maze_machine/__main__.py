"""The command ``maze-machine``, also as ``python -m maze_machine``."""

from __future__ import annotations

import sys

from maze_machine.installation import HiddenPackageError, require_packages
from maze_machine.memory import look_before_loading


def main() -> None:
    """Run the command line, if Python finds its packages."""
    look_before_loading()
    try:
        require_packages()
    except HiddenPackageError as error:
        print(f"maze-machine: {error}", file=sys.stderr)
        raise SystemExit(2) from None
    from maze_machine.cli import main as run

    run()


if __name__ == "__main__":
    main()
