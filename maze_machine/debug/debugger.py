"""The position of a debugger in a run, and its moves: point by point, step by step, to a breakpoint, and back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

from maze_machine.debug.breakpoints import Breakpoints, Hit
from maze_machine.debug.runs import Run, RunError
from maze_machine.debug.steps import Step


class Goal(Enum):
    """How far to go."""

    POINT = "the next microstep"
    STEP = "the end of the step"
    LEAVE = "until the innermost state is left"
    BREAK = "to the next breakpoint"


@dataclass(frozen=True, slots=True)
class StopReason:
    """Why the debugger has stopped.

    Attributes:
        reason: in the words of the protocol.
        text: for a person.
        numbers: the breakpoints that were met.
    """

    reason: str
    text: str = ""
    numbers: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class _Motion:
    """A move in progress."""

    goal: Goal
    back: bool
    reached: Callable[[], bool]


@dataclass(slots=True)
class Debugger:
    """A place in a run.

    Attributes:
        run: the run.
        breakpoints: where to stop.
        say: receives the messages of logpoints.
        at: the number of the step.
        point: the point in it.
    """

    run: Run
    breakpoints: Breakpoints
    say: Callable[[str], None]
    at: int = 0
    point: int = 0
    _motion: _Motion | None = field(default=None)

    @property
    def step(self) -> Step:
        """The step where the debugger is."""
        return self.run.steps[self.at]

    @property
    def moving(self) -> bool:
        """Whether a move is in progress."""
        return self._motion is not None

    @property
    def newest(self) -> bool:
        """Whether the next point is not known yet."""
        return self.point == self.step.count and self.at == len(self.run.steps) - 1

    def to_entry(self) -> None:
        """Go to where the initial states are entered."""
        self.point = self.step.count

    def to_newest(self) -> None:
        """Go to the last known point."""
        self.at = len(self.run.steps) - 1
        self.point = self.step.count

    def begin(self, goal: Goal, *, back: bool = False) -> None:
        """Begin a move; ``move`` executes it."""
        start, states = self.step, self.step.states(self.point)
        ended = self.point == start.count

        def reached() -> bool:
            match goal:
                case Goal.POINT:
                    return True
                case Goal.STEP:
                    return self.point == self.step.count and not (ended and self.step is start)
                case Goal.LEAVE:
                    return not states or states[-1] not in self.step.states(self.point)
                case Goal.BREAK:
                    return False

        self._motion = _Motion(goal, back, reached)
        if self.newest and not back:
            self.run.go(1 if goal in (Goal.POINT, Goal.STEP) else None)

    def halt(self) -> None:
        """Stop where it is."""
        self._motion = None
        self.run.hold()

    def move(self, most: int) -> StopReason | None:
        """Continue the move; return why the debugger stops, or None if the move is not finished.

        Args:
            most: the largest number of points per call.
        """
        for _ in range(most):
            motion = self._motion
            if motion is None:
                return None
            before = (self.step, self.point)
            try:
                moved = self._backward() if motion.back else self._forward()
            except RunError as error:
                return self._stopped(StopReason("exception" if self.breakpoints.faults else "pause", str(error)))
            if not moved:
                return self._at_an_end(motion)
            stop = self._met(before)
            if stop is None and motion.reached():
                stop = StopReason("step")
            if stop is None and self._waits(motion):
                stop = StopReason("pause", "nothing happens until a signal changes or an outcome or event arrives")
            if stop is not None:
                return self._stopped(stop)
        return None

    def _met(self, before: tuple[Step, int]) -> StopReason | None:
        """Why to stop at the point that was reached."""
        stops: list[Hit] = []
        for hit in self.breakpoints.met((self.step, self.point), before):
            if hit.stops:
                stops.append(hit)
            else:
                self.say(hit.text)
        if not stops:
            return None
        texts, numbers = ", ".join(one.text for one in stops), tuple(n for one in stops for n in one.numbers)
        return StopReason(stops[0].kind, texts, numbers)

    def _waits(self, motion: _Motion) -> bool:
        return not motion.back and self.newest and self.run.quiet

    def _at_an_end(self, motion: _Motion) -> StopReason | None:
        if motion.back:
            return self._stopped(StopReason("entry", "the beginning"))
        return self._stopped(StopReason("pause", self.run.over)) if self.run.over else None

    def _stopped(self, stop: StopReason) -> StopReason:
        self.halt()
        return stop

    def _forward(self) -> bool:
        if self.point < self.step.count:
            self.point += 1
            return True
        if self.at == len(self.run.steps) - 1:
            if not self.run.advance():
                return False
            self.at -= self.run.forget()
        self.at += 1
        self.point = 0
        return True

    def _backward(self) -> bool:
        if self.point > (self.step.count if self.at == 0 else 0):
            self.point -= 1
        elif self.at > 0:
            self.at -= 1
            self.point = self.step.count
        else:
            return False
        return True
