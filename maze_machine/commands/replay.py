"""``maze-machine replay``: a recorded run again, without the robot."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from maze_machine.arguments.completion import complete_machine
from maze_machine.arguments.options import (
    JsonOption,
    LibraryOption,
    OdometryTopicOption,
    RecordedRobotOption,
    ScanTopicOption,
    SettingsOption,
    TraceOption,
)
from maze_machine.errors import ExitStatus, FileError, UsageError


def replay(
    first: Annotated[
        str,
        typer.Argument(
            metavar="[MACHINE] RECORDING",
            help="A recording: what `maze-machine run --record` wrote, any MCAP file, or a rosbag2 folder or database "
            "with a laser scan and odometry; an optional first argument names a machine to use instead of the recorded "
            "one.",
        ),
    ],
    second: Annotated[
        str | None, typer.Argument(hidden=True, help="The recording, where a machine comes first.")
    ] = None,
    machine: Annotated[
        str | None,
        typer.Option(
            help="Another machine for the same sensors. Default: the recorded one.", autocompletion=complete_machine
        ),
    ] = None,
    robot: RecordedRobotOption = None,
    settings: SettingsOption = None,
    scan: ScanTopicOption = None,
    odometry: OdometryTopicOption = None,
    library: LibraryOption = None,
    trace: TraceOption = None,
    json: JsonOption = False,
) -> None:
    """Feed recorded sensors to the same machine, or to another, and show the first difference from the recorded run.

    The same machine gives the same trace, byte for byte. The exit status is 0 if nothing differs.

    If the recording has no machine, the given machine receives the sensor data of each period, its commands have no
    effect, and every transition is printed with the values that made it fire. The exit status is 0 unless the machine
    fails.

    Example: `maze-machine replay run.mcap`

    Example: `maze-machine replay my.maze-machine run.mcap`

    Example: `maze-machine replay right_hand rosbag2_2026_11_27 --robot my.toml --scan /scan`
    """
    from contextlib import ExitStack
    from json import dumps

    from maze_machine.arguments.files import check_outputs
    from maze_machine.catalogue.profile import chosen_profile
    from maze_machine.drive.mission import TickWatcher
    from maze_machine.drive.replay import recorded_mission
    from maze_machine.drive.replay import replay as show_again
    from maze_machine.drive.trace import TraceWriter
    from maze_machine.report.outputs import text_stream
    from maze_machine.report.replayed import Replayed, Transitions
    from transport.recording import Topics, read_recording

    if second is not None and machine is not None:
        raise UsageError("two machines were named", "name one, before the recording or with --machine")
    recording, machine = (Path(first), machine) if second is None else (Path(second), first)
    profile = chosen_profile(robot, None, settings or ())
    recorded = read_recording(recording, Topics(scan, odometry), period=profile.robot.period)
    asked = robot is not None or settings is not None or "profile" not in recorded.run
    if machine is None and Path(recorded.run.get("machine", "")).suffix:
        here = Path(recorded.run["machine"]).is_file() or "sources" not in recorded.run
        gone = "" if here else "; that file is not here: the recorded text is used"
        print(f"the recording's machine is {recorded.run['machine'][:200]!r}{gone}", file=sys.stderr)
    mission = recorded_mission(recorded, machine, profile if asked else None, library)
    check_outputs({"--trace": trace}, [recording, *mission.machine.model.files])
    losses: list[str] = []
    transitions = Transitions()
    with ExitStack() as stack:
        watchers: list[TickWatcher] = [transitions]
        if trace is not None:
            watchers.append(TraceWriter(stack.enter_context(text_stream(trace, losses)), mission))
        ending, difference = show_again(recorded, mission, watchers)
    replayed = Replayed(mission.machine.name, recorded, ending, difference, transitions.found)
    print(dumps(replayed.as_json()) if json else "\n".join(replayed.lines()))
    if losses:
        raise FileError("; ".join(losses))
    raise typer.Exit(ExitStatus.OK if difference is None else ExitStatus.FAILED)
