"""``maze-machine run``: a machine drives a robot."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from maze_machine.arguments.completion import complete_machine, complete_maze
from maze_machine.arguments.options import (
    LARGEST_SEED,
    CellOption,
    EventAtOption,
    ExitsOption,
    FaultOption,
    GoalOption,
    GreyOption,
    HostOption,
    IdentityOption,
    JsonOption,
    LibraryOption,
    ObjectsOption,
    OpenOption,
    PixelOption,
    PortOption,
    RobotOption,
    SettingsOption,
    SimulateOption,
    SpeedOption,
    StartOption,
    TellOption,
    TimeLimitOption,
    TraceOption,
    TuiOption,
    ViewOption,
)
from maze_machine.errors import ExitStatus, FileError, UsageError

if TYPE_CHECKING:
    from maze_machine.catalogue.profile import Profile
    from maze_machine.drive.attempts import Attempt, RefereedRobot
    from maze_machine.drive.mission import Mission, TickWatcher
    from maze_machine.remote.operated import OperatedRun
    from maze_machine.remote.telling import EventForwarder
    from maze_machine.report.outputs import Outputs
    from maze_machine.report.result import Result
    from maze_machine.simulated.choices import MazeWords
    from maze_machine.simulated.world import SimulatedWorld
    from transport.lockstep import RemoteLockstep
    from transport.realtime import RealtimeRobot

DEFAULT_MAZE = "final_2015"


def run(
    machine: Annotated[
        str,
        typer.Argument(
            help="A .maze-machine file, or the name of a machine: of the project, or a shipped one.",
            autocompletion=complete_machine,
        ),
    ],
    maze: Annotated[
        str | None,
        typer.Option(
            help="Maze of the embedded simulator: a file of any format, or the name of a shipped maze. "
            "Default: that of the project, or final_2015.",
            autocompletion=complete_maze,
        ),
    ] = None,
    start: StartOption = None,
    exits: ExitsOption = None,
    goal: GoalOption = None,
    metres_a_pixel: PixelOption = None,
    metres_a_cell: CellOption = 1.0,
    grey: GreyOption = None,
    objects: ObjectsOption = None,
    seed: Annotated[
        int | None, typer.Option(min=0, max=LARGEST_SEED, help="Seed of all random numbers of the run. Default: 0.")
    ] = None,
    connect: Annotated[
        str | None,
        typer.Option(
            metavar="ENDPOINT",
            help="Drive the robot that listens there, such as tcp/127.0.0.1:7447, and start no simulator.",
        ),
    ] = None,
    identity: IdentityOption = None,
    robot: RobotOption = None,
    settings: SettingsOption = None,
    parameters: Annotated[
        list[str] | None,
        typer.Option("--param", metavar="NAME=VALUE", help="Set a parameter, with its unit; may be repeated."),
    ] = None,
    simulate: SimulateOption = None,
    fault: FaultOption = None,
    speed: SpeedOption = None,
    time_limit: TimeLimitOption = None,
    attempts: Annotated[
        int,
        typer.Option(
            min=1,
            max=2,
            help="How many attempts to make within the maze's time limit. Another one begins at the start, with a "
            "fresh machine, after a failed one.",
        ),
    ] = 1,
    practice: Annotated[
        bool,
        typer.Option(
            "--practice",
            help="Make a second attempt that uses what the first one learned about the maze, even after a success, "
            "which the rules do not allow.",
        ),
    ] = False,
    trace: TraceOption = None,
    record: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Record sensors, commands and steps as MCAP, for `maze-machine replay`."),
    ] = None,
    dated: Annotated[
        bool, typer.Option("--dated", help="Stamp the recording with the current date and time, not from 1970.")
    ] = False,
    view: ViewOption = False,
    host: HostOption = "127.0.0.1",
    port: PortOption = 0,
    tui: TuiOption = False,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Where to save the picture of the path. Default: in the folder runs/."),
    ] = None,
    no_picture: Annotated[bool, typer.Option("--no-picture", help="Save no picture.")] = False,
    map_file: Annotated[
        Path | None,
        typer.Option("--map", metavar="FILE", help="Begin with a map that an earlier run saved."),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option(
            metavar='"X Y DEGREES"',
            help="Where the robot is on that map; `start` is where the map was begun. Default: the robot finds it out.",
        ),
    ] = None,
    save_to: Annotated[
        Path | None,
        typer.Option("--save-map", metavar="FILE", help="Save what the robot has seen as a map, a .map file."),
    ] = None,
    library: LibraryOption = None,
    event_at: EventAtOption = None,
    open_at: OpenOption = None,
    tell: TellOption = None,
    json: JsonOption = False,
) -> None:
    """Run a machine on a robot until the machine, the referee or a limit ends it.

    Without `--connect` a simulator is started in the same process. The exit status is 0 only if the robot has reached
    its goal by the rules (to leave the maze, unless `--goal` or the maze names another), in its last attempt if there
    are several. Files of a second attempt have `-2` in their names.

    Example: `maze-machine run pledge`

    Example: `maze-machine run my.maze-machine --maze maze.pgm --seed 3 --param "cruise=0.3 m/s"`

    Example: `maze-machine run pledge --maze map.yaml --start "1 2 90" --goal "6 2"`

    Example: `maze-machine run pledge --attempts 2`

    Example: `maze-machine run tremaux --practice`

    Example: `maze-machine run explorer --save-map maze.map`

    Example: `maze-machine run explorer --map maze.map --at start`

    Example: `maze-machine run pledge --view`

    Example: `maze-machine run pledge --view --speed 4 --port 8000`

    Example: `maze-machine run pledge --tui`

    Example: `maze-machine run pledge --connect tcp/127.0.0.1:7447 --trace trace.jsonl`

    Example: `maze-machine run my.maze-machine --event-at 2.5:go`

    Example: `maze-machine run pledge --speed 1 --open tcp/127.0.0.1:7448`

    Example: `maze-machine run crosser --open tcp/127.0.0.1:7448 --tell blue@tcp/127.0.0.1:7449`
    """
    import gc
    from contextlib import ExitStack, closing

    from maze_machine.arguments.files import check_outputs
    from maze_machine.arguments.parameters import split_setting
    from maze_machine.catalogue.profile import chosen_profile
    from maze_machine.commands.opened_run import Openings, opened_run
    from maze_machine.commands.run_map import RunMaps
    from maze_machine.commands.run_terminal import in_terminal, terminal_run
    from maze_machine.drive.attempts import attempts as attempts_of
    from maze_machine.drive.mission import prepare
    from maze_machine.drive.operation import Together, scheduled
    from maze_machine.report.outputs import Outputs
    from maze_machine.simulated.choices import MazeWords

    words = MazeWords(start, tuple(exits or ()), goal, metres_a_pixel, metres_a_cell, grey, objects)
    if connect is not None:
        refuse_with_connect(
            {"--maze": maze, "--simulate": simulate, "--fault": fault, "--speed": speed}
            | {"what is said of the maze (--start, --goal, ...)": words != MazeWords()}
        )
    refuse_files(record, picture, practice=practice)
    profile = chosen_profile(robot, machine, settings or ())
    mission = prepare(machine, profile, map(split_setting, parameters or ()), time_limit, library)
    maps = RunMaps.of(map_file, at, save_to, record, profile.perception)
    rules = [*(simulate or ()), *(["rules.practice=true"] if practice else [])]
    world = (
        None
        if connect is not None
        else embedded(maze_near(machine) if maze is None else maze, words, profile, seed or 0, rules, fault or ())
    )
    script = scheduled(event_at or (), mission.machine)
    outputs, most = Outputs(trace, record, dated, quiet=tui), 2 if practice else attempts
    check_outputs(
        {"--trace": trace, "--record": record, "--picture": picture, "--save-map": save_to},
        [robot or "", maze or "", objects or "", map_file or "", *mission.machine.model.files],
    )
    files, losses = dict[str, Path](), list[str]()
    screen = terminal_run(view=view) if tui else None
    gc.freeze()  # what is loaded stays: a tick does not wait for a search through it for garbage
    with ExitStack() as stack:
        stack.push(_telling(losses))
        link = None
        if connect is not None and most > 1:
            link = stack.enter_context(closing(in_lockstep(reached(connect, identity, profile, seed))))

        openings = Openings(open_at, identity, view, host, port, watched=view or tui)
        forwarders = [stack.enter_context(one) for one in telling(tell or (), identity, mission, losses)]
        operated, opened = stack.enter_context(opened_run(openings, mission, world, speed))

        repeated = world or link
        looking: list[TickWatcher] = [*opened, *forwarders] if screen is None else [screen, *opened, *forwarders]
        driven: Iterable[Attempt] = attempts_of(
            mission,
            hold_of(world, link, operated, lambda: reached(str(connect), identity, profile, seed)),
            lambda number: outputs.of_attempt(number).watchers(mission, machine, world, losses, looking),
            most,
            (lambda: False) if repeated is None else repeated.try_again,
            operator=Together(script, operated),
            truth=None if world is None else world.pose,
            memory=maps.memory,
            own_map=maps.own,
        )
        if screen is not None:
            driven = in_terminal(mission.machine.name, screen, world, operated, driven)
        for attempt in driven:
            told = [] if repeated is None or most == 1 else repeated.attempts()
            result = result_of(attempt, mission, outputs, told, files)
            if not no_picture:
                drawn = picture or default_picture(mission.machine.name, attempt.ending.report)
                files |= picture_of(attempt, drawn, world, result.line, losses)
            files |= maps.saved(attempt, losses)
        say(result, json=json)
    end(result, losses)


def result_of(
    attempt: Attempt,
    mission: Mission,
    outputs: Outputs,
    told: Sequence[Mapping[str, Any]],
    files: dict[str, Path],
) -> Result:
    """The result of an attempt; the files that were written of it are added to those of the run."""
    from maze_machine.report.outputs import kind_of
    from maze_machine.report.result import Result

    written = outputs.of_attempt(attempt.number).files
    files |= {kind_of(kind, attempt.number): file for kind, file in written.items()}
    counts = link_counts(attempt.robot)
    return Result(mission.machine.name, mission.parameters, attempt.ending, files, counts, told)


def picture_of(
    attempt: Attempt, file: Path, world: SimulatedWorld | None, title: str, losses: list[str]
) -> dict[str, Path]:
    """The picture of an attempt, by its kind; empty where the disk did not take it."""
    from maze_machine.report.outputs import kind_of, numbered

    drawn = numbered(file, attempt.number)
    kept = has_picture(drawn, world, attempt, title, losses)
    return {kind_of("picture", attempt.number): drawn} if kept else {}


def say(result: Result, *, json: bool) -> None:
    """Print the result."""
    from json import dumps

    print(dumps(result.as_json()) if json else "\n".join(result.lines()), flush=True)


def end(result: Result, losses: Sequence[str]) -> NoReturn:
    """Say which files are not complete, and end.

    Raises:
        Exit: with the status of the run.
        FileError: a file is not complete.
    """
    if losses:
        raise FileError("; ".join(losses))
    raise typer.Exit(ExitStatus.OK if result.solved else ExitStatus.FAILED)


def maze_near(machine: str) -> str:
    """The maze of a machine's project, else the one where nobody says anything.

    Raises:
        FileError: the project's settings are wrong.
    """
    from maze_machine.catalogue.project import default_maze

    return default_maze(DEFAULT_MAZE, machine)


def embedded(
    maze: str,
    words: MazeWords,
    profile: Profile,
    seed: int,
    settings: Sequence[str],
    faults: Sequence[str],
) -> SimulatedWorld:
    """The world of the simulator in this process.

    Raises:
        FileError: there is no such maze.
        MazeError: the maze cannot be used.
        UsageError: a setting or a fault is wrong.
    """
    from maze_machine.simulated.settings import simulator_settings
    from maze_machine.simulated.world import SimulatedWorld, find_maze

    simulator = simulator_settings(settings, faults)
    drawn = find_maze(maze, words.choices(), robot=profile.robot)
    return SimulatedWorld(drawn, profile.robot, seed, simulator)


def refuse_files(record: Path | None, picture: Path | None, *, practice: bool) -> None:
    """Refuse files that cannot be written of such a run.

    Raises:
        UsageError: a recording of practice, or a picture of no known format, was asked for.
    """
    from maze_machine.arguments.files import PICTURES, check_suffix

    if practice and record is not None:
        raise UsageError("--record does not go with --practice", "a replay would lack what was learned; take --trace")
    check_suffix("--picture", picture, PICTURES)


def has_picture(file: Path, world: SimulatedWorld | None, attempt: Attempt, title: str, losses: list[str]) -> bool:
    """Save the picture of an attempt; whether the disk took it. If not, a sentence is added to the losses."""
    from maze_machine.report.run_picture import save_run

    try:
        save_run(file, world, attempt.trail, title, attempt.map)
    except OSError as error:
        losses.append(f"no picture: {error.filename or file}: {error.strerror}")
        return False
    return True


def _telling(losses: Sequence[str]) -> Callable[..., None]:
    """On leaving a run that was ended by an error: say too which files lack something."""

    def say(kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None:
            for loss in losses:
                print(f"maze-machine: {loss}", file=sys.stderr)

    return say


def telling(
    others: Sequence[str], identity: Path | None, mission: Mission, losses: list[str]
) -> Iterator[EventForwarder]:
    """What forwards to other robots' machines what this one sends.

    Raises:
        UsageError: one of them is not written as a robot and an endpoint.
    """
    if not others:
        return
    from functools import partial

    from maze_machine.arguments.network import secured
    from maze_machine.remote.telling import EventForwarder
    from transport.connect import dialling

    link = mission.profile.link
    for other in others:
        robot, at, endpoint = other.partition("@")
        if not (robot and at and endpoint):
            raise UsageError(f"--tell {other}: no robot and endpoint", "write ROBOT@ENDPOINT: blue@tcp/127.0.0.1:7449")
        security = secured(endpoint, identity, link)
        yield EventForwarder(partial(dialling, endpoint, wait=link.connect, security=security), robot, losses)


def refuse_with_connect(embedded: Mapping[str, object]) -> None:
    """Refuse options of the embedded simulator where there is none.

    Raises:
        UsageError: one of them was given.
    """
    for option, value in embedded.items():
        if value:
            raise UsageError(f"{option} does not go with --connect", "give it to `maze-machine sim`")


def reached(endpoint: str, identity: Path | None, profile: Profile, seed: int | None) -> RemoteLockstep | RealtimeRobot:
    """The robot at an endpoint.

    Raises:
        LinkError: nobody can be reached there, or the robot is not available.
    """
    from maze_machine.arguments.network import secured
    from transport.connect import connect_robot

    security = secured(endpoint, identity, profile.link)
    return connect_robot(endpoint, profile.robot, profile.link, seed=seed, security=security)


def hold_of(
    world: SimulatedWorld | None,
    link: RemoteLockstep | None,
    operated: OperatedRun,
    reach: Callable[[], RemoteLockstep | RealtimeRobot],
) -> Callable[[], RefereedRobot]:
    """What takes hold of the robot for an attempt, and lets its operator know whether it waits for its controller.

    Args:
        world: the simulator in this process, if there is one.
        link: the simulator elsewhere, where several attempts share it.
        operated: the run's operator.
        reach: takes hold of a robot elsewhere.
    """
    from maze_machine.drive.attempts import KeptRobot
    from transport.world import LockstepRobot

    def take_hold() -> RefereedRobot:
        if world is not None:
            return LockstepRobot(world)
        robot = reach() if link is None else KeptRobot(link)
        operated.drives(waits=link is not None or waits(robot), keep=robot.report)
        return robot

    return take_hold


def waits(robot: object) -> bool:
    """Whether a robot's time waits for its controller."""
    from transport.lockstep import RemoteLockstep

    return isinstance(robot, RemoteLockstep)


def in_lockstep(robot: RemoteLockstep | RealtimeRobot) -> RemoteLockstep:
    """The robot, if its time waits for its controller: another attempt is then the simulator's to grant.

    Raises:
        UsageError: it does not.
    """
    from transport.lockstep import RemoteLockstep

    if isinstance(robot, RemoteLockstep):
        return robot
    robot.close()
    raise UsageError("in real time attempts are made one by one", "put the robot back and give the command again")


def link_counts(robot: object) -> dict[str, int]:
    """What was counted on the link to a robot, by what it is called."""
    named = {"overruns": "overruns", "reconnects": "reconnects", "resent": "steps asked for again"}
    counts = {words: int(getattr(robot, name)) for name, words in named.items() if hasattr(robot, name)}
    dropped, clock = getattr(robot, "dropped", {}), getattr(robot, "clock_faults", {})
    counts |= {f"dropped, {reason}": count for reason, count in dropped.items()}
    return counts | {f"the robot's clock {fault}": count for fault, count in clock.items()}


def default_picture(machine: str, report: Mapping[str, Any]) -> Path:
    """Where the picture of a run goes if nobody says so: ``runs/MACHINE-MAZE-SEED.png``."""
    names = [machine, str(report.get("maze", "robot")), str(report.get("seed", ""))]
    stem = "-".join(re.sub(r"[^\w.]+", "_", name) for name in names if name)
    return Path("runs") / f"{stem}.png"
