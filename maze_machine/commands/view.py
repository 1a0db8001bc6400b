"""``maze-machine view``: a recorded run, or a machine that runs elsewhere, as a page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from maze_machine.arguments.options import (
    HostOption,
    IdentityOption,
    LibraryOption,
    OdometryTopicOption,
    PortOption,
    RecordedRobotOption,
    ScanTopicOption,
    SettingsOption,
)
from maze_machine.errors import UsageError

if TYPE_CHECKING:
    from maze_machine.catalogue.profile import Profile
    from maze_machine.view.page import Frame
    from transport.recording import Recording

SCHEMES = ("tcp", "tls", "udp", "quic", "ws", "unixsock-stream")
"""What an endpoint begins with."""
SILENCE = 10.0
"""A remote machine that has been silent for that long is asked whether it is still there, s."""


def view(
    source: Annotated[
        str | None,
        typer.Argument(
            metavar="RECORDING|ENDPOINT",
            help="A recording (MCAP, or a rosbag2 folder or database), or the same as `--connect ENDPOINT`.",
        ),
    ] = None,
    connect: Annotated[
        str | None,
        typer.Option(metavar="ENDPOINT", help="The endpoint where the running machine listens: its `run --open`."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="The page. Default: beside the recording.")
    ] = None,
    foxglove: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Also write a Foxglove layout for the recording, a .json file.")
    ] = None,
    no_sights: Annotated[
        bool,
        typer.Option("--no-sights", help="Skip the results of perception, which take longest to compute."),
    ] = False,
    robot: RecordedRobotOption = None,
    settings: SettingsOption = None,
    scan: ScanTopicOption = None,
    odometry: OdometryTopicOption = None,
    library: LibraryOption = None,
    identity: IdentityOption = None,
    host: HostOption = "127.0.0.1",
    port: PortOption = 0,
) -> None:
    """Show a run on a page: the plan, the machine, the reasons of its decisions, variables and time.

    A recording becomes one file that any browser opens, without a network. For a machine in another process, the page
    shows it while it runs and can operate it.

    Example: `maze-machine view run.mcap -o run.html`

    Example: `maze-machine view rosbag2_2026_11_27 --robot my.toml`

    Example: `maze-machine view --connect tcp/127.0.0.1:7448`
    """
    from maze_machine.catalogue.project import default_robot

    if (source is None) == (connect is None):
        raise UsageError("give one of them", "a recording, or --connect with the endpoint of a running machine")
    if source is None or (source.partition("/")[0] in SCHEMES and not Path(source).exists()):
        if output is not None or foxglove is not None:
            raise UsageError("-o and --foxglove need a recording", "record one with `maze-machine run --record FILE`")
        view_remote(str(connect or source), default_robot(robot), identity, host, port)
        return
    from json import dumps

    from maze_machine.arguments.files import check_outputs, check_suffix
    from maze_machine.catalogue.profile import chosen_profile
    from maze_machine.drive.replay import recorded_profile
    from maze_machine.view.foxglove import layout
    from maze_machine.view.page import replay_page
    from transport.files import write_text
    from transport.recording import Topics, read_recording

    recording = Path(source)
    page = output or recording.with_suffix(".html")
    check_outputs({"--output": page, "--foxglove": foxglove}, [recording])
    check_suffix("--output", page, [".html"])
    check_suffix("--foxglove", foxglove, [".json"])
    profile = chosen_profile(robot, None, settings or ())
    recorded = read_recording(recording, Topics(scan, odometry), period=profile.robot.period)
    asked = robot is not None or settings is not None or "profile" not in recorded.run
    body = recorded_profile(recorded, profile if asked else None)
    head, frames, verdict = _told(recorded, body, library, sights=not no_sights)
    write_text(page, replay_page(head, frames, verdict))
    print(page)
    if foxglove is not None:
        write_text(foxglove, dumps(layout(recorded.heard), indent=2) + "\n")
        print(foxglove)


def _told(
    recorded: Recording, profile: Profile, library: str | None, *, sights: bool
) -> tuple[Frame, list[Frame], Frame | None]:
    """What the page gets of a recording: what does not change, the ticks, how it ended."""
    from maze_machine.report.pages import recorded_frames, recorded_head, recorded_verdict
    from perception import Perception

    perception = Perception(profile.robot, profile.perception) if sights else None
    head = recorded_head(recorded, profile, library)
    return head, list(recorded_frames(recorded, perception)), recorded_verdict(recorded)


def view_remote(endpoint: str, robot: str, identity: Path | None, host: str, port: int) -> None:
    """Show a machine that runs elsewhere until the page is closed.

    Raises:
        LinkError: no program can be reached there.
        NoMachineError: no machine answers.
        ForeignMessageError: what it sends is not of the published form.
        UsageError: the page's port is taken, or the machine publishes nothing for a page.
    """
    from functools import partial

    from maze_machine.commands.opened_run import announce, linger, served
    from maze_machine.remote.described import ForeignMessageError
    from maze_machine.remote.looking import looked_on
    from maze_machine.remote.reaching import reaching
    from maze_machine.report.pages import remote_head
    from maze_machine.view.live import SimulatedTime

    with reaching(endpoint, robot, identity) as machine:
        model = machine.model()
        if "page" not in model:
            raise UsageError(
                f"machine {model['machine']} publishes nothing for a page", "`maze-machine watch` shows it"
            )
        head = remote_head(model)
        standing = ""

        def simulation() -> SimulatedTime:
            return SimulatedTime(pausable=True, paused=standing)

        page = served(host, port, head, operate=machine.ask, simulation=simulation)
        with page:
            announce(page)
            ending = {
                "line": "the machine no longer answers: the run has ended, or the connection is lost",
                "solved": False,
            }
            shown, foreign = None, None
            try:
                for step in looked_on(machine, SILENCE):
                    standing = step.pop("paused", "")
                    if step["tick"] != shown:
                        page.publish(partial(dict, step))
                    shown = step["tick"]
                    if "ended" in step:
                        ending = step["ended"]
                        break
            except ForeignMessageError as error:
                foreign, ending = error, {**ending, "line": str(error)}
            page.end(ending)
            linger(page)
            if foreign is not None:
                raise foreign
