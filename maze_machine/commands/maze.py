"""``maze-machine maze``: look at mazes, convert them between formats, and draw new ones by seed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from maze_machine.arguments.options import (
    LARGEST_SEED,
    CellOption,
    ExitsOption,
    GoalOption,
    GreyOption,
    MazeArgument,
    ObjectsOption,
    PixelOption,
    RobotOption,
    SettingsOption,
    StartOption,
)
from maze_machine.errors import UsageError

if TYPE_CHECKING:
    from sim.maze import Maze

app = typer.Typer(
    name="maze",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    help="Show mazes, convert them, generate new ones from a seed.",
)


@app.command()
def show(
    maze: MazeArgument,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Where to save the picture, a .png or .svg. Default: NAME.png")
    ] = None,
    no_picture: Annotated[bool, typer.Option("--no-picture", help="Save no picture.")] = False,
    start: StartOption = None,
    exits: ExitsOption = None,
    goal: GoalOption = None,
    metres_a_pixel: PixelOption = None,
    metres_a_cell: CellOption = 1.0,
    grey: GreyOption = None,
    objects: ObjectsOption = None,
    robot: RobotOption = None,
    settings: SettingsOption = None,
) -> None:
    """Describe a maze and save a picture of it.

    Example: `maze-machine maze show final_2015 --picture final.svg`
    """
    from maze_machine.catalogue.profile import chosen_profile
    from maze_machine.simulated.choices import MazeWords
    from maze_machine.simulated.world import find_maze

    words = MazeWords(start, tuple(exits or ()), goal, metres_a_pixel, metres_a_cell, grey, objects)
    body = chosen_profile(robot, None, settings or ()).robot
    drawn = find_maze(maze, words.choices(), robot=body)
    print(_facts(drawn, body.radius))
    if not no_picture:
        _save(drawn, picture or Path(f"{Path(maze).stem}.png"))


@app.command()
def convert(
    maze: MazeArgument,
    output: Annotated[
        Path, typer.Argument(help="The new file; its suffix names the format: .maze, .png, .pgm, .txt or .num.")
    ],
    start: StartOption = None,
    exits: ExitsOption = None,
    goal: GoalOption = None,
    metres_a_pixel: PixelOption = None,
    metres_a_cell: CellOption = 1.0,
    grey: GreyOption = None,
    objects: ObjectsOption = None,
    robot: RobotOption = None,
    settings: SettingsOption = None,
) -> None:
    """Write a maze in another format.

    A heightmap has the start at its centre. The cell formats (.txt, .num) only suit mazes that consist of cells.

    Example: `maze-machine maze convert maze.pgm maze.maze`
    """
    from maze_machine.arguments.files import check_outputs
    from maze_machine.catalogue.profile import chosen_profile
    from maze_machine.simulated.choices import MazeWords
    from maze_machine.simulated.world import find_maze
    from sim.formats import write_maze

    check_outputs({"the new file": output}, [maze, objects or ""])
    choices = MazeWords(start, tuple(exits or ()), goal, metres_a_pixel, metres_a_cell, grey, objects).choices()
    body = chosen_profile(robot, None, settings or ()).robot
    drawn = find_maze(maze, choices, robot=body)
    write_maze(drawn, output, choices)
    print(f"{output}: {_facts(drawn, body.radius)}")


@app.command()
def generate(
    output: Annotated[
        Path, typer.Argument(help="The new file; its suffix names the format: .maze, .png, .pgm, .txt or .num.")
    ],
    seed: Annotated[int, typer.Option(min=0, max=LARGEST_SEED, help="Seed of the maze.")] = 0,
    size: Annotated[str, typer.Option(metavar="COLUMNSxROWS", help="Number of cells.")] = "6x5",
    corridor: Annotated[float, typer.Option(metavar="METRES", help="Width of the corridors.")] = 1.0,
    loops: Annotated[int, typer.Option(min=0, help="Number of loops, each made by removing a wall.")] = 1,
    islands: Annotated[int, typer.Option(min=0, help="Number of solid blocks surrounded by corridors.")] = 0,
    open_spaces: Annotated[int, typer.Option(min=0, help="Number of open spaces of 2x2 to 3x3 cells.")] = 0,
    dead_ends: Annotated[float, typer.Option(min=0, max=1, help="Share of the dead ends to keep.")] = 1.0,
    doors: Annotated[
        int, typer.Option(min=0, help="Number of doors in dead ends; the robot must pass all of them.")
    ] = 0,
    skew: Annotated[float, typer.Option(metavar="DEGREES", help="Largest angle by which walls are turned.")] = 0.0,
    offset: Annotated[float, typer.Option(metavar="METRES", help="Largest distance by which walls are shifted.")] = 0.0,
    picture: Annotated[Path | None, typer.Option(metavar="FILE", help="Also save a picture, a .png or .svg.")] = None,
) -> None:
    """Generate a maze that can be solved; the same seed and options always give the same one.

    Example: `maze-machine maze generate new.maze --seed 7 --size 8x6 --doors 1 --islands 1 --skew 2 --offset 0.1`
    """
    from pydantic import ValidationError

    from sim.formats import Choices, write_maze
    from sim.generate import Recipe, generate
    from transport.description import RobotDescription
    from transport.wording import in_words

    columns, times, rows = size.partition("x")
    if not times:
        raise UsageError(f"`--size` must be columns x rows, not {size!r}", "write 6x5 for six by five cells")
    try:
        recipe = Recipe.model_validate(
            {
                "columns": columns,
                "rows": rows,
                "corridor": corridor,
                "loops": loops,
                "islands": islands,
                "open_spaces": open_spaces,
                "dead_ends": dead_ends,
                "doors": doors,
                "skew": skew,
                "offset": offset,
            }
        )
    except ValidationError as error:
        first = error.errors()[0]
        options = tuple(_option(str(part)) for part in first["loc"])
        raise UsageError(in_words({**first, "loc": options}), "see maze generate --help") from None
    drawn = generate(recipe, seed)
    write_maze(drawn, output, Choices(metres_a_cell=corridor))
    print(f"{output}: {_facts(drawn, RobotDescription().radius)}")
    if picture is not None:
        _save(drawn, picture)


def _option(name: str) -> str:
    """The option that sets a value of a recipe."""
    return "--size" if name in ("columns", "rows") else f"--{name.replace('_', '-')}"


def _facts(maze: Maze, radius: float) -> str:
    from sim.maze import Leave, Reach
    from sim.solvability import shortest_way

    left, bottom, right, top = maze.bounds
    way = shortest_way(maze, radius=radius)
    parts = [
        f"{right - left:.2f} x {top - bottom:.2f} m",
        _count(len(maze.walls), "wall"),
        _count(len(maze.doors), "door"),
        _count(len(maze.objects), "moving object"),
        _count(len(maze.exits), "exit"),
    ]
    match maze.goal:
        case Leave():
            parts.append(f"shortest way out about {way:.1f} m")
        case Reach():
            parts.append(f"goal: {maze.goal}, shortest way about {way:.1f} m")
        case _:
            parts.append(f"goal: {maze.goal}")
    return f"{maze.name}: " + ", ".join(parts)


def _count(number: int, what: str) -> str:
    return f"{number or 'no'} {what}{'' if number == 1 else 's'}"


def _save(maze: Maze, picture: Path) -> None:
    from sim.picture import save_picture

    save_picture(maze, picture)
    print(f"picture: {picture}")
