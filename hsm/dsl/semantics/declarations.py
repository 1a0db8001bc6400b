"""The declarations at the top of a file, and the events that its states may receive."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field, replace
from enum import StrEnum
from typing import cast

from hsm.dsl.semantics import bounds
from hsm.dsl.semantics.analysis import Unused
from hsm.dsl.semantics.context import Context
from hsm.dsl.semantics.names import Names
from hsm.dsl.semantics.symbols import StateSymbol
from hsm.dsl.semantics.typing import FUNCTIONS
from hsm.dsl.semantics.values import Declared, Definition
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.tokens import Token
from hsm.engine.inputs import follow
from hsm.model.chart import Adjustable, EventData, StateKind, Variable
from hsm.model.diagnostics import Place, Related
from hsm.model.expressions import Expression, Literal, VariableValue
from hsm.model.registry import EventField, Parameter
from hsm.model.rewriting import parts_of
from hsm.model.types import Enumeration, Type
from hsm.model.values import dataclass

_MOST_REPORTERS = 3
_MOST_HEARD = 8


@dataclass(slots=True)
class Declarations:
    """Parameters, variables and events of a file.

    Attributes:
        context: what all stages share.
        parameters: the machine's parameters.
        derived: the expressions of parameters that depend on others, by name.
        variables: its variables; those of instances are put after them.
        events: events that are declared (with their places) or raised.
        heard: events that some transition handles, or may handle.
        data: what events carry, by name: those of the registry, of the file and of what it imports.
        raised: events that this file raises, and where first.
        delayed: those that it raises later.
        declared: those that it declares.
        sent: those that it sends to other machines.
        exposed: the variables that a machine which imports this one may read.
        adjustable: the bounds of the parameters that an operator may change, by name.
    """

    context: Context
    parameters: list[Parameter] = field(default_factory=list)
    derived: dict[str, Expression] = field(default_factory=dict)
    variables: list[Variable] = field(default_factory=list)
    events: dict[str, Place | None] = field(default_factory=dict)
    heard: Names = field(default_factory=Names)
    data: dict[str, EventData] = field(default_factory=dict)
    raised: dict[str, Token] = field(default_factory=dict)
    delayed: set[str] = field(default_factory=set)
    declared: set[str] = field(default_factory=set)
    sent: Names = field(default_factory=Names)
    exposed: dict[str, None] = field(default_factory=dict)
    adjustable: dict[str, Adjustable] = field(default_factory=dict)
    _unsent: dict[str, int] = field(default_factory=dict)
    _made_of: Mapping[str, frozenset[str]] = field(default_factory=dict)

    def declare(self, imported: Iterable[EventData] = ()) -> None:
        """Analyse the lines at the top of the file.

        Args:
            imported: what the events of imported machines carry.
        """
        lines = self.context.symbols.root.lines
        self._made_of = _made_of(lines)
        for event in self.context.library.events.values():
            if event.fields:
                self.data[event.name] = EventData(event.name, event.fields)
        for data in imported:
            self.data.setdefault(data.event, data)
        for line in lines:
            if isinstance(line, ast.EnumerationLine):
                self._declare_enumeration(line)
        for line in lines:
            match line:
                case ast.ParameterLine(name, type_name, default, adjustable):
                    self._declare(name, type_name, default, constant=True)
                    if adjustable is not None:
                        declared = next((one for one in self.parameters if one.name == name), None)
                        self.adjustable[str(name)] = bounds.adjustable(self.context, name, declared, adjustable)
                case ast.VariableLine(name, type_name, initial):
                    self._declare(name, type_name, initial, constant=False)
                case ast.EventLine(events):
                    self._declare_events(events)
        for data in self.data.values():
            self.context.scope.carried.update((data.variable(one), (data.event, one.type)) for one in data.fields)

    def define(self) -> None:
        """Register the definitions; their names are resolved on first use."""
        for line in self.context.symbols.root.lines:
            if isinstance(line, ast.DefinitionLine):
                name = line.name
                new = self.context.symbols.declared.get(str(name)) is name
                if self._taken(name, "an expression") or not new:
                    self.context.symbols.doubtful.add(str(name))
                else:
                    self.context.scope.definitions[str(name)] = Definition(line.value, self.context.place(name))

    def _taken(self, name: Token, what: str) -> bool:
        """Whether a name has another meaning already; if so, report it."""
        taken = name in self.context.library.signals or name in FUNCTIONS or name in ("true", "false") or "." in name
        if taken:
            self.context.add("E0211", name, f"`{name}` cannot name {what}: the name already has another meaning")
        return taken

    def _declare_enumeration(self, line: ast.EnumerationLine) -> None:
        """An enumeration of the file's own: a type for its variables and parameters."""
        name, scope = line.name, self.context.scope
        if self.context.symbols.declared.get(str(name)) is not name:
            return
        if name in scope.enumerations or "." in name:
            self.context.add(
                "E0211", name, f"`{name}` cannot name an enumeration: the name already has another meaning"
            )
            return
        members: dict[str, Token] = {}
        for member in line.members:
            if str(member) in members:
                related = Related(self.context.place(members[str(member)]), "first here")
                message = f"`{member}` is listed twice in `{name}`"
                self.context.report.add("E0209", self.context.place(member), message, related=(related,))
            elif not self._taken(member, "a value"):
                members[str(member)] = member
        make = cast("Callable[..., type[StrEnum]]", StrEnum)  # called as a function, it makes a class
        scope.enumerations[str(name)] = make(str(name), {one.upper(): one for one in members})

    def _declare_events(self, events: tuple[ast.EventSyntax, ...]) -> None:
        for event in events:
            name, place = event.name, self.context.place(event.name)
            self.declared.add(str(name))
            first = self.events.setdefault(str(name), place)
            if first is not None and first is not place:
                related = Related(first, "first declared here")
                self.context.report.add("E0209", place, f"event `{name}` is declared twice", related=(related,))
                continue
            self._declare_data(event, place)

    def _declare_data(self, event: ast.EventSyntax, place: Place) -> None:
        """What an event of the file carries; all declarations must agree."""
        fields: dict[str, EventField] = {}
        for one in event.fields:
            name = str(one.name)
            kind = self.context.scope.type_named(one.type)
            taken = f"{event.name}.{name}" in self.context.library.signals
            if taken or "." in name:
                self.context.add(
                    "E0211", one.name, f"`{name}` cannot name a part of an event: the name already has another meaning"
                )
            elif name in fields:
                self.context.add("E0209", one.name, f"event `{event.name}` carries `{name}` twice")
            elif kind is not None:
                enumeration = self.context.scope.enumerations.get(str(kind)) if isinstance(kind, Enumeration) else None
                fields[name] = EventField(name, kind, enumeration)
            if name not in fields:
                self.context.symbols.doubtful.add(f"{event.name}.{name}")
        if len(fields) < len(event.fields):
            self.context.symbols.doubtful.add(str(event.name))
            return
        found = EventData(str(event.name), tuple(fields.values()), place)
        known = self.data.get(found.event)
        if known is not None and [(one.name, one.type) for one in known.fields] != [
            (one.name, one.type) for one in found.fields
        ]:
            related = () if known.place is None else (Related(known.place, "declared otherwise here"),)
            form = ", ".join(f"{one.name} : {one.type}" for one in known.fields)
            message = f"event `{event.name}` is declared elsewhere with other data"
            self.context.report.add("E0209", place, message, f"write `{event.name}({form})`", related)
        elif fields:
            self.data[found.event] = found

    def _declare(self, name: Token, type_name: Token, value: ast.Expression | None, *, constant: bool) -> None:
        new = self.context.symbols.declared.get(str(name)) is name
        new = not self._taken(name, "a variable") and new
        kind = self.context.scope.type_named(type_name)
        if value is not None and self._made_of_later(name, value):
            self.context.scope.used.update(ast.names_in(value))
            self.context.symbols.doubtful.add(str(name))
            value = None
        initial = self.context.scope.value(value, kind) if kind is not None and value is not None else None
        if initial is not None and not isinstance(initial, Literal) and not self.context.scope.is_constant(initial):
            self.context.report.add(
                "E0303", initial.place, f"`{name}` needs an initial value made of constants and parameters"
            )
            initial = None
        if value is not None and initial is None:
            self.context.symbols.doubtful.add(str(name))
        if kind is None or not new:
            self.context.symbols.doubtful.add(str(name))
            return
        place = self.context.place(name)
        self.context.scope.variables[str(name)] = Declared(kind, constant, place)
        if not constant and initial is not None:
            self.variables.append(Variable(str(name), kind, initial, place=place))
        elif constant and initial is not None:
            self._declare_parameter(str(name), kind, initial)
        elif constant:
            self.parameters.append(Parameter(str(name), kind))

    def _declare_parameter(self, name: str, kind: Type, initial: Expression) -> None:
        """A parameter with a default, which may follow from the parameters before it."""
        if isinstance(initial, Literal):
            self.parameters.append(Parameter(name, kind, initial.value))
            return
        needed = {one.name for one in parts_of(initial) if isinstance(one, VariableValue)}
        required = [one.name for one in self.parameters if one.required and one.name in needed]
        if any(one in self.context.symbols.doubtful for one in required):
            self.context.symbols.doubtful.add(name)
            self.parameters.append(Parameter(name, kind))
        elif required:
            message = f"`{name}` depends on `{required[0]}`, which has no default itself"
            self.context.report.add("E0303", initial.place, message, f"give `{required[0]}` a default")
        elif needed <= {one.name for one in self.parameters}:  # otherwise one of them is invalid and reported already
            try:
                default = follow(initial, Parameter(name, kind), {one.name: one.default for one in self.parameters})
            except ValueError as error:
                self.context.report.add("E0306", initial.place, str(error))
            else:
                self.derived[name] = initial
                self.parameters.append(Parameter(name, kind, default))

    def _made_of_later(self, name: Token, value: ast.Expression) -> bool:
        """Whether a value uses a name declared on its own line or below; if so, report it."""
        made_of = self._made_of
        later = [one for one in ast.names_in(value) if one in made_of and one not in self.context.scope.variables]
        if not later or any(one in self.context.symbols.doubtful for one in later):
            return bool(later)
        used, seen = later[0], set(later)
        pending = list(later)
        while pending:
            more = made_of.get(pending.pop(), frozenset()) - seen
            seen |= more
            pending += more
        if str(name) in seen:
            message, hint = f"`{name}` depends on itself", "give one of them a value that does not depend on the others"
        else:
            message, hint = f"`{name}` depends on `{used}`, which is declared below it", f"put `{used}` above `{name}`"
        self.context.report.add("E0303", self.context.place(name), message, hint)
        return True

    def gather_events(self, order: Sequence[StateSymbol], imported: Iterable[str]) -> None:
        """Find out which events each state may receive: outcomes and final states inside it, what is raised anywhere.

        Args:
            order: all states in document order.
            imported: the events of imported machines.
        """
        for symbol in order:
            if symbol.initial is not None:
                self._gather_raised(symbol.initial.actions)
            for line in symbol.lines:
                if isinstance(line, ast.TransitionLine | ast.EntryLine | ast.ExitLine):
                    self._gather_raised(line.actions)
        self.heard.update(self.context.symbols.heard)
        for name in imported:
            self.events.setdefault(name, None)
            self.heard.add(name)
        for symbol in reversed(order):
            self._gather_outcomes(symbol)
            if symbol.parent is not None:
                symbol.parent.reported.update(symbol.reported)

    def _gather_raised(self, actions: tuple[ast.ActionSyntax, ...]) -> None:
        for action in actions:
            if isinstance(action, ast.SendSyntax):
                self.sent.add(str(action.event))
            if isinstance(action, ast.RaiseSyntax):
                self.events.setdefault(str(action.event), None)
                if action.delay is not None:
                    self.delayed.add(str(action.event))
                self.raised.setdefault(str(action.event), action.event)

    def _gather_outcomes(self, symbol: StateSymbol) -> None:
        finals = {child.name for child in symbol.children if child.kind is StateKind.FINAL}
        if symbol.activity is not None:
            name = str(symbol.activity.call.name)
            activities = self.context.library.activities
            activity = activities.get(name) or activities.get(self.context.report.guess(name, activities).name or "")
            symbol.reported.update(activity.outcomes if activity is not None else ())
            if activity is None:
                symbol.reported.add_unknown()
        if symbol.model is not None:
            for state in symbol.model.states:
                symbol.reported.update(state.activity.activity.outcomes if state.activity is not None else ())
                if state.kind is StateKind.FINAL:
                    finals.add(state.name.rpartition(".")[2])
        symbol.reported.update(finals)
        own = symbol.children if symbol.model is None else []
        instance = symbol.model is not None and bool(finals)
        regions = own if symbol.kind is StateKind.PARALLEL else []
        complete = bool(regions) and all(one.completions or one.reported.unknown for one in regions)
        if instance or complete or any(one.kind is StateKind.FINAL for one in own):
            symbol.completions.add("done")

    def expose(self) -> None:
        """Let machines that import this one read the variables that it exposes."""
        scope = self.context.scope
        for line in self.context.symbols.root.lines:
            for name in line.names if isinstance(line, ast.ExposeLine) else ():
                declared = scope.variables.get(str(name))
                if declared is None or declared.constant:
                    if name not in self.context.symbols.doubtful:
                        known = [one for one, other in scope.variables.items() if not other.constant]
                        what = f"there is no variable `{name}`" if declared is None else f"`{name}` is a parameter"
                        hint = self.context.report.guess(name, known).text or "variables can be exposed"
                        self.context.add_once("E0202", name, f"{what} to expose", hint)
                    continue
                if str(name) in self.exposed:
                    self.context.add("E0209", name, f"`{name}` is exposed twice")
                scope.used.add(str(name))
                self.exposed[str(name)] = None
                self._let_read(name)

    def _let_read(self, name: Token) -> None:
        for index, variable in enumerate(self.variables):
            if variable.name == name:
                self.variables[index] = replace(variable, exposed=True)
                if not isinstance(variable.initial, Literal):
                    message = f"`{name}` is exposed, and can be read before the machine begins"
                    self.context.add("E0303", name, message, "let it begin with a constant")

    def deferred(self, symbol: StateSymbol, token: Token) -> str:
        """The name of an event that is deferred: one from outside or one that is raised."""
        name = self.event(symbol, token)
        reported = name in symbol.reported.known or name in symbol.completions or name == "fault"
        if reported and name not in self.events and name not in self.context.library.events:
            hint = "only events from outside, raised ones and those of other machines are deferred"
            self.context.add_once("E0203", token, f"`{name}` is reported by `{symbol.name}` itself", hint)
        return name

    def event(self, symbol: StateSymbol, token: Token) -> str:
        """The name of an event; of a misspelt one the name that was probably meant."""
        name = str(token)
        if name == "*":
            self.heard.update((*self.events, *self.context.library.events))
            return name
        self.heard.add(name)
        symbol.awaited.add(name)
        table = self.context.symbols
        if name in symbol.reported or name in table.events or table.doubtful.has_part_of(name):
            return name
        sources = (self.context.library.events, self.events, symbol.completions, symbol.reported.known, ("fault",))
        if any(name in source for source in sources):
            return name
        guess = self.context.report.guess(name, (one for source in sources for one in source))
        message = f"nothing sends, raises or reports `{name}` in `{symbol.name}`"
        if guess.name is not None:
            self.heard.add(guess.name)
            self.context.add_once("E0203", token, message, guess.text)
            return guess.name
        # The source of all events of a state may be missing: report one diagnostic for all unknown events of a state.
        subject = self._unsent.setdefault(name, symbol.index)
        place, again = self.context.place(token), f"nor `{name}`" if subject == symbol.index else "and here"
        hint = guess.text or self._reporter(name) or _heard(symbol)
        if name in self.context.library.signals:
            hint = f"`{name}` is a signal: `when {name}`"
        if name in ("entry", "exit"):
            hint = f"write actions on {name} as `{name} / ...`"
        self.context.report.add_once("E0203", place, message, hint, subject=subject, again=again)
        symbol.awaited.add_unknown()
        self.heard.add_unknown()
        return name

    def _reporter(self, outcome: str) -> str | None:
        """A suggestion: the activities that would report an outcome."""
        activities = self.context.library.activities.values()
        names = [one.name for one in activities if outcome in one.outcomes]
        if not 0 < len(names) <= _MOST_REPORTERS:
            return None
        return (
            f"it is an outcome of {' and of '.join(f'`{name}`' for name in names)}, which a state does: `do {names[0]}`"
        )

    def unused(self, imports: Iterable[str]) -> list[Unused]:
        """Everything that is declared and never used.

        Args:
            imports: the imported machines that no state is an instance of.
        """
        found: list[Unused] = []
        if self.heard.unknown:
            return found
        for name in imports:
            found.append(Unused("import", name, self.context.place(self.context.symbols.imports[name])))
        for name, declared in self.context.scope.variables.items():
            if name not in self.context.scope.used and declared.owner is None:
                found.append(Unused("parameter" if declared.constant else "variable", name, declared.place))
        for name, definition in self.context.scope.definitions.items():
            if name not in self.context.scope.used:
                found.append(Unused("definition", name, definition.place))
        for name, place in self.events.items():
            if place is None or name in self.raised or name in self.sent:
                continue
            if name not in self.heard:
                found.append(Unused("event", name, place))
            elif name not in self.context.library.events:
                found.append(Unused("outside event", name, place))
        for name, token in self.raised.items():
            if name not in self.heard and self.events[name] is None and name not in self.context.library.events:
                found.append(Unused("raised event", name, self.context.place(token)))
        return found


def _heard(symbol: StateSymbol) -> str | None:
    """A suggestion: the events that a state receives."""
    names = sorted(symbol.completions | symbol.reported.known)
    return f"events of `{symbol.name}`: {', '.join(names)}" if 0 < len(names) <= _MOST_HEARD else None


def _made_of(lines: Iterable[object]) -> Mapping[str, frozenset[str]]:
    """The expression of each parameter and variable of a file, by name."""
    found = {}
    for line in lines:
        if isinstance(line, ast.ParameterLine | ast.VariableLine):
            value = line.default if isinstance(line, ast.ParameterLine) else line.initial
            found[str(line.name)] = frozenset(() if value is None else ast.names_in(value))
    return found
