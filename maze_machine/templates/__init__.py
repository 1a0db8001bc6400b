"""Files that `maze-machine new` fills in."""
