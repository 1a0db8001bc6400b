"""``maze-machine view``: a recorded run as a page."""

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


def view(
    recording: RecordingArgument,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="The page. Default: beside the recording.")
    ] = None,
    foxglove: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a layout too with which Foxglove shows the recording.")
    ] = None,
    robot: RecordedRobotOption = None,
    settings: SettingsOption = None,
    scan: ScanTopicOption = None,
    odometry: OdometryTopicOption = None,
) -> None:
    """Make a page of a recorded run: robot, laser, states and transitions, with play, pause and seek.

    The page is one file that any browser opens. For a page that shows a run while it goes on, see
    `maze-machine run --live`.

    Example: `maze-machine view run.mcap -o run.html`

    Example: `maze-machine view rosbag2_2026_11_27 --robot my.toml`
    """
    from json import dumps

    from maze_machine.arguments.files import check_outputs
    from maze_machine.catalogue.profile import load_profile
    from maze_machine.drive.replay import recorded_profile
    from maze_machine.view.foxglove import layout
    from maze_machine.view.page import frame, head, replay_page
    from transport.files import write_text
    from transport.recording import Topics, read_recording

    page = output or recording.with_suffix(".html")
    check_outputs({"--output": page, "--foxglove": foxglove}, [recording])
    profile = load_profile(robot or "pico", settings or ())
    recorded = read_recording(recording, Topics(scan, odometry), period=profile.robot.period)
    asked = robot is not None or settings is not None or "profile" not in recorded.run
    body = recorded_profile(recorded, profile if asked else None).robot
    title = f"{Path(recorded.run.get('machine', recorded.robot)).stem}, {len(recorded.ticks)} ticks"
    frames = [frame(tick.observation, tick.command, tick.step) for tick in recorded.ticks]
    write_text(page, replay_page(head(title, body), frames))
    print(page)
    if foxglove is not None:
        write_text(foxglove, dumps(layout(recorded.heard), indent=2) + "\n")
        print(foxglove)
