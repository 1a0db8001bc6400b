"""Options that several commands have: declared once, so that they are named, helped and completed alike."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from maze_machine.arguments.completion import complete_machine, complete_maze, complete_profile

LISTEN = "tcp/127.0.0.1:7447"
"""The default endpoint of listeners: this machine only."""
OPEN = "tcp/127.0.0.1:7448"
"""Where a running machine is open to viewers and operators by default."""

ChartArgument = Annotated[
    str,
    typer.Argument(
        help="A .maze-machine or .scxml file, or the name of a shipped machine.",
        metavar="FILE",
        autocompletion=complete_machine,
    ),
]
MazeArgument = Annotated[
    str,
    typer.Argument(help="A maze file of any format, or the name of a shipped maze.", autocompletion=complete_maze),
]
StartOption = Annotated[
    str | None,
    typer.Option(metavar='"X Y DEGREES"', help="Where the robot is put down in the maze. Default: what its file says."),
]
ExitsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--exit",
        metavar='"X Y X Y"',
        help="A way out of the maze, by its two ends; walls along it are opened. May be repeated.",
    ),
]
GoalOption = Annotated[
    str | None,
    typer.Option(
        metavar="GOAL",
        help='What is to be done: "exit", a place to reach and how near ("X Y [RADIUS]"), "survive SECONDS" or "none". '
        "Default: what the file says.",
    ),
]
PixelOption = Annotated[
    float | None,
    typer.Option(
        "--metres-a-pixel", min=0.001, max=10, metavar="METRES", help="Scale of images. Default: what the file says."
    ),
]
CellOption = Annotated[
    float,
    typer.Option("--metres-a-cell", min=0.1, max=10, metavar="METRES", help="Scale of micromouse and mms mazes."),
]
GreyOption = Annotated[
    Literal["door", "unknown", "split"] | None,
    typer.Option(
        help="What grey pixels of an image are; `split` takes the darker half for walls. "
        "Default: unknown in maps of mapping tools, doors in other images."
    ),
]
ObjectsOption = Annotated[
    str | None,
    typer.Option(metavar="FILE", help="Moving objects for the maze: the course simulator's config.json."),
]
RecordingArgument = Annotated[
    Path,
    typer.Argument(
        help="What `maze-machine run --record` wrote, any MCAP file, or a rosbag2 folder or database with a laser scan "
        "and odometry."
    ),
]
RecordedRobotOption = Annotated[
    str | None,
    typer.Option(
        "--robot",
        help="Profile of the recorded robot; its laser is the recorded one. Default: what the recording says, or pico.",
        autocompletion=complete_profile,
    ),
]
ScanTopicOption = Annotated[
    str | None, typer.Option("--scan", metavar="TOPIC", help="The laser's topic. Default: it is found.")
]
OdometryTopicOption = Annotated[
    str | None, typer.Option("--odometry", metavar="TOPIC", help="The odometry's topic. Default: it is found.")
]

RobotOption = Annotated[
    str | None,
    typer.Option(
        help="Profile: a TOML file or a shipped one. Default: that of the project, or pico.",
        autocompletion=complete_profile,
    ),
]
SettingsOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Override a setting of the profile; may be repeated."),
]
TimeLimitOption = Annotated[
    float | None,
    typer.Option(min=0, max=1e9, metavar="SECONDS", help="Give up a run after this much of the robot's time."),
]
TraceOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="Write states, poses and commands as JSON lines.")
]

SimulateOption = Annotated[
    list[str] | None,
    typer.Option(
        "--simulate", metavar="KEY=VALUE", help="Override a setting of the simulator, such as noise.size=0.02."
    ),
]
FaultOption = Annotated[
    list[str] | None,
    typer.Option(metavar="FAULT", help='Let something go wrong, such as "laser_blinded at=10 lasts=2".'),
]
SpeedOption = Annotated[
    float | None,
    typer.Option(
        min=0.01, max=1000, metavar="MULTIPLE", help="Keep to this multiple of real time. Default: no waiting."
    ),
]

ListenOption = Annotated[str, typer.Option(metavar="ENDPOINT", help="Where others dial this process.")]
IdentityOption = Annotated[
    Path | None,
    typer.Option(metavar="FOLDER/NAME", help="Speak TLS with this certificate; the endpoint is then tls/HOST:PORT."),
]

OpenOption = Annotated[
    str | None,
    typer.Option(
        "--open",
        metavar="ENDPOINT",
        help="Let others watch and operate the machine from there, such as tcp/127.0.0.1:7448.",
    ),
]
ViewOption = Annotated[
    bool,
    typer.Option("--view", help="Show the run on a page, and begin when a browser does. A simulation keeps real time."),
]
TuiOption = Annotated[
    bool,
    typer.Option("--tui", help="Show the run in this terminal: states, why, a small plan. Needs the extra `tui`."),
]
HostOption = Annotated[
    str,
    typer.Option(metavar="ADDRESS", help="Where the page is served. Anything but the loopback is open to the network."),
]
PortOption = Annotated[int, typer.Option(min=0, max=65535, help="The page's port; 0 takes any that is free.")]
TellOption = Annotated[
    list[str] | None,
    typer.Option(
        "--tell",
        metavar="ROBOT@ENDPOINT",
        help="Hand what the machine sends on to the machine of another robot, which is open there; may be repeated.",
    ),
]
EventAtOption = Annotated[
    list[str] | None,
    typer.Option(
        "--event-at",
        metavar="SECONDS:EVENT",
        help="Send an event, with what it carries, at a time of the run; may be repeated.",
    ),
]
LibraryOption = Annotated[
    str | None,
    typer.Option(
        metavar="MODULE:NAME",
        help="What machines may name: a Library, or a function that makes one. Default: those of the project, else "
        "those of the maze robots.",
    ),
]

JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
