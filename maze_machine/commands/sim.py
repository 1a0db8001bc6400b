"""``maze-machine sim``: the simulator as a process of its own."""

from __future__ import annotations

from typing import Annotated

import typer

from maze_machine.arguments.options import (
    LARGEST_SEED,
    LISTEN,
    CellOption,
    ExitsOption,
    FaultOption,
    GoalOption,
    GreyOption,
    IdentityOption,
    ListenOption,
    MazeArgument,
    ObjectsOption,
    PixelOption,
    RobotOption,
    SettingsOption,
    SimulateOption,
    SpeedOption,
    StartOption,
)


def sim(
    maze: MazeArgument,
    listen: ListenOption = LISTEN,
    connect: Annotated[
        str | None, typer.Option(metavar="ENDPOINT", help="Connect to a router at this endpoint instead of listening.")
    ] = None,
    start: StartOption = None,
    exits: ExitsOption = None,
    goal: GoalOption = None,
    metres_a_pixel: PixelOption = None,
    metres_a_cell: CellOption = 1.0,
    grey: GreyOption = None,
    objects: ObjectsOption = None,
    seed: Annotated[int, typer.Option(min=0, max=LARGEST_SEED, help="The seed, if a controller requests none.")] = 0,
    robot: RobotOption = None,
    settings: SettingsOption = None,
    realtime: Annotated[
        bool, typer.Option("--realtime", help="Run in real time, with a command time-out, like hardware.")
    ] = False,
    simulate: SimulateOption = None,
    fault: FaultOption = None,
    speed: SpeedOption = None,
    once: Annotated[
        bool, typer.Option("--once", help="End after one episode, even if its controller has died.")
    ] = False,
    identity: IdentityOption = None,
) -> None:
    """Simulate a robot in a maze for a controller in another process.

    It prints one line when it is ready, and one line with the result of each episode. Ctrl-C ends it. Without
    `--realtime` each period of the simulation waits for its command. With `link.gate=false` or `link.keys=rmw_zenoh`
    it is a bare ROS 2 robot, which any program may command, always in real time.

    Example: `maze-machine sim final_2015 --listen tcp/127.0.0.1:7447`

    Example: `maze-machine sim final_2015 --set link.keys=rmw_zenoh`
    """
    from math import inf

    from maze_machine.arguments.network import joined
    from maze_machine.catalogue.profile import chosen_profile
    from maze_machine.errors import UsageError
    from maze_machine.simulated.choices import MazeWords
    from maze_machine.simulated.settings import pace, simulator_settings
    from maze_machine.simulated.world import SimulatedWorld, find_maze
    from transport.gate import Gate, PacedWorld
    from transport.keys import RobotKeys
    from transport.lockstep import LockstepServer
    from transport.ros_robot import RosRobot

    profile = chosen_profile(robot, None, settings or ())
    description = profile.robot
    realtime = realtime or not profile.link.gate
    if realtime and speed is not None:
        raise UsageError("--speed is for a simulator that waits for its controller", "leave it out in real time")
    words = MazeWords(start, tuple(exits or ()), goal, metres_a_pixel, metres_a_cell, grey, objects)
    drawn = find_maze(maze, words.choices(), robot=description)
    world = simulator_settings(simulate or (), fault or ())

    def begin(asked: int | None) -> SimulatedWorld:
        beat = None if realtime else pace(description.period, speed)
        return SimulatedWorld(drawn, description, seed if asked is None else asked, world, beat)

    with joined(listen, connect, identity, profile.link) as bus:
        server: LockstepServer | Gate | RosRobot
        if realtime:
            base = PacedWorld(begin, description.period)
            keys = RobotKeys(description.topics_below, profile.link)
            server = Gate(bus, base, description, profile.link) if profile.link.gate else RosRobot(bus, base, keys)
        else:
            server = LockstepServer(bus, description.name, description.period, begin)
        place = f"dials {connect}" if connect else f"listens at {listen}"
        print(f"{description.name} in {drawn.name} {place}", flush=True)
        patience = profile.link.silence if realtime else profile.link.step
        for report in server.episodes(forsaken=patience if once else inf):
            print(f"seed {report['seed']}: {report['line']}", flush=True)
            if once:
                return
