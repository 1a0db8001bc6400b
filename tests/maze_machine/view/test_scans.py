"""Figures of scans from plain data: each is a picture, and the same one each time."""

from __future__ import annotations

import numpy as np
import pytest

from maze_machine.view import scans

ANGLES = np.linspace(-2, 2, 200)
POINTS = np.stack((1.5 * np.cos(ANGLES), 1.5 * np.sin(ANGLES)), axis=1)
FOOTPRINT = [(0.1, -0.2), (0.1, 0.2), (-0.1, 0.2), (-0.1, -0.2)]
VOTES = np.arange(180 * 21).reshape(180, 21)

FIGURES = {
    "hough": lambda: scans.hough_figure(
        POINTS, VOTES, (np.linspace(0, 3.1, 180), np.linspace(-1, 1, 21)), [(1.0, 0.5), (2.5, 0.1)],
        area=1.0, footprint=FOOTPRINT,
    ),
    "minimap": lambda: scans.minimap_figure(np.arange(121, dtype=np.uint8).reshape(11, 11) % 3, 0.1, POINTS, FOOTPRINT),
    "junction": lambda: scans.junction_figure(
        POINTS, FOOTPRINT, {"d2": ((0.0, 0.3), (0.5, 0.3)), "d1L": ((0.0, 0.0), (0.0, 0.4))}, [FOOTPRINT], "t left"
    ),
    "nodes": lambda: scans.node_figure(
        POINTS, FOOTPRINT, [(0, "end", (1, -1)), (1, "corner", (1, 1))], [((1, -1), (1, 1))], ((1, -0.5), (1, 0.5))
    ),
    "landmarks": lambda: scans.landmark_figure(POINTS, FOOTPRINT, [((1, -1), (1, 1))], "one landmark"),
    "nothing": lambda: scans.node_figure(np.empty((0, 2)), FOOTPRINT, [], [], None),
}  # fmt: skip


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_is_a_picture_and_the_same_each_time(name, tmp_path):
    for copy in ("one.png", "other.png"):
        scans.save(FIGURES[name](), tmp_path / "new" / copy)
    one = (tmp_path / "new" / "one.png").read_bytes()
    assert one.startswith(b"\x89PNG")
    assert len(one) > 5000
    assert one == (tmp_path / "new" / "other.png").read_bytes()
