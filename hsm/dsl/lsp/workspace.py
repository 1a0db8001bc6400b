"""The documents that an editor has open, each analysed and checked once per version."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from itertools import islice
from pathlib import Path
from typing import Protocol

from hsm.dsl.loading import ImportedMachines, check_tree
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.edited import EditedFile
from hsm.dsl.syntax.parser import BlockParser
from hsm.dsl.syntax.sources import SUFFIX, files_in, read_text
from hsm.model.diagnostics import Diagnostic, MachineError
from hsm.model.registry import Library
from hsm.model.values import dataclass

LibraryOf = Callable[[str], Library]
"""Gives the library that a file's machine is written against."""
MOST_FILES, MOST_FOLDERS = 500, 2000
"""How much of a folder is searched: an editor may have opened a file in the root of a disk."""


class OtherFile(EditedFile, Protocol):
    """A file of another language about machines, such as that of scenarios."""

    def diagnostics(self) -> Sequence[Diagnostic]:
        """Its diagnostics."""
        ...


class OtherLanguage(Protocol):
    """Another language about machines."""

    @property
    def suffix(self) -> str:
        """What the names of its files end with."""
        ...

    def file(self, name: str, text: str, opened: Mapping[str, str]) -> OtherFile:
        """A file as it is in the editor.

        Args:
            name: of the file.
            text: of it.
            opened: the texts of all files that are open, by name.
        """
        ...


@dataclass(slots=True)
class Documents:
    """Open files and those beside them.

    Attributes:
        library_of: gives the library of a file.
    """

    library_of: LibraryOf
    _open: dict[str, Document] = field(default_factory=dict)
    _found: dict[str, tuple[Document, tuple[Diagnostic, ...]]] = field(default_factory=dict)
    _parsers: dict[str, BlockParser] = field(default_factory=dict)
    _imported: dict[int, tuple[Library, ImportedMachines]] = field(default_factory=dict)

    def update(self, file: str, text: str) -> None:
        """Use the text of a file as it is in the editor."""
        known = self._open.get(file)
        library = self.library_of(file)
        if known is None or known.text != text or known.library is not library:
            parser = self._parsers.setdefault(file, BlockParser())
            self._open[file] = Document(text, file, library, parser)

    def close(self, file: str) -> None:
        """Forget a file."""
        self._open.pop(file, None)
        self._parsers.pop(file, None)
        self._found.pop(file, None)

    def refresh(self) -> None:
        """Check everything again: something that files depend on has changed on the disk."""
        self._found.clear()
        self._imported.clear()
        for file, document in list(self._open.items()):
            self.update(file, document.text)

    def __getitem__(self, file: str) -> Document:
        return self._open[file]

    def __contains__(self, file: object) -> bool:
        return file in self._open

    def __iter__(self) -> Iterator[str]:
        return iter(list(self._open))

    def diagnostics(self, file: str) -> tuple[Diagnostic, ...]:
        """The diagnostics of a file as it is in the editor."""
        document = self._open[file]
        known = self._found.get(file)
        if known is None or known[0] is not document:
            imported = self._imported.setdefault(id(document.library), (document.library, ImportedMachines()))[1]
            checked = check_tree(document.tree, document.unread, document.text, document.library, imported).diagnostics
            own = tuple(one for one in checked if one.place is not None and one.place.file == file)
            known = self._found[file] = (document, own)
        return known[1]

    def around(self, folder: Path) -> Iterator[Document]:
        """The machines of a folder and the folders in it: as they are in the editor, else on the disk."""
        seen: set[str] = set()
        for file in self:
            seen.add(str(Path(file).resolve()))
            yield self._open[file]
        for path in islice(files_in(folder, SUFFIX, MOST_FOLDERS), MOST_FILES):
            if str(path.resolve()) in seen:
                continue
            try:
                yield Document(read_text(path), str(path), self.library_of(str(path)))
            except MachineError:
                continue
