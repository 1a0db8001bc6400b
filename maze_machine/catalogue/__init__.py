"""Machines, libraries and robot profiles, found by name or by file."""
