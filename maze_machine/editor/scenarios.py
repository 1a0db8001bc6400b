"""A `.maze-test` file in an editor, analysed with its machine."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path

from hsm.dsl.format.formatter import indented_lines
from hsm.dsl.loading import check_text
from hsm.dsl.lsp import hovering, navigation, vocabulary
from hsm.dsl.lsp.document import Document
from hsm.dsl.lsp.entries import Entry, OpenCall, SymbolKind, fitting
from hsm.dsl.lsp.navigation import Colour, Coloured, OutlineSymbol, Span
from hsm.dsl.lsp.occurrences import NameOccurrence, Role
from hsm.dsl.reporting.report import Report
from hsm.dsl.syntax.lexer import RESERVED
from hsm.dsl.syntax.sources import SUFFIX, read_text
from hsm.model.chart import Model, On, Raise, Send
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic, MachineError, Place
from hsm.model.registry import Library
from hsm.model.rewriting import actions_of
from hsm.model.types import Enumeration
from hsm.testing.scenarios.lines import read_lines
from hsm.testing.scenarios.reading import NAME_OF_REQUIREMENT, parse_suite
from maze_machine.editor.scenario_names import scenario_names

_OUTER = {
    "test": "test ${1:machine}",
    "tick": "tick ${1:0.1 s}",
    "requirement": "requirement ${1:R1} ${0:what is required}",
    "property": "property ${1:name} covers ${0:R1}",
    "scenario": "scenario ${1:what happens}\n    ${0}",
}
_INNER = {
    "covers": "covers ${0:R1}",
    "given": "given ${0:signal}",
    "when": "when ${0:signal}",
    "after": "after ${1:1 s}",
    "expect": "expect ${0:state}",
}
_KEYWORDS = RESERVED | {"within", "event", "reports", "fails", "doing", "called", "raised", "sent", "covers"}
_WORD = re.compile(r"[A-Za-z_][\w.]*")
_LAST_WORD = re.compile(r"[A-Za-z_][\w.]*$")


class ScenarioDocument:
    """A text of scenarios, analysed as far as possible. It is immutable: an edit makes a new one.

    Attributes:
        text: the text.
        file: its name.
        lines: the text, line by line.
    """

    def __init__(self, text: str, file: str, library: Library, opened: Mapping[str, str]) -> None:
        """Args: the text, its name, the library of its machine, and the texts of other files that are open, by name."""
        self.text = text
        self.file = file
        self.lines = tuple(text.replace("\r\n", "\n").split("\n"))
        self._library = library
        self._opened = opened

    @cached_property
    def machine(self) -> Document | None:
        """The machine that the file is about, as it is in the editor or else on the disk."""
        heading = next((line.split() for line in self.lines if line.startswith("test ")), [])
        if len(heading) < 2:
            return None
        path = Path(self.file).with_name(f"{heading[1]}{SUFFIX}")
        try:
            text = self._opened.get(str(path))
            return Document(read_text(path) if text is None else text, str(path), self._library)
        except MachineError:
            return None

    @cached_property
    def model(self) -> Model | None:
        """The machine, where it has no errors."""
        machine = self.machine
        if machine is None:
            return None
        return check_text(machine.text, self._library, machine.file, remarks=False).model

    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """Its diagnostics; if its machine cannot be used, only those that do not need it."""
        if self.model is not None:
            try:
                parse_suite(self.text, self.model, self._library, self.file)
            except MachineError as error:
                return tuple(error.diagnostics)
            return ()
        report = Report(self.file)
        lines = list(read_lines(self.text, report))
        if lines and lines[0].kind == "heading":
            place = lines[0].place
            if self.machine is None:
                message = f"there is no machine `{lines[0].parts[0]}` beside this file"
                report.found.append(finding("E0208", place, message, "a test must be beside the machine that it names"))
            else:
                message = f"machine `{lines[0].parts[0]}` has errors, so its scenarios are not checked"
                report.found.append(finding("E0208", place, message, "fix the machine first"))
        elif not report.found:
            message = "the first line must be `test`, with the machine's name"
            report.add("E0401", Place(self.file, 1, 1, 1, 2), message)
        return tuple(report.found)

    # Completion and hovering.

    def typed(self, line: int, column: int) -> str:
        """The part of a name that is before a position."""
        found = _LAST_WORD.search(self._before(line, column))
        return found.group() if found else ""

    def completions(self, line: int, column: int) -> list[Entry]:
        """Completions at a position."""
        before = self._before(line, column)
        if "#" in before:
            return []
        typed = self.typed(line, column)
        return fitting(typed, self._possible(before.removesuffix(typed)))

    def hover(self, line: int, column: int) -> Entry | None:
        """What is at a position."""
        stated = self._stated().get(self._requirement(line, column))
        if stated is not None:
            _, name, text = [*self.lines[stated].partition("#")[0].split(maxsplit=2), "", ""][:3]
            return Entry(name.removesuffix(":"), SymbolKind.VALUE, "requirement", text.strip())
        word = self._word(line, column)
        if not word or self.machine is None:
            return None
        if self.lines[line].startswith("test "):
            return hovering.machine_entry(self.machine, word)
        return hovering.named(self.machine, word)

    def open_call(self, line: int, column: int) -> OpenCall | None:
        """The call around a position, while its brackets are open."""
        return None if self.machine is None else hovering.open_call(self.machine, self._before(line, column))

    def definition(self, line: int, column: int) -> Span | None:
        """Where a name is declared: in the machine, or in Python."""
        word, machine = self._word(line, column), self.machine
        if not word or machine is None:
            return None
        stated = self._stated().get(self._requirement(line, column))
        if stated is not None:
            return Span(self.file, stated, 0, stated, len(self.lines[stated]))
        if self.lines[line].startswith("test "):
            return Span(machine.file, 0, 0, 0, 0)
        return navigation.declaration(machine, word)

    def outline(self) -> list[OutlineSymbol]:
        """The scenarios."""
        begins = [number for number, line in enumerate(self.lines) if line.startswith("scenario ")]
        found: list[OutlineSymbol] = []
        for begin, end in zip(begins, [*begins[1:], len(self.lines)], strict=False):
            last = end - 1
            while last > begin and not self.lines[last].strip():
                last -= 1
            name = self.lines[begin].partition(" ")[2].partition("#")[0].strip() or "scenario"
            place = Span(self.file, begin, len("scenario "), begin, len(self.lines[begin]))
            whole = Span(self.file, begin, 0, last, len(self.lines[last]))
            found.append(OutlineSymbol(name, "scenario", Role.PROPERTY, place, whole))
        return found

    @cached_property
    def occurrences(self) -> Sequence[NameOccurrence]:
        """The names in it."""
        return [] if self.machine is None else scenario_names(self.text, self.file, self.machine)

    def folds(self) -> Iterator[tuple[int, int, bool]]:
        """The scenarios."""
        for one in self.outline():
            if one.whole.end_line > one.whole.line:
                yield one.whole.line, one.whole.end_line, False

    def colours(self) -> Sequence[Coloured]:
        """What is coloured, in the order of the text."""
        # The words of a scenario's title are not keywords.
        titles = {number for number, line in enumerate(self.lines) if line.startswith(("scenario ", "requirement "))}
        found = navigation.colours(self.lines, self.occurrences, self._keywords())
        return [one for one in found if one.line not in titles or one.column == 0 or one.kind is Colour.COMMENT]

    def _keywords(self) -> set[tuple[int, int]]:
        """Line and column of each keyword: a line's first word, and words within lines."""
        found: set[tuple[int, int]] = set()
        for number, text in enumerate(self.lines):
            words = list(_WORD.finditer(text.partition("#")[0]))
            known = [one for one in words if one.group() in _KEYWORDS]
            found |= {(number, one.start()) for one in known}
            if words and words[0].group() in (*_OUTER, *_INNER):
                found.add((number, words[0].start()))
        return found

    def formatted(self) -> str | None:
        """The formatted text: scenarios at the margin with a blank line before each, their lines indented."""
        report = Report(self.file)
        list(read_lines(self.text, report))
        if any(one.code != "E0105" for one in report.found):
            return None
        return indented_lines(self.lines, tuple(_OUTER), "scenario")

    def _stated(self) -> dict[str, int]:
        """The requirements that the file states, each with its line."""
        stated = ((number, line.split()) for number, line in enumerate(self.lines) if line.startswith("requirement "))
        return {words[1].removesuffix(":"): number for number, words in stated if len(words) > 1}

    def _requirement(self, line: int, column: int) -> str:
        """The name of a requirement at a position; empty where there is none."""
        text = self.lines[line].partition("#")[0] if line < len(self.lines) else ""
        begin = text.find("covers ") + len("covers ") if "covers " in text else len(text)
        found = (one for one in NAME_OF_REQUIREMENT.finditer(text, begin) if one.start() <= column <= one.end())
        return next((one.group() for one in found), "")

    def _before(self, line: int, column: int) -> str:
        return self.lines[line][:column] if line < len(self.lines) else ""

    def _word(self, line: int, column: int) -> str:
        text = self.lines[line].partition("#")[0] if line < len(self.lines) else ""
        found = (one for one in _WORD.finditer(text) if one.start() <= column <= one.end())
        return next((one.group() for one in found), "")

    def _possible(self, before: str) -> Iterator[Entry]:
        words = before.split()
        if not words:
            table = _INNER if before.startswith(" ") else _OUTER
            yield from (Entry(word, SymbolKind.KEYWORD, snippet=snippet) for word, snippet in table.items())
            return
        part = before.rpartition(",")[2] if "," in before else before.partition(words[0])[2]
        first, given = words[0], part.split()
        if re.search(r"\d\s*$", before):
            yield from vocabulary.units()
        elif first == "test" and len(words) == 1:
            paths = sorted(Path(self.file).parent.glob(f"*{SUFFIX}"))
            yield from (Entry(path.name.removesuffix(SUFFIX), SymbolKind.MACHINE) for path in paths)
        elif first == "covers" or (words[:1] == ["property"] and "covers" in words):
            yield from (Entry(one, SymbolKind.VALUE, "requirement") for one in self._stated())
        elif first == "property" and self.model is not None:
            listed = [] if len(words) > 1 else [one.name for one in self.model.properties]
            yield from (Entry(one, SymbolKind.VALUE, "property") for one in listed)
            if len(words) > 1:
                yield Entry("covers", SymbolKind.KEYWORD)
        elif first in ("given", "when", "after", "expect") and self.machine is not None:
            yield from self._parts(first, given)

    def _parts(self, first: str, given: list[str]) -> Iterator[Entry]:
        """Completions inside one comma-separated part of a line."""
        negated = given[:1] == ["not"]
        rest = given[1:] if negated else given
        last = rest[-1] if rest else ""
        if last in ("=", "==", "!="):
            yield from self._values_of(rest[0])
        elif rest and rest[-1] == "reports":
            activities = self._library.activities
            named = [activities[one] for one in self._doing(rest[0]) if one in activities]
            yield from (Entry(one, SymbolKind.EVENT, "outcome") for kind in named for one in kind.outcomes)
        elif last == "event":
            yield from (Entry(one, SymbolKind.EVENT, "event") for one in sorted(self._heard()))
        elif last in ("doing", "called", "raised", "sent"):
            yield from self._performed(last)
        elif first in ("when", "after") and len(rest) == 1:
            yield from (Entry(one, SymbolKind.KEYWORD) for one in ("reports", "fails"))
        elif not rest:
            yield from self._beginnings(first, negated=negated)

    def _beginnings(self, first: str, *, negated: bool) -> Iterator[Entry]:
        """The words that begin a part of a line."""
        assert self.machine is not None, "without a machine there are no completions"
        everything = list(vocabulary.everything(self.machine))
        kinds = {SymbolKind.SIGNAL}
        if first in ("given", "expect"):
            kinds |= {SymbolKind.PARAMETER}
        if first == "expect":
            kinds |= {SymbolKind.STATE, SymbolKind.VARIABLE}
            yield from (Entry(one, SymbolKind.KEYWORD) for one in ("doing", "called", "raised", "sent"))
        elif first in ("when", "after") and not negated:
            yield Entry("event", SymbolKind.KEYWORD)
            done = {one.activity.activity.name for one in self.model.states if one.activity} if self.model else set()
            yield from (one for one in everything if one.kind is SymbolKind.ACTIVITY and one.label in done)
        if not negated:
            yield Entry("not", SymbolKind.KEYWORD)
        yield from (one for one in everything if one.kind in kinds)

    def _performed(self, word: str) -> Iterator[Entry]:
        assert self.machine is not None, "without a machine there are no completions"
        if word in ("raised", "sent"):
            done = actions_of(self.model) if self.model is not None else ()
            kinds = Raise if word == "raised" else Send
            raised = {one.event for one in done if isinstance(one, kinds)}
            yield from (Entry(one, SymbolKind.EVENT, "event") for one in sorted(raised))
            return
        kind = SymbolKind.ACTIVITY if word == "doing" else SymbolKind.ACTION
        yield from (one for one in vocabulary.everything(self.machine) if one.kind is kind)

    def _values_of(self, name: str) -> Iterator[Entry]:
        """The values that a signal, a parameter or a variable of an enumeration can have."""
        signal = self._library.signals.get(name)
        declared = [signal.type] if signal is not None else []
        if self.model is not None:
            declared += [one.type for one in self.model.parameters if one.name == name]
            declared += [one.type for one in self.model.variables if one.name == name]
        for kind in declared[:1]:
            if isinstance(kind, Enumeration):
                yield from (Entry(one, SymbolKind.VALUE, str(kind)) for one in kind.members)
            elif str(kind) == "bool":
                yield from (Entry(one, SymbolKind.VALUE, "bool") for one in ("true", "false"))

    def _doing(self, name: str) -> Iterator[str]:
        """The activities that a name may represent: its own, or those of a state."""
        yield name
        for state in self.model.states if self.model is not None else ():
            if state.activity is not None and name in (state.name, state.name.rpartition(".")[2]):
                yield state.activity.activity.name

    def _heard(self) -> set[str]:
        heard = set(self._library.events)
        for one in self.model.transitions if self.model is not None else ():
            if isinstance(one.trigger, On):
                heard.update(name for name in one.trigger.names if name != "*")
        return heard
