"""``maze-machine sim``: the simulator as a process of its own."""

from __future__ import annotations

from typing import Annotated

import typer


def sim(
    maze: Annotated[
        str,
        typer.Argument(help="A maze file of any format, or the name of a shipped maze."),
    ],
    listen: Annotated[str, typer.Option(metavar="ENDPOINT", help="Where controllers find it.")] = "tcp/127.0.0.1:7447",
    seed: Annotated[int, typer.Option(min=0, help="The run, where a controller asks for none.")] = 0,
    robot: Annotated[str, typer.Option(help="Profile: a TOML file or a shipped one.")] = "pico",
    once: Annotated[bool, typer.Option("--once", help="End after one episode.")] = False,
) -> None:
    """Simulate a robot in a maze for a controller in another process, in lockstep.

    One line says that it is ready, and one line each how an episode went. It ends with Ctrl-C.

    Example: `maze-machine sim final_2015 --listen tcp/127.0.0.1:7447`
    """
    from controller.profile import load_profile
    from controller.simulation import SimulatedWorld, find_maze
    from transport.connect import listening
    from transport.lockstep import LockstepServer

    description = load_profile(robot).robot
    drawn = find_maze(maze)

    def begin(asked: int | None) -> SimulatedWorld:
        return SimulatedWorld(drawn, description, seed if asked is None else asked)

    with listening(listen) as bus:
        print(f"{description.name} in {drawn.name} listens at {listen}", flush=True)
        for report in LockstepServer(bus, description.name, description.period, begin).episodes():
            print(f"seed {report['seed']}: {report['line']}", flush=True)
            if once:
                return
