"""The embedded simulator as the loop's robot."""

from maze_machine.installation import require_packages

require_packages()  # programs begin here, without the command line
