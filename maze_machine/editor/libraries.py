"""The library that each file of an editor is written against."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from maze_machine.catalogue.library import chosen_library, robot_names
from maze_machine.catalogue.project import Project, find_project
from maze_machine.errors import CommandError, UsageError

if TYPE_CHECKING:
    from hsm.model.registry import Library


@dataclass(slots=True)
class EditorLibraries:
    """The library of each file that an editor has open; what a file's project lacks is said once.

    Attributes:
        named: the library of all files, as ``MODULE:NAME``; None for that of each file's project.
        warn: shows a message in the editor.
        trusted: whether the user lets the code of the editor's folders run; None where the editor does not know, so
            that what was decided with ``maze-machine trust`` holds.
    """

    named: str | None
    warn: Callable[[str], object]
    trusted: bool | None = None
    _found: dict[tuple[Path | None, int], Library] = field(default_factory=dict)
    _told: set[str] = field(default_factory=set)
    _of_files: dict[str, Library] = field(default_factory=dict)

    def __call__(self, file: str) -> Library:
        """The library that a file's machine is written against; looked for once, until ``refresh``."""
        if file not in self._of_files:
            self._of_files[file] = self._library(file)
        return self._of_files[file]

    def refresh(self) -> None:
        """Projects may have changed: look for the library of each file anew."""
        self._of_files.clear()

    def _library(self, file: str) -> Library:
        try:
            project = find_project(Path(file).parent)
            key = (None, 0) if project is None else (project.file, project.file.stat().st_mtime_ns)
            if key not in self._found:
                self._found[key] = self._chosen(Path(file), project)
            return self._found[key]
        except CommandError as error:
            message = f"{error}; {error.way_out}" if error.way_out else str(error)
            if message not in self._told:
                self._told.add(message)
                self.warn(f"{message}. Until then machines are checked against the shipped library.")
        shipped = (None, -1)
        if shipped not in self._found:
            self._found[shipped] = robot_names()
        return self._found[shipped]

    def _chosen(self, file: Path, project: Project | None) -> Library:
        if self.trusted is False and self.named is None and project is not None and project.library is not None:
            raise UsageError(f"this workspace is not trusted, so the code of {project.file} does not run")
        return chosen_library(self.named, file, ask=lambda _question: False, vouched=self.trusted is True)
