"""The mazes that ship with the project."""

from __future__ import annotations

from pathlib import Path

SHIPPED = Path(__file__).parent / "mazes"


def shipped_mazes() -> dict[str, Path]:
    """The shipped mazes' files by name, sorted by name."""
    return {
        path.stem: path
        for path in sorted(SHIPPED.iterdir())
        if path.suffix in {".maze", ".txt", ".num", ".png", ".pgm"}
    }
