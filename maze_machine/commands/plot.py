"""``maze-machine plot``: a recorded run as a figure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from maze_machine.arguments.options import (
    OdometryTopicOption,
    RecordedRobotOption,
    RecordingArgument,
    ScanTopicOption,
    SettingsOption,
)

FORMATS = (".svg", ".png", ".pdf", ".jpg")


def plot(
    recording: RecordingArgument,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="A .svg, .png, .pdf or .jpg file. Default: a .png."),
    ] = None,
    robot: RecordedRobotOption = None,
    settings: SettingsOption = None,
    scan: ScanTopicOption = None,
    odometry: OdometryTopicOption = None,
) -> None:
    """Plot a recorded run: the path by state, speed, clearance, and the states of each region over time.

    Example: `maze-machine plot run.mcap -o run.svg`
    """
    from maze_machine.arguments.files import check_outputs, check_suffix
    from maze_machine.catalogue.profile import chosen_profile
    from maze_machine.drive.replay import recorded_profile
    from maze_machine.report.run_plot import plotted
    from maze_machine.view.run_plot import save_plot
    from transport.recording import Topics, read_recording
    from transport.wording import printable

    file = output or recording.with_suffix(".png")
    check_outputs({"--output": file}, [recording])
    check_suffix("--output", file, FORMATS)
    profile = chosen_profile(robot, None, settings or ())
    recorded = read_recording(recording, Topics(scan, odometry), period=profile.robot.period)
    asked = robot is not None or settings is not None or "profile" not in recorded.run
    body = recorded_profile(recorded, profile if asked else None).robot
    title = printable(f"{Path(recorded.run.get('machine', recorded.robot)).stem}, {len(recorded.ticks)} ticks")
    save_plot(file, *plotted(recorded, body), title)
    print(file)
