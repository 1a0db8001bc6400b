"""What a shell offers as completion: shipped names first; the shell itself completes files."""

from __future__ import annotations

from maze_machine.installation import HOME


def complete_machine(incomplete: str) -> list[str]:
    """Shipped machines that begin so."""
    return _names("machines", "", (".maze-machine",), incomplete)


def complete_maze(incomplete: str) -> list[str]:
    """Shipped mazes that begin so."""
    return _names("sim", "mazes", (".maze", ".txt", ".num", ".png", ".pgm"), incomplete)


def complete_profile(incomplete: str) -> list[str]:
    """Shipped profiles that begin so."""
    return _names("maze_machine.catalogue", "profiles", (".toml",), incomplete)


def _names(package: str, folder: str, suffixes: tuple[str, ...], incomplete: str) -> list[str]:
    """Names of the data files of a package, without importing what is in it."""
    found = (entry.name for entry in (HOME.joinpath(*package.split(".")) / folder).iterdir())
    stems = {name.removesuffix(suffix) for name in found for suffix in suffixes if name.endswith(suffix)}
    return sorted(stem for stem in stems if stem.startswith(incomplete))
