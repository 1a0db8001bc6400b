"""Draw the pictures of the README: a solved maze and a machine.

Run as ``python scripts/readme_pictures.py``.
"""

from __future__ import annotations

from pathlib import Path

from PIL import Image
from typer.testing import CliRunner

from maze_machine.cli import app

IMAGES = Path(__file__).parents[1] / "docs" / "images"
COMMANDS = {
    "final_2015.png": ("run", "pledge", "--maze", "final_2015", "--picture"),
    "pledge.png": ("diagram", "pledge", "-o"),
}
COLOURS = 64
"""Text and lines look the same with so many, in a fraction of the bytes."""


def main() -> None:
    """Draw both pictures."""
    for name, command in COMMANDS.items():
        picture = IMAGES / name
        CliRunner().invoke(app, [*command, str(picture)], catch_exceptions=False)
        with Image.open(picture) as drawn:
            reduced = drawn.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
        reduced.save(picture, optimize=True)


if __name__ == "__main__":
    main()
