"""Where a wait stops: a condition, or the line of a file, with the transitions that are written there."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from hsm.model.chart import Model
from hsm.model.values import dataclass
from hsm.testing.scenarios.driver import Driver

_LINE = re.compile(r"line\s+(\d{1,7})|([^\s:]+):(\d{1,7})", re.ASCII)


@dataclass(frozen=True, slots=True)
class Break:
    """What stops a wait.

    Attributes:
        met: whether it is so after a step.
        lasts: whether it may be so for several steps, of which the first one stops.
    """

    met: Callable[[Driver], bool]
    lasts: bool


def transitions_of_line(text: str, model: Model) -> frozenset[int] | None:
    """The indices of the transitions that are written in a line.

    Args:
        text: ``line 12`` of the machine's own file, or ``door:12`` of an imported one, by its name or its file.
        model: the machine.

    Returns:
        The indices; None if the text names no line.

    Raises:
        ValueError: there is no such file, or no transition in that line.
    """
    found = _LINE.fullmatch(text.strip())
    if found is None:
        return None
    own, name, line = found[1], found[2], int(found[1] or found[3])
    files = [*model.files[:1]] if own else [one for one in model.files if name in (one, Path(one).name, Path(one).stem)]
    if not own and not files:
        known = ", ".join(Path(one).stem for one in model.files) or "none"
        raise ValueError(f"the machine has no file `{name}`; its files: {known}")
    there = frozenset(
        one.index
        for one in model.transitions
        if one.place is not None and one.place.line == line and (not files or one.place.file in files)
    )
    if not there:
        others = [Path(one).stem for one in model.files[1:]] if own else []
        hint = f"; of an imported file: {others[0]}:{line}" if others else ""
        raise ValueError(f"there is no transition in line {line}{hint}")
    return there
