"""A remote machine, watched over the network."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from maze_machine.debug.chart import Chart
from maze_machine.debug.heard import HeardStep
from maze_machine.debug.runs import Run, RunError
from maze_machine.debug.steps import Step
from maze_machine.errors import CommandError, UsageError
from maze_machine.remote.client import RemoteMachine
from maze_machine.remote.described import ForeignMessageError
from maze_machine.remote.messages import AdvanceRun, Operation, Pause, Resume, SendEvent
from maze_machine.remote.reaching import reaching

MOST = 20_000
"""How many steps of a remote run are kept."""


@dataclass(slots=True)
class RemoteRun:
    """A remote machine. It is watched; only a simulation can be paused."""

    chart: Chart
    machine: RemoteMachine
    let_go: Callable[[], None]
    steps: list[Step] = field(default_factory=list)
    over: str = ""
    _pausable: bool = True
    _tick: object = None
    _newest: Callable[[], dict[str, Any] | None] = field(init=False)

    quiet = False
    fixed = "the machine runs in another process; `send EVENT` sends it an event"

    def __post_init__(self) -> None:
        """Listen."""
        self._newest = self.machine.newest_step()

    def advance(self) -> bool:
        """The newest tick, if it has not been seen yet."""
        try:
            heard = None if self.over else self._newest()
        except ForeignMessageError as error:
            heard, self.over = None, str(error)
        if heard is None or (self.steps and heard.get("tick") == self._tick):  # one that is published once more
            return False
        self._tick = heard.get("tick")
        before = frozenset(self.steps[-1].states(0)) if self.steps else frozenset[str]()
        step = HeardStep(self.chart, heard, before)
        self.steps.append(step)
        if step.outcome is not None:
            self.over = f"the machine ended in {step.outcome}"
        return True

    def forget(self) -> int:
        """The older half of too many steps."""
        if len(self.steps) <= MOST:
            return 0
        del self.steps[: MOST // 2]
        return MOST // 2

    def pending(self) -> Mapping[str, str]:
        """Nothing is ever changed."""
        return {}

    def change(self, step: int, name: str, value: str) -> None:
        """Refused."""
        del step, value
        raise RunError(f"`{name}` cannot be set: {self.fixed}")

    def tell(self, step: int, line: str) -> str:
        """Send an event."""
        del step
        word, _, event = line.strip().partition(" ")
        if word != "send" or not event:
            raise RunError(f"`{line}` is not possible: {self.fixed}")
        self._operate(SendEvent(name=event.strip()))
        return f"sent {event.strip()}"

    def hold(self) -> None:
        """Pause a simulation; a robot continues, and only the view stops."""
        self._ask(Pause())

    def go(self, ticks: int | None) -> None:
        """Have a simulation go on."""
        self._ask(Resume() if ticks is None else AdvanceRun(ticks=ticks))

    def close(self) -> None:
        """Resume a paused simulation, and leave."""
        self.go(None)
        self.let_go()

    def _ask(self, operation: Operation) -> None:
        if not self._pausable:
            return
        try:
            self._pausable = self.machine.operate(operation).done
        except CommandError:
            self.over = "the robot has no controller any more"

    def _operate(self, operation: Operation) -> None:
        try:
            answer = self.machine.operate(operation)
        except CommandError as error:
            raise RunError(str(error)) from None
        if not answer.done:
            raise RunError(f"the machine refuses: {answer.reason}")


def attached(chart: Chart, endpoint: str, robot: str | None, identity: str | None) -> Run:
    """The machine that is open to viewers at an endpoint.

    Raises:
        LinkError: no program can be reached there.
        NoMachineError: no machine answers.
        ForeignMessageError: what it sends is not of the published form.
        UsageError: another machine runs there.
    """
    with ExitStack() as stack:
        certificate = None if identity is None else Path(identity)
        client = stack.enter_context(reaching(endpoint, robot, certificate))
        running = client.model()["machine"]
        if running != chart.machine.name:
            raise UsageError(f"the machine that runs there is `{running}`, and `program` is `{chart.machine.name}`")
        kept = ExitStack()
        run = RemoteRun(chart, client, kept.close)
        kept.push(stack.pop_all())
    return run
