"""The library of each file in an editor."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib import invalidate_caches
from pathlib import Path
from typing import TYPE_CHECKING

from maze_machine.catalogue.library import chosen_library, named_library, robot_names
from maze_machine.catalogue.project import Project, find_project
from maze_machine.editor.settings import EditorSettings
from maze_machine.errors import CommandError, UsageError

if TYPE_CHECKING:
    from hsm.model.registry import Library


@dataclass(slots=True)
class EditorLibraries:
    """The library of each file that an editor has open; problems of a project are reported once.

    Attributes:
        named: the library of all files, as ``MODULE:NAME``; None for that of each file's project.
        warn: shows a message in the editor.
        settings: what the editor has set; if it does not say whether its folders are trusted, ``maze-machine trust``
            decides.
    """

    named: str | None
    warn: Callable[[str], object]
    settings: EditorSettings = field(default_factory=EditorSettings)
    _found: dict[tuple[Path | None, int], Library] = field(default_factory=dict)
    _told: set[str] = field(default_factory=set)
    _of_files: dict[str, Library] = field(default_factory=dict)
    _ignored: dict[str, tuple[str, ...]] = field(default_factory=dict)

    def __call__(self, file: str) -> Library:
        """The library of a file's machine; cached until ``refresh``."""
        if file not in self._of_files:
            self._of_files[file] = self._library(file)
        return self._of_files[file]

    def refresh(self, changed: Sequence[str] = ()) -> None:
        """Files have changed: find the library of each file again, and import it again if Python files changed.

        Args:
            changed: the files, as far as they are known.
        """
        self._of_files.clear()
        self._ignored.clear()
        if any(one.endswith(".py") for one in changed):
            folders = [file.parent for file, _ in self._found if file is not None]
            self._found.clear()
            forget_modules(folders)

    def ignored(self, file: str) -> tuple[str, ...]:
        """Prefixes of the codes of warnings and notes that are not shown for a file."""
        if file not in self._ignored:
            try:
                project = find_project(Path(file).parent)
            except CommandError:
                project = None
            self._ignored[file] = (*self.settings.ignore, *(project.ignore if project is not None else ()))
        return self._ignored[file]

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
        trusted, own = self.settings.trusted, project is not None and project.library is not None
        if self.named is None and own and trusted is False:
            assert project is not None, "only a project has a library"
            raise UsageError(f"this workspace is not trusted, so the code of {project.file} does not run")
        if self.named is None and not own and self.settings.library is not None:
            if not trusted:
                raise UsageError(
                    f"the editor's settings name Python code ({self.settings.library}), which is not trusted"
                )
            return named_library(self.settings.library, file.parent if project is None else project.folder)
        return chosen_library(self.named, file, ask=lambda _question: False, vouched=trusted is True)


def forget_modules(folders: Sequence[Path]) -> None:
    """Import the modules of some folders again on next use, except for installed packages in them."""
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if file is None or "site-packages" in file:
            continue
        if any(Path(file).resolve().is_relative_to(folder.resolve()) for folder in folders):
            del sys.modules[name]
    invalidate_caches()
