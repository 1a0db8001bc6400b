"""Options that several commands have: declared once, so that they are named, helped and completed alike."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from maze_machine.arguments.completion import complete_machine, complete_maze, complete_profile

LISTEN = "tcp/127.0.0.1:7447"
"""The default endpoint of listeners: this machine only."""
LARGEST_SEED = 2**63 - 1
"""What a message of the link and a report can hold."""
OPEN = "tcp/127.0.0.1:7448"
"""Where a running machine is open to viewers and operators by default."""

ChartArgument = Annotated[
    str,
    typer.Argument(
        help="A .maze-machine or .scxml file, or the name of a machine: of the project, or a shipped one.",
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
    typer.Option(metavar='"X Y DEGREES"', help="Where the robot starts in the maze. Default: the start in the file."),
]
ExitsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--exit",
        metavar='"X Y X Y"',
        help="An exit of the maze, by its two ends; walls along it are removed. May be repeated.",
    ),
]
GoalOption = Annotated[
    str | None,
    typer.Option(
        metavar="GOAL",
        help='The goal: "exit", a place to reach ("X Y [RADIUS]"), "survive SECONDS" or "none". '
        "Default: what the file says.",
    ),
]
PixelOption = Annotated[
    float | None,
    typer.Option(
        "--metres-a-pixel", min=0.001, max=10, metavar="METRES", help="Scale of images. Default: the scale in the file."
    ),
]
CellOption = Annotated[
    float,
    typer.Option("--metres-a-cell", min=0.1, max=10, metavar="METRES", help="Scale of micromouse and mms mazes."),
]
GreyOption = Annotated[
    Literal["door", "unknown", "split"] | None,
    typer.Option(
        help="The meaning of grey pixels in an image; `split` counts the darker half as walls. "
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
        help="Profile of the recorded robot; the laser is always the recorded one. "
        "Default: the recorded profile, or that of the project, or pico.",
        autocompletion=complete_profile,
    ),
]
ScanTopicOption = Annotated[
    str | None, typer.Option("--scan", metavar="TOPIC", help="The laser's topic. Default: the only one of its type.")
]
OdometryTopicOption = Annotated[
    str | None,
    typer.Option("--odometry", metavar="TOPIC", help="The odometry's topic. Default: the only one of its type."),
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
    typer.Option(min=0, max=1e9, metavar="SECONDS", help="Abort a run after this much of the robot's time."),
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
    typer.Option(metavar="FAULT", help='Inject a fault, such as "laser_blinded at=10 lasts=2".'),
]
SpeedOption = Annotated[
    float | None,
    typer.Option(
        min=0.01, max=1000, metavar="MULTIPLE", help="Keep to this multiple of real time. Default: no waiting."
    ),
]

ListenOption = Annotated[str, typer.Option(metavar="ENDPOINT", help="The endpoint where this process listens.")]
IdentityOption = Annotated[
    Path | None,
    typer.Option(metavar="FOLDER/NAME", help="Use TLS with this certificate; the endpoint is then tls/HOST:PORT."),
]

OpenOption = Annotated[
    str | None,
    typer.Option(
        "--open",
        metavar="ENDPOINT",
        help="Let other programs watch and operate the machine at this endpoint, such as tcp/127.0.0.1:7448.",
    ),
]
ViewOption = Annotated[
    bool,
    typer.Option(
        "--view", help=("Show the run on a web page, and begin when a browser opens it. A simulation keeps real time.")
    ),
]
TuiOption = Annotated[
    bool,
    typer.Option("--tui", help="Show the run in this terminal: states, why, a small plan. Needs the extra `tui`."),
]
HostOption = Annotated[
    str,
    typer.Option(
        metavar="ADDRESS",
        help="The address that serves the page. Any address but the loopback is open to the network.",
    ),
]
PortOption = Annotated[int, typer.Option(min=0, max=65535, help="The page's port; 0 takes any free port.")]
TellOption = Annotated[
    list[str] | None,
    typer.Option(
        "--tell",
        metavar="ROBOT@ENDPOINT",
        help="Forward the events that the machine sends to the machine of another robot. ENDPOINT is the `--open` of "
        "that robot's run; may be repeated.",
    ),
]
EventAtOption = Annotated[
    list[str] | None,
    typer.Option(
        "--event-at",
        metavar="SECONDS:EVENT",
        help="Send an event, with its data, at a time of the run; may be repeated.",
    ),
]
LibraryOption = Annotated[
    str | None,
    typer.Option(
        metavar="MODULE:NAME",
        help="The names that machines may use: MODULE:NAME of a Library, or of a function that makes one or adds names "
        "to the shipped one. Default: that of the project, or of the maze robots.",
    ),
]

JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
