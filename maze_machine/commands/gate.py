"""``maze-machine gate``: a command time-out, limits and leases in front of a robot's driver that has none."""

from __future__ import annotations

from typing import Annotated

import typer

from maze_machine.arguments.options import LISTEN, IdentityOption, ListenOption, RobotOption, SettingsOption


def gate(
    driver: Annotated[
        str, typer.Argument(metavar="ENDPOINT", help="The endpoint of the driver: its Zenoh bridge or router.")
    ],
    inside: Annotated[
        str, typer.Option(metavar="NAME", help="The driver's namespace; controllers must not know it.")
    ] = "base",
    listen: ListenOption = LISTEN,
    robot: RobotOption = None,
    settings: SettingsOption = None,
    identity: IdentityOption = None,
) -> None:
    """Guard a ROS 2 driver: admit one controller at a time, limit its commands, and stop the base when it falls silent.

    It runs on the robot, next to the driver. The profile's section `[link]` names the driver's topics. It ends with
    Ctrl-C, and stops the robot.

    Example: `maze-machine gate tcp/127.0.0.1:7448 --inside base --listen tcp/0.0.0.0:7447`
    """
    from maze_machine.arguments.network import joined
    from maze_machine.catalogue.profile import chosen_profile
    from transport.connect import dialling
    from transport.driver import RosDriver
    from transport.endpoints import check_endpoint
    from transport.gate import DriverBase, Gate
    from transport.keys import RobotKeys

    check_endpoint(driver)
    profile = chosen_profile(robot, None, settings or ())
    outside = profile.link.model_copy(update={"gate": True, "keys": "bridge"})
    with (
        joined(listen, None, identity, outside) as net,
        dialling(driver, wait=profile.link.connect) as bus,
    ):
        base = DriverBase(RosDriver(bus, RobotKeys(inside, profile.link)), profile.robot.laser)
        server = Gate(net, base, profile.robot, outside)
        print(f"{profile.robot.name} behind a gate listens at {listen}", flush=True)
        for _report in server.episodes():
            pass  # a driver has no referee
