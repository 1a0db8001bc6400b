"""A run in a terminal of its own, for a robot that one reaches by ssh: active states, why, a small plan, and stop."""

from __future__ import annotations

import json
import math
from collections import deque
from collections.abc import Callable, Sequence
from threading import Thread
from typing import Any

from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical
from textual.widgets import Footer, Static

from hsm.engine.explanation import Considered, Verdict, by_transition
from hsm.model.chart import Transition
from hsm.model.unparse import trigger_text, value_text
from maze_machine.drive.mission import Ending
from maze_machine.drive.tick import Tick
from maze_machine.report.text_plan import Line, text_plan

REFRESH = 0.2
"""Between two pictures, s: little enough for a slow connection."""
WAY = 4_000
"""That many of the newest places of the robot are drawn."""
MARKS = {Verdict.TAKEN: "✔", Verdict.FALSE: "✘", Verdict.NOT_DUE: "◷", Verdict.FAILED: "⚠"}


class TerminalRun:
    """What a terminal shows of a run: the newest tick, the way so far, the end; a watcher of ticks.

    Attributes:
        tick: the newest one; None before the first.
        way: where the robot has been, m.
        ending: how it ended; None while it runs.
    """

    def __init__(self) -> None:
        self.tick: Tick | None = None
        self.way: deque[tuple[float, float]] = deque(maxlen=WAY)
        self.ending: Ending | None = None

    def __call__(self, tick: Tick) -> None:
        """Take in a tick."""
        pose = tick.truth or tick.pose
        self.way.append((pose.x, pose.y))
        self.tick, self.ending = tick, None

    def end(self, ending: Ending) -> None:
        """Take in the end; the base stands still by then."""
        self.ending = ending


class RunTerminal(App[None]):
    """Shows a run that another thread drives, and operates it.

    Args:
        title: the machine's name.
        shown: what is seen of the run.
        walls: segments as x1, y1, x2, y2, m; none where the maze is not known.
        operate: does what an operator asks for, and gives the answer; both are JSON.
        work: the run itself; it begins when the terminal is ready.

    Attributes:
        failure: what ended the run, if that was an error.
    """

    CSS = """
    #now { height: 1; text-style: bold; } #status { height: auto; max-height: 4; }
    #plan { width: 1fr; height: 100%; border: round $primary; } #side { width: 1fr; height: 100%; }
    #states { height: auto; max-height: 40%; border: round $primary; }
    #why { height: 1fr; border: round $primary; } #facts { height: auto; max-height: 30%; border: round $primary; }
    """
    ENABLE_COMMAND_PALETTE = False
    BINDINGS = [  # noqa: RUF012 - textual's own form
        Binding("space", "hold", "Pause"),
        Binding("full_stop", "advance", "One tick"),
        Binding("s", "stop", "Stop"),
        Binding("q,ctrl+q,ctrl+c", "leave", "Leave", priority=True),
    ]

    def __init__(
        self,
        title: str,
        shown: TerminalRun,
        walls: Sequence[Line],
        operate: Callable[[bytes], bytes],
        work: Callable[[], None],
    ) -> None:
        super().__init__()
        self.failure: BaseException | None = None
        self._machine, self._shown, self._walls, self._operate = title, shown, walls, operate
        self._work = Thread(target=self._run_work, args=(work,), name="run", daemon=True)
        self._held = self._leaving = False
        self._said = ""

    def compose(self) -> ComposeResult:
        """The parts of the screen."""
        yield Static(id="now")
        with Horizontal():
            yield Static(id="plan")
            with Vertical(id="side"):
                yield Static(id="states")
                yield Static(id="why")
                yield Static(id="facts")
        yield Static(id="status")
        yield Footer()

    def on_mount(self) -> None:
        """Begin the run and show it."""
        for name in ("plan", "states", "why", "facts"):
            self.query_one(f"#{name}").border_title = {"facts": "variables"}.get(name, name)
        self._work.start()
        self.set_interval(REFRESH, self.show_now)

    def show_now(self) -> None:
        """Show the newest tick."""
        over = not self._work.is_alive()
        if over and (self._leaving or self.failure is not None):
            self.exit()
            return
        tick = self._shown.tick
        if tick is not None:
            plan = self.query_one("#plan", Static)
            size = plan.content_size
            drawn = text_plan(self._walls, list(self._shown.way), tick.truth or tick.pose, size.width, size.height)
            self._put("now", now_line(self._machine, tick))
            self._put("plan", "\n".join(drawn))
            self._put("states", "\n".join(tick.configuration))
            self._put("why", "\n".join(why_lines(tick)))
            self._put("facts", "\n".join(variable_lines(tick)))
        self._put("status", self._status(tick))

    def _put(self, name: str, text: str) -> None:
        self.query_one(f"#{name}", Static).update(Text(text))

    def _status(self, tick: Tick | None) -> str:
        if self._shown.ending is not None:
            ending = self._shown.ending
            base = "The base has stopped." if ending.at_rest else "It is not confirmed that the base has stopped."
            return "\n".join([*ending.as_json()["lines"], f"{base} q leaves."])
        if self._said:
            return self._said
        if tick is None:
            return "Waiting for the first tick"
        return f"The base is kept stopped: {tick.blind}" if tick.blind else "paused" if self._held else ""

    def action_hold(self) -> None:
        """Pause the simulation, or go on."""
        if self._done({"kind": "resume" if self._held else "pause"}):
            self._held = not self._held

    def action_advance(self) -> None:
        """One tick, while it is paused."""
        if self._held:
            self._done({"kind": "advance", "ticks": 1})

    def action_stop(self) -> None:
        """End the run."""
        if self._done({"kind": "end"}):
            self._said = "Stopping: waiting until the base has stopped"

    def action_leave(self) -> None:
        """Leave the terminal; a run that goes on is ended first."""
        self._leaving = True
        if self._work.is_alive():
            self.action_stop()
        else:
            self.exit()

    def _done(self, question: dict[str, Any]) -> bool:
        answer = json.loads(self._operate(json.dumps(question).encode()))
        self._said = "" if answer["done"] else f"Refused: {answer['reason']}"
        return bool(answer["done"])

    def _run_work(self, work: Callable[[], None]) -> None:
        try:
            work()
        except BaseException as error:  # it is raised again where the terminal is left
            self.failure = error


def now_line(name: str, tick: Tick) -> str:
    """Machine, time, what it does, velocity, in at most 80 columns."""
    twist = tick.command.twist
    speed = math.hypot(twist.forward, twist.left)
    return f"{name[:20]}  {tick.time:.1f} s  {tick.doing[-30:]}  {speed:.2f} m/s  {twist.turn:.2f} rad/s"


def variable_lines(tick: Tick) -> list[str]:
    """Variables and parameters with their units."""
    model = tick.report.machine.model
    types = {one.name: one.type for one in model.parameters} | {one.name: one.type for one in model.variables}
    return [f"{name} = {value_text(value, types.get(name))}" for name, value in tick.variables.items()]


def why_lines(tick: Tick) -> list[str]:
    """The verdict on each transition of the state that names the tick and of those around it, innermost first."""
    states, indices = tick.report.machine.model.states, tick.report.machine.indices
    around: list[int] = []
    at = indices.get(tick.doing, 0)
    while at >= 0:
        around.append(at)
        at = states[at].parent
    looked = by_transition(tick.report.verdicts)
    transitions = tick.report.machine.model.transitions
    here = [transitions[index] for state in around for index in states[state].transitions]
    return [_line(one, looked.get(one.index)) for one in here]


def _line(transition: Transition, looked: Considered | None) -> str:
    line = "" if transition.place is None else f"{transition.place.line}: "
    trigger = trigger_text(transition.trigger, transition.guard)
    if looked is None:
        return f"  {line}{trigger}: not considered in this tick"
    return f"{MARKS.get(looked.verdict, '•')} {line}{trigger}: {looked.reason}"
