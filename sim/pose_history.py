"""Where a robot has been: poses kept as plain numbers, so that an hour of them takes little room."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from typing import overload

from transport.messages import Pose


class PoseHistory(Sequence[Pose]):
    """A sequence of poses that only grows at its end; 24 bytes each."""

    def __init__(self) -> None:
        self._numbers = array("d")

    def append(self, pose: Pose) -> None:
        """Add a pose at the end."""
        self._numbers.extend((pose.x, pose.y, pose.heading))

    def __len__(self) -> int:
        return len(self._numbers) // 3

    @overload
    def __getitem__(self, index: int) -> Pose: ...
    @overload
    def __getitem__(self, index: slice) -> list[Pose]: ...
    def __getitem__(self, index: int | slice) -> Pose | list[Pose]:
        if isinstance(index, slice):
            return [self[each] for each in range(*index.indices(len(self)))]
        if not -len(self) <= index < len(self):
            raise IndexError("no such pose")
        at = 3 * (index % len(self))
        return Pose(*self._numbers[at : at + 3])
