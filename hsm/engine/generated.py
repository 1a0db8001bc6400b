"""What is made of guards and actions: chains of candidates and blocks of actions, as generated functions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from enum import Enum
from types import CodeType, TracebackType

from hsm.model.chart import Action
from hsm.model.diagnostics import Place
from hsm.model.values import dataclass

NONE = -1
"""The result of a chain if no transition fires."""


@dataclass(frozen=True, slots=True, eq=False)
class CandidateChain:
    """Candidates in their order of precedence, and the function that picks one.

    Attributes:
        candidates: indices of the transitions.
        pick: gives the index of the transition that fires, or ``NONE``; for time-outs it takes the due ones, too.
    """

    candidates: tuple[int, ...]
    pick: Callable[..., int]


class Occasion(Enum):
    """When actions are run."""

    ENTRY = "entry"
    EXIT = "exit"
    TRANSITION = "transition"
    INITIAL = "initial"
    REPEAT = "repeat"


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Actions that are run together.

    Attributes:
        run: runs them.
        actions: what is run, for the record.
        state: index of the state that they belong to.
        role: when they are run.
        code: the function's code, to find it in a traceback.
        places: where each line of the code comes from.
        watches: whether they ask which states are active.
    """

    run: Callable[..., None]
    actions: tuple[Action, ...]
    state: int
    role: Occasion
    code: CodeType
    places: tuple[Place | None, ...]
    watches: bool

    @property
    def enters(self) -> bool:
        """Whether the state is entered: its variables are set and its time-outs begin before the actions."""
        return self.role is Occasion.ENTRY

    def place_of(self, error: BaseException) -> Place | None:
        """Where in the machine's file an exception came from."""
        lines = [line for code, line in _frames(error.__traceback__) if code is self.code]
        return self.places[lines[-1] - 1] if lines else None


def _frames(traceback: TracebackType | None) -> Iterator[tuple[CodeType, int]]:
    while traceback is not None:
        yield traceback.tb_frame.f_code, traceback.tb_lineno
        traceback = traceback.tb_next
