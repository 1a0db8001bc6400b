"""``maze-machine map``: look at a map that a run has saved."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from maze_machine.arguments.options import JsonOption
from maze_machine.errors import UsageError

if TYPE_CHECKING:
    from perception.map_document import MapDocument
    from perception.mapping.information import Symmetric
    from perception.mapping.surveyor import Surveyor

app = typer.Typer(
    name="map",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    help="Show a map that a run has saved.",
)
WIDTH, HEIGHT = 78, 24
"""Of the plan, characters."""


@app.callback()
def look() -> None:
    """Show a map that a run has saved."""


@app.command()
def show(
    file: Annotated[Path, typer.Argument(help="A map, as `maze-machine run --save-map` writes it.")],
    picture: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Where to save the picture, a .png or .svg. Default: NAME.png"),
    ] = None,
    no_picture: Annotated[bool, typer.Option("--no-picture", help="Save no picture.")] = False,
    json: JsonOption = False,
) -> None:
    """Describe a map, draw it as text and save a picture of it.

    The picture shows the walls that were seen, the path of the robot, and how well the places on that path are known.

    Example: `maze-machine map show maze.map`

    Example: `maze-machine map show maze.map --json --no-picture`
    """
    from json import dumps

    from maze_machine.arguments.files import PICTURES, check_outputs, check_suffix
    from perception.map_document import read_map
    from perception.mapping.uncertainty import certainties
    from perception.saved_map import start_of, world_of
    from perception.settings import PerceptionSettings

    if picture is not None and no_picture:
        raise UsageError("--picture and --no-picture exclude each other", "give one of them")
    drawn = None if no_picture else picture or Path(f"{file.stem}.png")
    check_suffix("--picture", drawn, PICTURES)
    check_outputs({"--picture": drawn}, [file])
    document = read_map(file)
    world = world_of(document, PerceptionSettings(), start_of(document))
    surveyor = world.surveyor
    assert surveyor is not None, "a saved map has keyframes"
    known = certainties(surveyor.mapper.graph, surveyor.mapper.loops.paths)
    told = facts_of(document, known)
    if json:
        print(dumps({"map": str(file), **told, **({} if drawn is None else {"picture": str(drawn)})}))
    else:
        print("\n".join([f"{file}: {_line(told)}", *_plan(document)]))
    if drawn is not None:
        _save(drawn, document, surveyor, known, f"{file.stem}: {_line(told)}")
        if not json:
            print(f"picture: {drawn}")


def facts_of(document: MapDocument, known: Sequence[Symmetric]) -> dict[str, Any]:
    """A map in numbers: JSON values, lengths in m, areas in m^2.

    Args:
        document: the map.
        known: how well the place of each keyframe is known.
    """
    from math import fsum, hypot

    from perception.map_document import FREE

    grid = document.grid
    places = [one.pose for one in document.keyframes]
    return {
        "version": document.version,
        "width": round(grid.cell * (len(grid.rows[0]) if grid.rows else 0), 3),
        "height": round(grid.cell * len(grid.rows), 3),
        "free": round(grid.cell * grid.cell * sum(row.count(FREE) for row in grid.rows), 2),
        "keyframes": len(places),
        "points": sum(len(one.points) for one in document.keyframes),
        "loops": len(document.loops),
        "way": round(fsum(hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(places)), 2),
        "doors": len(document.doors),
        "junctions": len(document.junctions),
        "start": list(document.keyframes[0].pose),
        "robot": None if document.robot is None else list(document.robot),
        "way_out": None if document.way_out is None else list(document.way_out),
        "deviation": round(max(one.ellipse[0] for one in known), 4),
    }


def _line(told: dict[str, Any]) -> str:
    way_out = "the way out is known" if told["way_out"] else "the way out is not known"
    parts = [
        f"{told['width']:.1f} x {told['height']:.1f} m",
        f"{told['free']:.1f} m² free",
        f"seen from {told['keyframes']} places along {told['way']:.1f} m",
        f"{told['loops']} loop{'' if told['loops'] == 1 else 's'} closed",
        f"{told['doors']} possible door{'' if told['doors'] == 1 else 's'}",
        *([f"{told['junctions']} marked junction{'' if told['junctions'] == 1 else 's'}"] if told["junctions"] else []),
        way_out,
        f"places known to {100 * told['deviation']:.1f} cm or better",
    ]
    return ", ".join(parts)


def _plan(document: MapDocument) -> list[str]:
    """The map as text."""
    from maze_machine.report.text_plan import text_plan
    from perception.map_document import WALL
    from transport.messages import Pose

    grid = document.grid
    column, line = grid.corner
    walls = [
        ((column + x + 0.5) * grid.cell, (line + y + 0.5) * grid.cell)
        for y, row in enumerate(reversed(grid.rows))
        for x, cell in enumerate(row)
        if cell == WALL
    ]
    robot = Pose(*(document.robot or document.keyframes[-1].pose))
    way = [one.pose[:2] for one in document.keyframes]
    return text_plan([(*place, *place) for place in walls], way, robot, WIDTH, HEIGHT)


def _save(file: Path, document: MapDocument, surveyor: Surveyor, known: Sequence[Symmetric], title: str) -> None:
    """Save the picture of a map."""
    import numpy as np

    from maze_machine.report.drawn_map import drawn_map
    from maze_machine.view.run_figure import Scene, Trail, save_picture
    from transport.messages import Pose

    file.parent.mkdir(parents=True, exist_ok=True)
    nothing = np.empty((0, 2, 2))
    doors = np.array([(door.right, door.left) for door in document.doors]).reshape(-1, 2, 2)
    trail = Trail(np.empty(0), np.empty((0, 2)))
    save_picture(file, Scene(nothing, doors, nothing), trail, title, drawn_map(surveyor, Pose(), known))
