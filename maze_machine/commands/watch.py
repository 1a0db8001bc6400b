"""``maze-machine watch`` and ``maze-machine send``: a machine that runs elsewhere, seen and operated."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from maze_machine.arguments.options import OPEN, IdentityOption, JsonOption, RobotOption
from maze_machine.errors import ExitStatus, UsageError

ConnectOption = Annotated[
    str, typer.Option(metavar="ENDPOINT", help="The endpoint where the running machine listens: its `run --open`.")
]


def watch(
    connect: ConnectOption = OPEN,
    robot: RobotOption = None,
    identity: IdentityOption = None,
    why: Annotated[
        str | None,
        typer.Option(metavar="STATE", help="Print once why the transitions of this state fire or not, and end."),
    ] = None,
    silence: Annotated[
        float, typer.Option(min=0.1, metavar="SECONDS", help="End when no message has arrived for this long.")
    ] = 5.0,
    json: JsonOption = False,
) -> None:
    """Watch a running machine: its states, transitions and variables, line by line as they change.

    Any number of programs may watch; the machine waits for none of them. With `--json` each tick is printed as one
    line, as published.

    Example: `maze-machine watch --connect tcp/127.0.0.1:7448`

    Example: `maze-machine watch --why maze.straight`
    """
    from json import dumps

    from maze_machine.remote.reaching import reaching
    from transport.wording import printable

    with reaching(connect, robot, identity) as machine:
        if why is not None:
            found = machine.why(why)
            print(dumps(found) if json else "\n".join(map(printable, _reasons(found))))
            raise typer.Exit(ExitStatus.FAILED if "reason" in found else ExitStatus.OK)
        model = machine.model()
        if not json:
            print(printable(f"machine {model['machine']}"))
        shown: tuple[Any, ...] = ()
        for step in machine.steps(silence):
            if json:
                print(dumps(step), flush=True)
                continue
            now = tuple(step.get(one) for one in ("states", "variables", "blind", "outcome", "paused"))
            if now != shown or step.get("taken"):
                print(printable(_line(step)), flush=True)
                shown = now
            if step.get("outcome"):
                break


def send(
    event: Annotated[
        str | None,
        typer.Argument(help='The event with its data: go, or "floor(3)"; the machine must declare it.'),
    ] = None,
    connect: ConnectOption = OPEN,
    robot: RobotOption = None,
    identity: IdentityOption = None,
    setting: Annotated[
        str | None,
        typer.Option(
            "--set", metavar="NAME=VALUE", help="Change a parameter that the machine declares as `adjustable`."
        ),
    ] = None,
    pause: Annotated[bool, typer.Option("--pause", help="Pause a simulation.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="Resume it.")] = False,
    advance: Annotated[
        int | None, typer.Option(min=1, max=1_000_000, metavar="TICKS", help="Advance it by this many ticks.")
    ] = None,
    pause_at: Annotated[
        str | None,
        typer.Option(
            "--pause-at",
            metavar="PLACE",
            help='Pause a simulation where it comes to a state, a transition ("line 12", door:12) or a condition '
            '("turns == 2"); "" to take that back.',
        ),
    ] = None,
    stop: Annotated[bool, typer.Option("--stop", help="End the run; the robot is stopped.")] = False,
) -> None:
    """Send an event to a running machine, change a parameter, or pause, resume or end its run.

    The event and the change are part of the run: the trace and the recording contain them, and a replay repeats them.

    Example: `maze-machine send go --connect tcp/127.0.0.1:7448`

    Example: `maze-machine send --set cruise=0.3m/s`

    Example: `maze-machine send --stop`
    """
    from pydantic import ValidationError

    from maze_machine.arguments.parameters import split_setting
    from maze_machine.remote.messages import AdvanceRun, EndRun, Pause, PauseAt, Resume, SendEvent, SetParameter
    from maze_machine.remote.reaching import reaching
    from transport.wording import in_words

    asked: list[Any] = []
    try:
        asked += [SendEvent(name=event)] if event else []
        if setting is not None:
            name, value = split_setting(setting, "--set")
            asked.append(SetParameter(parameter=name, value=value))
        asked += [PauseAt(at=pause_at)] if pause_at is not None else []
        asked += [AdvanceRun(ticks=advance)] if advance is not None else []
    except ValidationError as error:
        raise UsageError(in_words(error.errors(include_url=False)[0])[:200]) from None
    asked += [Pause()] * pause + [Resume()] * resume + [EndRun()] * stop
    if len(asked) != 1:
        raise UsageError("give one thing to do", "an event, --set, --pause, --pause-at, --resume, --advance or --stop")
    with reaching(connect, robot, identity) as machine:
        answer = machine.operate(asked[0])
    if not answer.done:
        raise UsageError(f"the machine refuses: {answer.reason}")


def _line(step: dict[str, Any]) -> str:
    """A tick in one line: time, states, transitions, variables."""
    parts = [f"{step.get('stamp', 0) / 1e9:8.1f} s", ", ".join(map(str, step.get("states", ())))]
    parts += [f"took {taken}" for taken in step.get("taken", ())]
    parts += [f"heard {event}" for event in step.get("events", ())]
    parts += [f"sent {event}" for event in step.get("sent", ())]
    variables = ", ".join(f"{name} = {value}" for name, value in step.get("variables", {}).items())
    parts += [variables] if variables else []
    parts += [f"stopped: {step['blind']}"] if step.get("blind") else []
    parts += [f"paused: {step['paused']}"] if step.get("paused") else []
    parts += [f"ended in {step['outcome']}"] if step.get("outcome") else []
    return "  ".join(parts)


def _reasons(found: dict[str, Any]) -> list[str]:
    if "reason" in found:
        return [str(found["reason"])]
    head = f"tick {found['tick']}: {found['state']} is {'active' if found['active'] else 'not active'}"
    return [head, *(f"  line {one['line']}: {one['trigger']}: {one['reason']}" for one in found["transitions"])]
