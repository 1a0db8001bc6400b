"""Mazes that other people drew: contest mazes, outward from the centre, and the course's heightmap.

A few of them run here; with ``MAZE_MACHINE_ALL=1`` in the environment all of them do, with several seeds.
"""

import os
from pathlib import Path

import pytest

from maze_machine.campaign.jobs import Job, Setup, run_job

MAZES = Path(__file__).parents[2].parent / "shared" / "data" / "mazes"
LEGACY = MAZES / "emc" / "heightmap_maze_legacy.pgm"
CONTEST = sorted((MAZES / "micromouse").glob("*.txt"), key=lambda path: path.name)
ALL = os.environ.get("MAZE_MACHINE_ALL") == "1"
CHOSEN = CONTEST if ALL else CONTEST[1::21][:2]

pytestmark = pytest.mark.skipif(not MAZES.is_dir(), reason="the data of other projects are not here")


@pytest.mark.parametrize("maze", CHOSEN, ids=lambda path: path.stem)
def test_pledge_leaves_contest_mazes_outward_and_touches_no_wall(maze):
    record = run_job(Setup(), Job("pledge", str(maze), 1))
    assert record["solved"], record
    assert record["contacts"] == []


@pytest.mark.parametrize("seed", range(5) if ALL else [2])
def test_pledge_leaves_the_courses_heightmap(seed):
    record = run_job(Setup(), Job("pledge", str(LEGACY), seed))
    assert record["solved"], record
    assert record["contacts"] == []
