"""The maps of a run: one to begin with, one to save."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from maze_machine.errors import UsageError

if TYPE_CHECKING:
    from maze_machine.drive.attempts import Attempt
    from perception import WorldModel
    from perception.map_document import MapDocument
    from perception.settings import PerceptionSettings
    from transport.messages import Pose

SUFFIX = ".map"
_EXAMPLE = '--at start, or as in --at "1.5 2 90": x and y in metres, heading in degrees, in the frame of the map'


@dataclass(frozen=True, slots=True)
class RunMaps:
    """The map that a run begins with, and the file for the one that it leaves.

    Attributes:
        settings: perception's thresholds.
        document: the map at the beginning; None for none.
        at: where on it the robot is; None where nobody knows.
        file: for the map at the end; None to save none.
    """

    settings: PerceptionSettings
    document: MapDocument | None = None
    at: Pose | None = None
    file: Path | None = None

    @classmethod
    def of(
        cls, read: Path | None, at: str | None, save: Path | None, record: Path | None, settings: PerceptionSettings
    ) -> RunMaps:
        """The maps that the user has asked for.

        Args:
            read: the file of the map to begin with.
            at: the place on it, as the user wrote it.
            save: the file for the map at the end.
            record: the file for a recording.
            settings: perception's thresholds.

        Raises:
            MapError: the map cannot be used.
            OSError: it cannot be read.
            FileError: there is no folder for the map at the end.
            UsageError: the options do not go together, the place is not written as one, or is not on the map.
        """
        from maze_machine.arguments.files import check_folder, check_suffix

        check_suffix("--save-map", save, (SUFFIX,))
        check_folder("--save-map", save)
        if read is None:
            if at is not None:
                raise UsageError("--at needs --map", "give the map's file, too")
            return cls(settings, file=save)
        if record is not None:
            raise UsageError("--record cannot be combined with --map", "a replay would lack the map; take --trace")
        from perception.map_document import read_map

        document = read_map(read)
        return cls(settings, document, None if at is None else _place(at, document, read), save)

    def memory(self) -> WorldModel | None:
        """What a robot knows when an attempt begins; None for nothing."""
        from perception.saved_map import world_of

        return None if self.document is None else world_of(self.document, self.settings, self.at)

    def own(self) -> WorldModel | None:
        """A memory in which to make the map that is asked for, where the machine makes none; None to make none."""
        from perception import WorldModel

        return None if self.file is None else WorldModel(self.settings)

    def saved(self, attempt: Attempt, losses: list[str]) -> dict[str, Path]:
        """Save the map of an attempt, if that is asked for.

        Returns:
            Its file by its kind; empty, with a sentence in the losses, where the robot has none.
        """
        from maze_machine.report.outputs import kind_of, numbered
        from perception.map_document import write_map
        from perception.saved_map import document_of

        if self.file is None:
            return {}
        file, world = numbered(self.file, attempt.number), attempt.map.world
        document = None if world is None else document_of(world, left=bool(attempt.ending.report.get("escaped")))
        if document is None:
            losses.append(f"no map: the robot has seen nothing from which to make {file}")
            return {}
        try:
            write_map(file, document)
        except OSError as error:
            losses.append(f"no map: {error.filename or file}: {error.strerror}")
            return {}
        return {kind_of("map", attempt.number): file}


def _place(at: str, document: MapDocument, file: Path) -> Pose:
    """A place on a map, as the user wrote it."""
    from perception.saved_map import start_of
    from transport.messages import Pose

    if at.strip() == "start":
        return start_of(document)
    try:
        x, y, degrees = map(float, at.replace(",", " ").split())
    except ValueError:
        raise UsageError(f"--at {at}: no place", _EXAMPLE) from None
    if not all(map(math.isfinite, (x, y, degrees))):
        raise UsageError(f"--at {at}: no place", _EXAMPLE)
    if not document.covers(x, y):
        raise UsageError(f"--at {at}: this place is not on the map", f"see `maze-machine map show {file}`")
    return Pose(x, y, math.radians(degrees))
