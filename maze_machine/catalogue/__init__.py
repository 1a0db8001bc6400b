"""Machines, libraries and robot profiles, found by name or by file."""

from maze_machine.installation import WITHOUT_SIMULATOR, require_packages

require_packages(WITHOUT_SIMULATOR)  # programs begin here, without the command line
