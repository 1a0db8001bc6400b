"""Driving a machine on a robot: the loop, missions, traces and replays."""

from maze_machine.installation import WITHOUT_SIMULATOR, require_packages

require_packages(WITHOUT_SIMULATOR)  # programs begin here, without the command line
