"""Images of mazes: decoded only once their declared size is known to be small, and turned into outlines and areas."""

from __future__ import annotations

import io
import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from sim.formats.format import Source
from sim.free_space import Flags
from sim.maze import MazeError, Segments
from sim.solvability import LARGEST

MOST_PIXELS = 25_000_000
"""Images with more pixels are refused before they are decoded."""
_MILLIONS = MOST_PIXELS // 1_000_000
MOST_EDGES = 1_000_000
"""Images whose areas have a longer outline than this are refused, pixels: they are noise, or photographs."""
KINDS = {
    "PNG": (b"\x89PNG\r\n\x1a\n",),
    "PPM": (b"P1", b"P2", b"P3", b"P4", b"P5", b"P6"),
    "BMP": (b"BM",),
    "GIF": (b"GIF8",),
    "JPEG": (b"\xff\xd8\xff",),
}
"""The kinds of images that are read, and how their files begin."""
_DEPTH = 255


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A decoded image.

    Attributes:
        grey: 0 for black to 255 for white, transparent pixels as on white paper; shape (rows, columns).
        opaque: pixels that nothing shines through, the same shape.
    """

    grey: NDArray[np.uint8]
    opaque: Flags


def is_image(source: Source) -> bool:
    """Whether a file begins like an image."""
    return source.content.startswith(tuple(start for starts in KINDS.values() for start in starts))


def decoded(source: Source, metres_a_pixel: float) -> Picture:
    """The image in a file.

    Args:
        source: the file.
        metres_a_pixel: edge of a pixel, m.

    Raises:
        MazeError: the image declares more pixels or metres than the limits, or cannot be decoded.
    """
    try:
        with warnings.catch_warnings():
            # The size is judged here, by a tighter bound than the one that the library warns of.
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(io.BytesIO(source.content), formats=tuple(KINDS)) as image:
                _refuse_large(source, image.size, metres_a_pixel)
                return _on_white(image)
    except Image.DecompressionBombError:
        raise source.error(f"the image has more than {_MILLIONS} million pixels", hint="scale it down") from None
    except (MazeError, MemoryError):
        raise
    except Exception as error:
        # The library fails in many ways at damaged content, with an AssertionError where a palette is missing.
        raise source.error(f"the image cannot be decoded: {_reason(error)}") from None


def _reason(error: Exception) -> str:
    """Why an image cannot be decoded; only what the library says in words for people is quoted."""
    if isinstance(error, UnidentifiedImageError):
        return "its format is unknown"
    text = str(error).partition("\n")[0]
    worded = isinstance(error, OSError | ValueError | SyntaxError) and text and "b'" not in text
    return text if worded else "it is damaged"


def _refuse_large(source: Source, size: tuple[int, int], metres_a_pixel: float) -> None:
    columns, rows = size
    if columns * rows > MOST_PIXELS:
        raise source.error(
            f"the image has {columns} x {rows} pixels; the limit is {_MILLIONS} million",
            hint="scale it down",
        )
    if max(size) * metres_a_pixel > LARGEST:
        raise source.error(
            f"the image is {columns * metres_a_pixel:.4g} by {rows * metres_a_pixel:.4g} m; more than {LARGEST:.0f} m "
            "are not read",
            hint="check the metres a pixel",
        )


def _on_white(image: Image.Image) -> Picture:
    if image.has_transparency_data:
        alpha = image.convert("RGBA")
        white = Image.new("RGBA", image.size, "white")
        white.alpha_composite(alpha)
        return Picture(np.asarray(white.convert("L")), np.asarray(alpha.getchannel("A")) == _DEPTH)
    if image.mode.startswith("I"):
        deep = np.asarray(image, dtype=np.int64)
        grey = (deep >> 8 if deep.max() > _DEPTH else deep).clip(0, _DEPTH).astype(np.uint8)
    else:
        grey = np.asarray(image.convert("L"))
    return Picture(grey, np.ones(grey.shape, dtype=np.bool_))


def outlines(mask: Flags, others: Flags | None = None) -> Segments:
    """The edges between marked and other pixels; the outside of the image counts as not marked.

    Args:
        mask: shape (rows, columns).
        others: if given, only edges towards these pixels, the same shape.

    Returns:
        Segments in pixels: column and row of the corners, one pixel long each, shape (n, 4).
    """
    here = np.pad(mask, 1)
    there = ~here if others is None else np.pad(others, 1)
    above, below = here[:-1, :], here[1:, :]
    rows, columns = np.nonzero((above & there[1:, :]) | (below & there[:-1, :]))
    level = np.stack([columns - 1, rows, columns, rows], axis=1)
    left, right = here[:, :-1], here[:, 1:]
    rows, columns = np.nonzero((left & there[:, 1:]) | (right & there[:, :-1]))
    upright = np.stack([columns, rows - 1, columns, rows], axis=1)
    return np.concatenate([level, upright]).astype(np.float64)


def areas(mask: Flags) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """The marked pixels in pieces that hang together by an edge or a corner, in the order of their first pixels.

    Args:
        mask: shape (rows, columns).

    Returns:
        Rows and columns of the pixels of each piece.
    """
    rows, firsts, lasts = _runs(mask)
    piece = list(range(len(rows)))

    def root(run: int) -> int:
        while piece[run] != run:
            piece[run] = piece[piece[run]]
            run = piece[run]
        return run

    above = 0
    for run, (row, first, last) in enumerate(zip(rows, firsts, lasts, strict=True)):
        # Runs are sorted by row and column: those that end left of this one in the row above stay behind permanently.
        while above < run and (rows[above] < row - 1 or (rows[above] == row - 1 and lasts[above] < first - 1)):
            above += 1
        other = above
        while other < run and rows[other] == row - 1 and firsts[other] <= last + 1:
            one, two = sorted((root(run), root(other)))
            piece[two] = one
            other += 1
    members: dict[int, list[int]] = {}
    for run in range(len(rows)):
        members.setdefault(root(run), []).append(run)
    return [
        (
            np.concatenate([np.full(lasts[run] - firsts[run] + 1, rows[run]) for run in runs]),
            np.concatenate([np.arange(firsts[run], lasts[run] + 1) for run in runs]),
        )
        for runs in members.values()
    ]


def _runs(mask: Flags) -> tuple[list[int], list[int], list[int]]:
    """Row, first and last column of each unbroken row of marked pixels, sorted."""
    change = np.diff(np.pad(mask, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, firsts = np.nonzero(change == 1)
    _, ends = np.nonzero(change == -1)
    return rows.tolist(), firsts.tolist(), (ends - 1).tolist()
