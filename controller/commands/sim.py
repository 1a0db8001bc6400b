"""``maze-machine sim``: the simulator as a process of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from controller.completion import complete_maze, complete_profile


def sim(
    maze: Annotated[
        str,
        typer.Argument(help="A maze file of any format, or the name of a shipped maze.", autocompletion=complete_maze),
    ],
    listen: Annotated[str, typer.Option(metavar="ENDPOINT", help="Where controllers dial it.")] = "tcp/127.0.0.1:7447",
    connect: Annotated[
        str | None, typer.Option(metavar="ENDPOINT", help="Dial a router there instead of listening.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="The run, where a controller asks for none.")] = 0,
    robot: Annotated[
        str, typer.Option(help="Profile: a TOML file or a shipped one.", autocompletion=complete_profile)
    ] = "pico",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Override a setting of the profile; may be repeated."),
    ] = None,
    realtime: Annotated[
        bool, typer.Option("--realtime", help="Let time pass by the clock on the wall, with a dead man, as hardware.")
    ] = False,
    simulate: Annotated[
        list[str] | None,
        typer.Option(
            "--simulate", metavar="KEY=VALUE", help="Override a setting of the simulator, such as noise.size=0.02."
        ),
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(metavar="FAULT", help='Let something go wrong, such as "laser_blinded at=10 lasts=2".'),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(min=0.01, metavar="MULTIPLE", help="Keep to this multiple of real time. Default: no waiting."),
    ] = None,
    once: Annotated[
        bool, typer.Option("--once", help="End after one episode, also when its controller has died.")
    ] = False,
    identity: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER/NAME", help="Speak TLS with this certificate; the endpoint is then tls/HOST:PORT."
        ),
    ] = None,
) -> None:
    """Simulate a robot in a maze for a controller in another process.

    One line says that it is ready, and one line each how an episode went. It ends with Ctrl-C. Without `--realtime`
    each period of the simulation waits for its command.

    Example: `maze-machine sim final_2015 --listen tcp/127.0.0.1:7447`
    """
    from math import inf

    from controller.network import joined
    from controller.profile import load_profile
    from controller.simulation import SimulatedWorld, find_maze
    from controller.simulator_settings import pace, simulator_settings
    from transport.gate import Gate, PacedWorld
    from transport.lockstep import LockstepServer

    profile = load_profile(robot, settings or ())
    description = profile.robot
    drawn = find_maze(maze)
    world = simulator_settings(simulate or (), fault or ())

    def begin(asked: int | None) -> SimulatedWorld:
        beat = None if realtime else pace(description.period, speed)
        return SimulatedWorld(drawn, description, seed if asked is None else asked, world, beat)

    with joined(listen, connect, identity, profile.link) as bus:
        server: LockstepServer | Gate
        if realtime:
            base = PacedWorld(begin, description.period)
            server = Gate(bus, base, description, profile.link)
        else:
            server = LockstepServer(bus, description.name, description.period, begin)
        place = f"dials {connect}" if connect else f"listens at {listen}"
        print(f"{description.name} in {drawn.name} {place}", flush=True)
        patience = profile.link.silence if realtime else profile.link.step
        for report in server.episodes(forsaken=patience if once else inf):
            print(f"seed {report['seed']}: {report['line']}", flush=True)
            if once:
                return
