"""Generated mazes: from a recipe and a seed, with imprecise walls."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from sim.formats.grid import HEADINGS, SIDES, GridCell
from sim.layout import Layout, NoRoomError
from sim.maze import Maze, MazeDoor, MazeError, Point, Start, merge_collinear
from sim.solvability import LARGEST, UnsolvableError, checked
from transport.arithmetic import tan
from transport.description import RobotDescription
from transport.messages import Pose
from transport.section import Settings

Count = Annotated[int, Field(ge=0)]
Posts = NDArray[np.float64]
"""Where the corners of the cells are: x and y in metres, shape (columns + 1, rows + 1, 2)."""
DRAWINGS = 50
"""How many attempts are made for one seed."""
DOOR_WIDTHS = (0.5, 1.5)
"""How wide the dead end may be that is a door, m, also between skewed walls."""
DOOR_AREA = 1.6
"""The start is at least so far from a door, m: the rule's 1.3 m, the robot's radius and some room."""
SKEW_SHIFT = 0.15
"""No end of a wall is shifted by its skew by more than this share of a corridor's width."""


class Recipe(Settings):
    """The recipe of a generated maze."""

    columns: Annotated[int, Field(ge=3, le=64)] = 6
    """Cells along x."""
    rows: Annotated[int, Field(ge=3, le=64)] = 5
    """Cells along y."""
    corridor: Annotated[float, Field(ge=0.6, le=5, allow_inf_nan=False)] = 1.0
    """Width of a corridor, which is the edge of a cell, m."""
    loops: Count = 1
    """Number of loops, each made by removing a wall."""
    islands: Count = 0
    """Number of solid blocks of one cell surrounded by corridors."""
    open_spaces: Count = 0
    """Number of open spaces of 2x2 to 3x3 cells."""
    dead_ends: Annotated[float, Field(ge=0, le=1)] = 1.0
    """Share of the dead ends to keep; the others get a second way if possible."""
    doors: Count = 0
    """Number of doors, each in a dead end; the robot must pass all of them."""
    skew: Annotated[float, Field(ge=0, le=10)] = 0.0
    """Largest angle by which walls are turned, degrees."""
    offset: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    """Largest distance by which straight walls are shifted, so that walls in line meet with an offset, m."""

    @model_validator(mode="after")
    def _fits(self) -> Recipe:
        if self.doors and not DOOR_WIDTHS[0] <= self.corridor <= DOOR_WIDTHS[1]:
            raise ValueError("a door is 0.5 to 1.5 m wide, and so must the corridors be where there are doors")
        if self.corridor * max(self.columns, self.rows) > LARGEST - self.corridor:
            raise ValueError(f"a maze must be smaller than {LARGEST:.0f} m")
        if self.offset > self.corridor / 4:
            raise ValueError("the offset must not exceed a quarter of the corridors' width")
        return self


def generate(recipe: Recipe, seed: int) -> Maze:
    """Draw a maze.

    Args:
        recipe: what it shall be like.
        seed: its seed.

    Returns:
        A maze that is known to be solvable, named after the seed.

    Raises:
        MazeError: the recipe does not fit into its cells.
    """
    generator = np.random.Generator(np.random.PCG64(seed))
    reason = ""
    for _ in range(DRAWINGS):
        try:
            maze = _built(_laid_out(recipe, generator), recipe, generator, f"maze {seed}")
            return checked(maze, radius=RobotDescription().radius)  # drawn for PICO
        except (NoRoomError, UnsolvableError) as error:
            reason = str(error)
    raise MazeError(
        f"maze {seed}",
        f"no maze of this kind in {DRAWINGS} attempts: {reason}",
        hint="request more cells, wider corridors, less offset or skew, or fewer doors, islands or open spaces",
    )


def _laid_out(recipe: Recipe, generator: np.random.Generator) -> Layout:
    layout = Layout(recipe.columns, recipe.rows, generator)
    layout.add_islands(recipe.islands)
    layout.carve()
    layout.choose_ends()
    layout.add_doors(recipe.doors, DOOR_AREA / recipe.corridor)
    layout.add_rooms(recipe.open_spaces)
    layout.add_loops(recipe.loops)
    layout.open_dead_ends(recipe.dead_ends)
    return layout


def _built(layout: Layout, recipe: Recipe, generator: np.random.Generator, name: str) -> Maze:
    across, upright = _lattice(layout)
    posts = _posts(across, upright, recipe, generator)
    cell, side = layout.exit
    gate = _ends(cell, side)
    shut = {_ends_between(dead_end, behind): slide for dead_end, behind, slide in layout.doors}
    sides = [((i, j), (i + 1, j)) for j, i in np.argwhere(across.T).tolist()]
    sides += [((i, j), (i, j + 1)) for i, j in np.argwhere(upright).tolist()]
    walls = [(*posts[a], *posts[b]) for a, b in sides if (a, b) != gate and (a, b) not in shut]
    x, y = (layout.start[0] + 0.5) * recipe.corridor, (layout.start[1] + 0.5) * recipe.corridor
    heading = HEADINGS[layout.choice(layout.open_sides(layout.start), "open side of the start")]
    return Maze(
        name=name,
        walls=merge_collinear(np.asarray(walls)),
        start=Start(Pose(x, y, heading)),
        exits=np.array([(*posts[gate[0]], *posts[gate[1]])]),
        doors=tuple(_door(f"door{number}", posts, ends, slide) for number, (ends, slide) in enumerate(shut.items(), 1)),
    )


def _lattice(layout: Layout) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which sides of cells are walls, doors and the exit among them.

    Returns:
        Those along x, shape (columns, rows + 1), and those along y, shape (columns + 1, rows).
    """
    across = np.ones((layout.columns, layout.rows + 1), dtype=np.bool_)
    upright = np.ones((layout.columns + 1, layout.rows), dtype=np.bool_)
    for passage in layout.passages:
        (i, j), (k, m) = sorted(passage)
        if i == k:
            across[i, m] = False
        else:
            upright[k, j] = False
    return across, upright


def _posts(
    across: NDArray[np.bool_], upright: NDArray[np.bool_], recipe: Recipe, generator: np.random.Generator
) -> Posts:
    """The corners, shifted and skewed with the straight walls that they belong to."""
    size = recipe.corridor
    i, j = np.meshgrid(np.arange(recipe.columns + 1), np.arange(recipe.rows + 1), indexing="ij")
    posts = size * np.stack([i, j], axis=2).astype(np.float64)
    for line in range(recipe.columns + 1):
        for begin, end in _runs(upright[line]):
            posts[line, begin : end + 1, 0] += _shifts(end - begin, recipe, generator)
    for line in range(recipe.rows + 1):
        for begin, end in _runs(across[:, line]):
            posts[begin : end + 1, line, 1] += _shifts(end - begin, recipe, generator)
    # Rounded to millimetres, so that a written maze is readable.
    rounded: Posts = np.round(posts, 3)
    return rounded


def _runs(sides: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last post of each unbroken wall on one line."""
    changes = np.flatnonzero(np.diff(np.concatenate([[0], sides.astype(np.int8), [0]])))
    return [(int(begin), int(end)) for begin, end in changes.reshape(-1, 2)]


def _shifts(cells: int, recipe: Recipe, generator: np.random.Generator) -> NDArray[np.float64]:
    """How far the posts of one straight wall are moved across it, m."""
    offset, turn = generator.uniform(-1.0, 1.0, 2).tolist()
    half = cells * recipe.corridor / 2
    most = SKEW_SHIFT * recipe.corridor
    tilt = min(max(half * tan(math.radians(turn * recipe.skew)), -most), most)
    shifts: NDArray[np.float64] = offset * recipe.offset + np.linspace(-tilt, tilt, cells + 1)
    return shifts


Post = tuple[int, int]


def _ends(cell: GridCell, side: str) -> tuple[Post, Post]:
    """The two posts of a side of a cell."""
    i, j = cell
    if side in {"north", "south"}:
        j += side == "north"
        return (i, j), (i + 1, j)
    i += side == "east"
    return (i, j), (i, j + 1)


def _ends_between(cell: GridCell, other: GridCell) -> tuple[Post, Post]:
    step = other[0] - cell[0], other[1] - cell[1]
    return _ends(cell, next(side for side, vector in SIDES.items() if vector == step))


def _door(name: str, posts: Posts, ends: tuple[Post, Post], slide: GridCell) -> MazeDoor:
    """A door between two posts that slides to the side where the step leads.

    Raises:
        NoRoomError: the walls beside it are shifted so that it is none by the rules.
    """
    first, second = ends if slide[0] + slide[1] > 0 else ends[::-1]
    door = MazeDoor(name, (_point(posts[first]), _point(posts[second])))
    if not DOOR_WIDTHS[0] <= door.length <= DOOR_WIDTHS[1]:
        raise NoRoomError(f"{name} is {door.length:.2f} m wide")
    return door


def _point(post: NDArray[np.float64]) -> Point:
    return float(post[0]), float(post[1])
