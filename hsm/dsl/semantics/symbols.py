"""The symbol table of a file: the tree of states, the declarations at the top; no name is resolved yet."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field

from hsm.dsl.reporting.report import Report
from hsm.dsl.semantics.names import Names
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.ast import place_of
from hsm.dsl.syntax.tokens import Token
from hsm.model.chart import Model, StateKind
from hsm.model.diagnostics import Related
from hsm.model.values import dataclass

HISTORY = {"history": StateKind.SHALLOW_HISTORY, "deep_history": StateKind.DEEP_HISTORY}
"""How the history of a state is named after the state's own name."""


@dataclass(slots=True, eq=False)
class StateSymbol:
    """A state while its machine is being built.

    Attributes:
        name: its name in this file.
        kind: what it is, as far as its lines say.
        parent: the state around it.
        token: where its name is written.
        children: the states directly inside it, histories excepted.
        histories: the history states that some transition asks for.
        lines: its transitions, entry and exit lines; at the top also declarations.
        stays: its ``stay`` lines.
        initial: its ``initial`` line.
        activity: its ``do`` line.
        instance: the machine that it is an instance of, with arguments.
        member: the instance has a robot and events of its own.
        model: that machine, once found.
        erroneous: its declaration is invalid: diagnostics about it are suppressed, except for the names it uses.
        completions: ``done`` if it can complete; only its own transitions can handle that.
        reported: outcomes of activities in it or inside it, and the names of the final states inside it.
        awaited: the events that its transitions wait for.
        index: its position in document order.
        last: the position of its last descendant.
    """

    name: str
    kind: StateKind
    parent: StateSymbol | None
    token: Token | None = None
    children: list[StateSymbol] = field(default_factory=list)
    histories: dict[StateKind, StateSymbol] = field(default_factory=dict)
    lines: list[ast.Item] = field(default_factory=list)
    stays: list[ast.StayLine] = field(default_factory=list)
    initial: ast.InitialLine | None = None
    activity: ast.DoLine | None = None
    instance: ast.CallSyntax | None = None
    member: bool = False
    model: Model | None = None
    erroneous: bool = False
    completions: set[str] = field(default_factory=set)
    reported: Names = field(default_factory=Names)
    awaited: Names = field(default_factory=Names)
    index: int = -1
    last: int = -1

    def inner(self) -> list[StateSymbol]:
        """The states directly inside it, histories last."""
        return [*self.children, *self.histories.values()]

    def ancestors(self) -> Iterator[StateSymbol]:
        """The state and all that it lies in, innermost first."""
        found: StateSymbol | None = self
        while found is not None:
            yield found
            found = found.parent


@dataclass(slots=True)
class SymbolTable:
    """What a file declares.

    Attributes:
        root: represents the machine.
        states: all states by name.
        heading: the line ``machine NAME``.
        imports: imported machines, by the name that the file knows them under.
        declared: where each state, variable and parameter is declared first.
        doubtful: names that unreadable lines may declare, and names whose declaration is invalid.
        possible: the states that unreadable lines may declare, or that may be missing before them.
        heard: the events that unreadable lines may handle.
        events: the events that may be sent to the machine or raised in it.
        entered: the states that transitions name.
    """

    root: StateSymbol
    states: dict[str, StateSymbol] = field(default_factory=dict)
    heading: ast.MachineLine | None = None
    imports: dict[str, Token] = field(default_factory=dict)
    declared: dict[str, Token] = field(default_factory=dict)
    doubtful: Names = field(default_factory=Names)
    events: Names = field(default_factory=Names)
    entered: Names = field(default_factory=Names)
    possible: Names = field(default_factory=Names)
    heard: Names = field(default_factory=Names)

    def all_states(self) -> list[StateSymbol]:
        """All symbols in document order, the root first, including those without a valid name."""
        found: list[StateSymbol] = []
        stack = [self.root]
        while stack:
            symbol = stack.pop()
            found.append(symbol)
            stack.extend(reversed(symbol.children))
        return found

    def may_be_a_state(self, name: str) -> bool:
        """Whether a name may be that of a state, or of one inside it, whose declaration was not understood."""
        return self.doubtful.has_part_of(name) or self.possible.has_part_of(name)

    def members(self) -> list[str]:
        """The names of the members."""
        return [one.name for one in self.all_states() if one.member]


def collect_symbols(tree: ast.File, report: Report) -> SymbolTable:
    """Walk a file once; report everything that is in the wrong place or declared twice."""
    walker = _Walker(tree, report, SymbolTable(StateSymbol("", StateKind.COMPOUND, None)))
    if any(one.code == "E0105" for one in report.found):
        walker.doubt_lines()
        walker.result.possible.add_unknown()
        walker.result.events.add_unknown()
    walker.walk()
    walker.check_whole()
    return walker.result


@dataclass(slots=True)
class _Walker:
    tree: ast.File
    report: Report
    result: SymbolTable

    def walk(self) -> None:
        """Visit all lines, with an explicit stack for blocks: a deep file needs no deep recursion."""
        stack: list[tuple[StateSymbol, Iterator[ast.Item]]] = [(self.result.root, iter(self.tree.items))]
        while stack:
            symbol, items = stack[-1]
            for item in items:
                block = self._take(symbol, item)
                if block is not None:
                    stack.append(block)
                    break
            else:
                stack.pop()

    def check_whole(self) -> None:
        """Checks that need the whole file."""
        result = self.result
        for symbol in result.states.values():
            few = symbol.kind is StateKind.PARALLEL and len(symbol.children) < 2
            if few and not symbol.erroneous and not result.possible:
                result.entered.add_unknown()
                message = f"parallel state `{symbol.name}` has fewer than two regions"
                self._add("E0408", symbol.token, message, "write `state` instead of `parallel`, or add a second region")
        if result.heading is None:
            if not result.possible:
                message = "the first line must be `machine` with a name"
                self._add("E0401", _start_of(self.tree), message, "begin the file with `machine NAME`")
            return
        name = result.heading.name
        result.root.name, result.root.token = str(name), name
        if "." in name:
            self._add("E0211", name, "the name of a machine cannot contain a dot")
        if name in result.states:
            related = Related(place_of(self.tree.name, name), "the machine gets its name here")
            self.report.add(
                "E0209",
                place_of(self.tree.name, result.states[str(name)].token or name),
                f"`{name}` names the machine itself",
                related=(related,),
            )
        if not result.root.children and not result.possible:
            self._add("E0409", name, f"machine `{name}` has no state", "add a state: `state waiting`")

    def _take(self, symbol: StateSymbol, item: ast.Item) -> tuple[StateSymbol, Iterator[ast.Item]] | None:
        """Note one line; a block is returned to be walked next."""
        match item:
            case ast.StateBlock():
                return self._new_state(symbol, item), iter(item.items)
            case ast.BadLine():
                return self._unread(symbol, item), iter(item.items)
            case ast.TransitionLine() | ast.EntryLine() | ast.ExitLine():
                symbol.lines.append(item)
            case ast.StayLine():
                symbol.stays.append(item)
            case ast.FinalLine() | ast.InitialLine() | ast.DoLine():
                self._take_part(symbol, item)
            case ast.MachineLine():
                self._take_heading(item)
            case _:
                self._take_declaration(symbol, item)
        return None

    def _unread(self, symbol: StateSymbol, line: ast.BadLine) -> StateSymbol:
        """What a line that could not be read may be in a state; the answer has the lines below it."""
        result, anything = self.result, Names(unknown=True)
        declares = anything if line.declares is None else line.declares
        result.doubtful.update(declares)
        result.possible.update(declares)
        symbol.reported.add_unknown()
        symbol.awaited.add_unknown()
        self.doubt_lines()
        if symbol is result.root or "raise" in line.names:
            result.events.add_unknown()
        if line.items and not line.names:
            self._leave_open(symbol)
        unread = StateSymbol("", StateKind.ATOMIC, symbol, erroneous=True, reported=anything, awaited=anything)
        if line.items:
            self._add_child(unread)
        return unread

    def doubt_lines(self) -> None:
        """A line that was not understood may handle any event and lead anywhere."""
        self.result.heard.add_unknown()
        self.result.entered.add_unknown()

    def _leave_open(self, symbol: StateSymbol) -> None:
        """Lines in no block may belong to the state before them, or to a missing one."""
        self.result.possible.add_unknown()
        symbol.erroneous = True
        if symbol.children:
            symbol.children[-1].reported.add_unknown()

    def _new_state(self, parent: StateSymbol, block: ast.StateBlock) -> StateSymbol:
        if parent.instance is not None:
            self._not_here(
                parent, block.name, "an instance of a machine cannot have states here: its states are in its file"
            )
        if block.member and parent.kind is not StateKind.PARALLEL and not parent.erroneous:
            message = "a member runs beside others: it lies directly in a parallel state"
            self._add("E0402", block.name, message, "put it into a `parallel` block")
        symbol = StateSymbol(
            str(block.name), block.kind, parent, block.name, instance=block.instance, member=block.member
        )
        self._insert(symbol, block.name)
        return symbol

    def _insert(self, symbol: StateSymbol, name: Token) -> None:
        if "." in name:
            message = f"`{name}` cannot name a state: a declared name cannot contain a dot"
            self._add("E0211", name, message, f"write `{name.replace('.', '_')}`")
            self.result.doubtful.add(symbol.name)
            symbol.erroneous = True
        elif self.is_new(name):
            self.result.states[symbol.name] = symbol
        else:
            self.result.entered.add_unknown()
            symbol.erroneous = True
            if symbol.name in self.result.states:
                self.result.states[symbol.name].erroneous = True
        self._add_child(symbol)

    def _add_child(self, symbol: StateSymbol) -> None:
        parent = symbol.parent
        assert parent is not None
        if parent.kind is StateKind.ATOMIC:
            parent.kind = StateKind.COMPOUND
        parent.children.append(symbol)

    def _take_part(self, symbol: StateSymbol, item: ast.FinalLine | ast.InitialLine | ast.DoLine) -> None:
        match item:
            case ast.FinalLine(name):
                if symbol.kind is StateKind.PARALLEL or symbol.instance is not None:
                    self._add("E0402", name, "a final state cannot be a region of a parallel state")
                self._insert(StateSymbol(str(name), StateKind.FINAL, symbol, name), name)
            case ast.InitialLine(target):
                if symbol.kind is StateKind.PARALLEL:
                    self._add("E0402", target, "a parallel state enters all its regions: it cannot have `initial`")
                    symbol.erroneous = True
                elif symbol.instance is not None:
                    self._not_here(symbol, target, "the file of the machine names the initial state of its instances")
                elif symbol.initial is not None:
                    self._second("initial", target, symbol.initial.target)
                    symbol.erroneous = True
                    symbol.reported.add_unknown()
                else:
                    symbol.initial = item
            case ast.DoLine(call):
                if symbol.instance is not None:
                    self._not_here(
                        symbol,
                        call.name,
                        "an instance of a machine cannot have `do`: its activities are in the machine's file",
                    )
                elif symbol.activity is not None:
                    self._second("do", call.name, symbol.activity.call.name)
                    symbol.erroneous = True
                    symbol.reported.add_unknown()
                else:
                    symbol.activity = item

    def _take_heading(self, item: ast.MachineLine) -> None:
        if self.result.heading is not None:
            self._second("machine", item.name, self.result.heading.name)
            return
        if item is not _first_item(self.tree):
            self._add("E0401", item.name, "the line `machine` must be the first of its file")
        self.result.heading = item

    def _take_declaration(self, symbol: StateSymbol, item: ast.Item) -> None:
        match item:
            case (
                ast.ImportLine(name)
                | ast.ParameterLine(name)
                | ast.VariableLine(name)
                | ast.EnumerationLine(name)
                | ast.DefinitionLine(name)
            ):
                first = name
            case ast.ExposeLine(names):
                first = names[0]
            case ast.EventLine(events):
                first = events[0].name
            case ast.PropertyLine(name):
                first = name
            case _:
                raise AssertionError(item)
        if symbol is not self.result.root and not symbol.erroneous:
            message = "this must be declared at the top of the file, not in a state"
            self._add("E0402", first, message, "move it above the first state")
        if isinstance(item, ast.ImportLine):
            known = first.rpartition(".")[2]
            if known in self.result.imports:
                self._second(f"import {known}", first, self.result.imports[known])
            self.result.imports.setdefault(known, first)
            return
        self.result.root.lines.append(item)
        if not isinstance(item, ast.EventLine | ast.ExposeLine):
            self.is_new(first)

    def is_new(self, name: Token) -> bool:
        """Whether a name is declared for the first time; if not, report it."""
        first = self.result.declared.setdefault(str(name), name)
        if first is name:
            return True
        related = Related(place_of(self.tree.name, first), "first declared here")
        message, hint = f"`{name}` is declared twice", "give one of them another name"
        self.report.add("E0209", place_of(self.tree.name, name), message, hint, (related,))
        return False

    def _not_here(self, instance: StateSymbol, token: Token, message: str) -> None:
        """Report lines that an instance cannot have, once: they probably belong to another state."""
        place = place_of(self.tree.name, token)
        self.report.add_once("E0402", place, message, subject=id(instance), again="this does not belong here either")
        instance.erroneous = True
        instance.reported.add_unknown()

    def _add(self, code: str, token: Token | None, message: str, hint: str | None = None) -> None:
        self.report.add(code, place_of(self.tree.name, token) if token is not None else None, message, hint)

    def _second(self, what: str, token: Token, first: Token) -> None:
        related = Related(place_of(self.tree.name, first), "the first is here")
        hint = "a state has one activity: move the other one into another state" if what == "do" else "keep one of them"
        self.report.add("E0403", place_of(self.tree.name, token), f"a second `{what}`", hint, (related,))


def _first_item(tree: ast.File) -> ast.Item:
    """The first line of a file, even if indented."""
    first = tree.items[0]
    return first.items[0] if isinstance(first, ast.BadLine) and first.items else first


def _start_of(tree: ast.File) -> Token:
    """The first word of a file."""
    for number, line in enumerate(tree.lines, 1):
        words = line.partition("#")[0].split()
        if words:
            column = line.index(words[0]) + 1
            return Token("NAME", words[0], (number, column, number, column + len(words[0])))
    return Token("NAME", "", (1, 1, 1, 2))
