"""Driving a machine on a robot: the loop, missions, traces and replays."""

from maze_machine.installation import PACKAGES, require_packages

require_packages(one for one in PACKAGES if one != "sim")  # programs begin here, without the command line
