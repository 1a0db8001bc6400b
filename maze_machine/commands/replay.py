"""``maze-machine replay``: a recorded run again, without the robot."""

from __future__ import annotations

from typing import Annotated

import typer

from maze_machine.arguments.completion import complete_machine
from maze_machine.arguments.options import JsonOption, RecordingArgument, TraceOption
from maze_machine.errors import ExitStatus, FileError


def replay(
    recording: RecordingArgument,
    machine: Annotated[
        str | None,
        typer.Option(
            help="Another machine for the same sensors. Default: the recorded one.", autocompletion=complete_machine
        ),
    ] = None,
    trace: TraceOption = None,
    json: JsonOption = False,
) -> None:
    """Feed recorded sensors to the same machine, or to another, and show the first difference from the recorded run.

    The same machine gives the same trace, byte for byte. The exit status is 0 if nothing differs.

    Example: `maze-machine replay run.mcap --machine my.maze-machine`
    """
    from contextlib import ExitStack
    from json import dumps

    from maze_machine.arguments.files import check_outputs
    from maze_machine.drive.mission import Watcher
    from maze_machine.drive.replay import recorded_mission
    from maze_machine.drive.replay import replay as show_again
    from maze_machine.drive.trace import TraceWriter
    from maze_machine.report.outputs import text_stream
    from transport.recording import read_recording

    recorded = read_recording(recording)
    mission = recorded_mission(recorded, machine)
    check_outputs({"--trace": trace}, [recording, *mission.machine.model.files])
    losses: list[str] = []
    with ExitStack() as stack:
        watchers: list[Watcher] = []
        if trace is not None:
            watchers.append(TraceWriter(stack.enter_context(text_stream(trace, losses)), mission))
        ending, difference = show_again(recorded, mission, watchers)
    told = difference and {"tick": difference.tick, "recorded": difference.recorded, "replayed": difference.replayed}
    if json:
        print(dumps({"same": not told, "ticks": ending.ticks, "complete": recorded.complete, "difference": told}))
    else:
        cut = "" if recorded.complete else " (the recording was cut off)"
        print(f"{mission.machine.name} on {len(recorded.ticks)} recorded ticks{cut}: ", end="")
        print("\n".join(difference.lines()) if difference else "no difference")
    if losses:
        raise FileError("; ".join(losses))
    raise typer.Exit(ExitStatus.OK if difference is None else ExitStatus.FAILED)
