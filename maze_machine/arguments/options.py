"""Options that several commands have: declared once, so that they are named, helped and completed alike."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from maze_machine.arguments.completion import complete_machine, complete_maze, complete_profile

LISTEN = "tcp/127.0.0.1:7447"
"""Where whoever listens does so unless told otherwise: this machine only."""

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
RecordingArgument = Annotated[Path, typer.Argument(help="A file that `maze-machine run --record` wrote.")]

RobotOption = Annotated[
    str, typer.Option(help="Profile: a TOML file or a shipped one.", autocompletion=complete_profile)
]
SettingsOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Override a setting of the profile; may be repeated."),
]
TimeLimitOption = Annotated[
    float | None,
    typer.Option(min=0, max=1e9, metavar="SECONDS", help="Give up a run after so much of the robot's time."),
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

LibraryOption = Annotated[
    str | None,
    typer.Option(
        metavar="MODULE:NAME",
        help="What machines may name: a Library, or a function that makes one. Default: those of the project, else "
        "those of the maze robots.",
    ),
]

JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
