"""Load a file and all that it imports: the result is a machine, or all diagnostics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from pathlib import Path

from hsm.dsl import checks
from hsm.dsl.reporting.report import Report
from hsm.dsl.semantics.acceptance import accepted
from hsm.dsl.semantics.compile import CompilationUnit, compile_file
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.ast import place_of
from hsm.dsl.syntax.layout import without_doubtful
from hsm.dsl.syntax.parser import parse
from hsm.dsl.syntax.sources import SUFFIX, read_text
from hsm.dsl.syntax.tokens import Token
from hsm.model.chart import Model
from hsm.model.diagnostics import Diagnostic, MachineError, Place
from hsm.model.registry import Library
from hsm.model.values import dataclass

ASSUMED = "--assume"
"""The file that places in further assumptions name; the line is the number of the assumption."""

_DEEPEST = 100  # files, each imported by the previous one


@dataclass(frozen=True, slots=True)
class Checked:
    """The result of checking a file.

    Attributes:
        model: the machine; None where there are errors.
        diagnostics: all diagnostics, in the order of the files and of their lines.
        sources: the text of every file that was read, by name.
    """

    model: Model | None
    diagnostics: tuple[Diagnostic, ...]
    sources: dict[str, str] = field(default_factory=dict)


def load_model(path: str | Path, library: Library, assumed: Sequence[str] = ()) -> Model:
    """The machine in a file.

    Args:
        path: where it is.
        library: the registry.
        assumed: further assumptions, as ``NAME : CLAIM``.

    Raises:
        MachineError: it, or a machine that it imports, cannot be built; with all diagnostics. Those about a further
            assumption have ``ASSUMED`` as their file.
    """
    if not assumed:
        return _model(check_file(path, library, remarks=False))
    text = read_text(path).rstrip("\n")
    further = "".join(f"\n{_ASSUME}{one}" for one in assumed)
    checked = check_text(f"{text}{further}\n", library, str(path), remarks=False)
    lines = text.count("\n") + 1
    return _model(replace(checked, diagnostics=tuple(_elsewhere(one, lines) for one in checked.diagnostics)))


def parse_model(text: str, library: Library, file: str = "<text>") -> Model:
    """The machine in a text; imports are searched for beside ``file``.

    Raises:
        MachineError: it, or a machine that it imports, cannot be built; with all diagnostics.
    """
    return _model(check_text(text, library, file, remarks=False))


def check_file(path: str | Path, library: Library, *, remarks: bool = True) -> Checked:
    """Read and check a file and all that it imports.

    Args:
        path: where it is.
        library: the registry.
        remarks: whether to report warnings and notes for a machine without errors; with errors they are always
            reported.
    """
    try:
        text = read_text(path)
    except MachineError as error:
        return Checked(None, error.diagnostics)
    return check_text(text, library, str(path), remarks=remarks)


def check_text(text: str, library: Library, file: str = "<text>", *, remarks: bool = True) -> Checked:
    """Check a text as ``check_file`` does; imports are searched for beside ``file``."""
    return _Loader(library).check(text, file, remarks=remarks)


def check_tree(
    tree: ast.File, found: Sequence[Diagnostic], text: str, library: Library, imported: ImportedMachines
) -> Checked:
    """Check a text that has been read already, as an editor does after each keystroke.

    Args:
        tree: the syntax tree of the text, as ``parse`` gives it.
        found: what ``parse`` has found.
        text: the text.
        library: the registry.
        imported: keeps what the text imports from one check to the next.
    """
    return _Loader(library, imported).check(text, tree.name, remarks=True, read=(tree, found))


@dataclass(slots=True)
class ImportedMachines:
    """Compiled imports of one library, kept until their files, or the files that these import, change."""

    _units: dict[Path, tuple[CompilationUnit, str, frozenset[Path]]] = field(default_factory=dict)
    _stamps: dict[Path, tuple[int, int] | None] = field(default_factory=dict)

    def get(self, path: Path) -> dict[Path, tuple[CompilationUnit, str]] | None:
        """A machine's file, compiled, with all that it imports, each with its text; None where it is to be read."""
        found: dict[Path, tuple[CompilationUnit, str]] = {}
        pending = [path]
        while pending:
            one = pending.pop()
            if one in found:
                continue
            if one not in self._units or _stamp(one) != self._stamps.get(one):
                return None
            unit, text, needed = self._units[one]
            found[one] = (unit, text)
            pending.extend(needed)
        return found

    def stamp(self, path: Path) -> None:
        """A file is about to be read."""
        self._stamps[path] = _stamp(path)

    def put(self, path: Path, unit: CompilationUnit, text: str, needed: frozenset[Path]) -> None:
        """A file was compiled."""
        self._units[path] = (unit, text, needed)

    def clear(self) -> None:
        """Files may lie elsewhere now."""
        self._units.clear()


def _stamp(path: Path) -> tuple[int, int] | None:
    """What changes when a file is written; None where there is none."""
    try:
        known = path.stat()
    except OSError:
        return None
    return known.st_mtime_ns, known.st_size


def find_import(name: str, beside: Path, library: Library) -> Path:
    """The path of an imported machine: beside the file, or in a folder of the library if it exists only there."""
    relative = Path(*name.split(".")).with_suffix(SUFFIX)
    paths = [folder / relative for folder in (beside, *library.folders)]
    return next((path for path in paths if path.is_file()), paths[0])


def importable(file: Path, library: Library) -> list[str]:
    """The machines that a file can import by name: those beside it, and those in the folders of the library."""
    paths = (path for folder in (file.parent, *library.folders) for path in sorted(folder.glob(f"*{SUFFIX}")))
    return [path.stem for path in paths if path.stem != file.stem]


_ASSUME = "assume "


def _elsewhere(found: Diagnostic, lines: int) -> Diagnostic:
    """The same diagnostic; a place after the last line of the file is one in a further assumption."""
    place = found.place
    if place is None or place.line <= lines:
        return found
    line, left = place.line - lines, len(_ASSUME)
    columns = (max(1, place.column - left), line, max(1, place.end_column - left))
    return replace(found, place=Place(ASSUMED, line, *columns))


def _model(checked: Checked) -> Model:
    if checked.model is None:
        raise MachineError(checked.diagnostics)
    return checked.model


def _position(found: Diagnostic) -> tuple[int, int, str]:
    return (found.place.line, found.place.column, found.code) if found.place is not None else (0, 0, found.code)


@dataclass(slots=True)
class _Loader:
    """Compiles each file once; knows which files are being compiled, so that an import cycle is seen."""

    library: Library
    imported: ImportedMachines = field(default_factory=ImportedMachines)
    units: dict[Path, CompilationUnit] = field(default_factory=dict)
    open_files: list[Path] = field(default_factory=list)
    sources: dict[str, str] = field(default_factory=dict)
    needed: dict[Path, set[Path]] = field(default_factory=dict)
    cyclic: bool = False

    def check(
        self, text: str, file: str, *, remarks: bool, read: tuple[ast.File, Sequence[Diagnostic]] | None = None
    ) -> Checked:
        """Compile a text and its imports; collect all diagnostics, file by file and line by line.

        Args:
            text: the text.
            file: its name.
            remarks: whether warnings and notes are wanted for a machine without errors.
            read: the syntax tree and its diagnostics, if the text was parsed already.
        """
        main = self._compile(text, file, read or parse(text, file))
        units = [main, *(unit for unit in self.units.values() if unit is not main)]
        failed = any(unit.model is None for unit in units)
        findings: list[Diagnostic] = []
        for unit in units:
            found: Sequence[Diagnostic] = unit.diagnostics
            if remarks or failed:
                certain = without_doubtful((*found, *checks.remarks(unit.subject)), unit.tree.lines)
                found = accepted(certain, unit.tree)
            findings.extend(sorted(found, key=_position))
        return Checked(None if failed else main.model, tuple(findings), self.sources)

    def _compile(self, text: str, file: str, read: tuple[ast.File, Sequence[Diagnostic]]) -> CompilationUnit:
        path = Path(file).resolve()
        self.sources[file] = text
        self.open_files.append(path)
        tree, findings = read[0], list(read[1])
        machines: dict[str, CompilationUnit | None] = {}
        report = Report(file, findings)
        for name in ast.imports_of(tree):
            machines[name.rpartition(".")[2]] = self._import(name, report)
        self.open_files.pop()
        unit = compile_file(tree, findings, self.library, machines)
        errors = tuple(checks.errors(unit.subject))
        if errors:
            unit = replace(unit, model=None, diagnostics=(*unit.diagnostics, *errors))
        self.units[path] = unit
        return unit

    def _import(self, name: Token, report: Report) -> CompilationUnit | None:
        path = find_import(name, Path(report.file).parent, self.library)
        key = path.resolve()
        place = place_of(report.file, name)
        self.needed.setdefault(self.open_files[-1], set()).add(key)
        if key in self.open_files:
            ring = [one.stem for one in self.open_files[self.open_files.index(key) :]]
            message = f"import cycle: {' -> '.join([*ring, ring[0]])}"
            report.add("E0410", place, message, "move the shared part into a third machine")
            self.cyclic = True
            return None
        if key in self.units:
            return self.units[key]
        if len(self.open_files) > _DEEPEST:
            message = f"imports are nested more than {_DEEPEST} levels deep here"
            report.add("E0208", place, message, "import fewer machines from imported machines")
            return None
        known = self.imported.get(key)
        if known is not None:
            self.units.update((one, unit) for one, (unit, _) in known.items())
            self.sources.update((unit.tree.name, text) for unit, text in known.values())
            return self.units[key]
        self.imported.stamp(key)
        try:
            text = read_text(path)
        except MachineError as error:
            meant = report.guess(name, importable(Path(report.file), self.library)).text
            message = f"there is no machine `{name}` to import: {error.diagnostics[0].message}"
            report.add("E0208", place, message, meant or f"put `{name}{SUFFIX}` beside this file")
            return None
        unit = self._compile(text, str(path), parse(text, str(path)))
        if not self.cyclic:  # the message about a cycle depends on where it was entered
            self.imported.put(key, unit, text, frozenset(self.needed.get(key, ())))
        return unit
