"""The .maze-machine files that ship with the project."""
