"""The subcommands of maze-machine, one a module."""
