"""Write the manifest of the shipped library again: ``python -m maze_machine.catalogue``."""

from __future__ import annotations

from pathlib import Path

from maze_machine.catalogue.library import robot_library
from maze_machine.catalogue.manifest import FILE, manifest_of, text_of
from transport.files import write_text

if __name__ == "__main__":
    write_text(Path(__file__).with_name(FILE), text_of(manifest_of(robot_library())))
