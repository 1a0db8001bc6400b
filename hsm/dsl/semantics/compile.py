"""From a symbol table to a model: number the states, resolve the names, copy the instances."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from enum import StrEnum
from typing import cast

from hsm.dsl.reporting.report import Report
from hsm.dsl.semantics.analysis import PSEUDO, AnalysisInput
from hsm.dsl.semantics.behaviour import Behaviour
from hsm.dsl.semantics.context import Context
from hsm.dsl.semantics.declarations import Declarations
from hsm.dsl.semantics.names import Names
from hsm.dsl.semantics.properties import compile_properties
from hsm.dsl.semantics.symbols import HISTORY, StateSymbol, collect_symbols
from hsm.dsl.semantics.typing import Scope
from hsm.dsl.semantics.values import Declared
from hsm.dsl.syntax import ast
from hsm.model.chart import Action, Assign, Emit, EventData, Model, State, StateKind, Variable
from hsm.model.diagnostics import Diagnostic, Severity
from hsm.model.expressions import Literal
from hsm.model.instances import InstanceCopy, instantiate
from hsm.model.members import library_of_members
from hsm.model.properties import Property
from hsm.model.registry import Library
from hsm.model.rewriting import Rewriter, actions_of
from hsm.model.types import Enumeration
from hsm.model.values import dataclass


@dataclass(frozen=True, slots=True)
class CompilationUnit:
    """One file, compiled on its own.

    Attributes:
        tree: the file as read.
        model: the machine; None where there are errors.
        subject: what the checks look at; with errors, as far as it could be understood.
        diagnostics: what was found so far.
        events: the events that it declares or raises.
    """

    tree: ast.File
    model: Model | None
    subject: AnalysisInput
    diagnostics: tuple[Diagnostic, ...]
    events: frozenset[str] = frozenset()


def compile_file(
    tree: ast.File, found: list[Diagnostic], library: Library, machines: Mapping[str, CompilationUnit | None]
) -> CompilationUnit:
    """Build a machine from its syntax tree.

    Args:
        tree: the file as read.
        found: the diagnostics so far; if one is an error, no model is returned.
        library: the registry.
        machines: what the file imports, by name; None for a machine that cannot be had.
    """
    report = Report(tree.name, found)
    table = collect_symbols(tree, report)
    library = library_of_members(library, table.members())
    context = Context(tree, library, report, table, Scope(library, report))
    declarations = Declarations(context)
    return _Compiler(context, machines, declarations, Behaviour(context, declarations)).run()


@dataclass(slots=True)
class _Compiler:
    """The work of one compilation, in the order of ``run``.

    Attributes:
        context: what all stages share.
        machines: what the file imports.
        declarations: the file's parameters, variables and events.
        behaviour: analyses the lines of states.
        instantiated: the machines that states are instances of.
        copied_properties: those of instances.
        copied_assumptions: theirs.
    """

    context: Context
    machines: Mapping[str, CompilationUnit | None]
    declarations: Declarations
    behaviour: Behaviour
    instantiated: Names = field(default_factory=Names)
    copied_properties: list[Property] = field(default_factory=list)
    copied_assumptions: list[Property] = field(default_factory=list)

    def run(self) -> CompilationUnit:
        """All stages."""
        table, report = self.context.symbols, self.context.report
        self.context.scope.doubtful, self.context.scope.possible = table.doubtful, table.possible
        for unit in self.machines.values():
            for one in unit.model.enumerations if unit is not None and unit.model is not None else ():
                self.context.scope.enumerations.setdefault(one.__name__, one)
        symbols = table.all_states()
        for symbol in symbols:
            self._find_machine(symbol)
        self.declarations.declare([one for symbol in symbols for one in self._imported_data(symbol)])
        for symbol in symbols:
            self._let_read(symbol)
        self.declarations.expose()
        for symbol in symbols:
            self._request_histories(symbol)
        order = self._number()
        self.context.scope.states = self._names_of_states(order)
        self.declarations.define()
        if self.instantiated.unknown or any(unit is None or unit.model is None for unit in self.machines.values()):
            table.events.add_unknown()
        self.declarations.gather_events(order, self._imported_events(symbols))
        states: list[State] = []
        for symbol in order:
            states.extend(self._states(symbol))
        subject = self._subject(order, self._connected(self._model(order, states), symbols))
        failed = any(one.severity is Severity.ERROR for one in report.found)
        own = frozenset(self.declarations.events)
        return CompilationUnit(self.context.tree, None if failed else subject.model, subject, tuple(report.found), own)

    def _imported_events(self, symbols: Sequence[StateSymbol]) -> list[str]:
        """The events of imported machines: those of instances by name, those of members with the member as prefix."""
        members = {str(one.instance.name) for one in symbols if one.member and one.instance is not None}
        plain = {str(one.instance.name) for one in symbols if not one.member and one.instance is not None}
        events = [
            event
            for name, unit in self.machines.items()
            if unit is not None and (name in plain or name not in members)
            for event in unit.events
        ]
        for one in symbols:
            if one.member and one.model is not None:
                self.declarations.sent.update(act.event for act in actions_of(one.model) if isinstance(act, Emit))
                events += [f"{one.name}.{event}" for event in sorted(one.model.events or ())]
        return events

    def _imported_data(self, symbol: StateSymbol) -> list[EventData]:
        """What the events of an instance or a member carry."""
        data = symbol.model.event_data if symbol.model is not None else ()
        return [replace(one, event=f"{symbol.name}.{one.event}") if symbol.member else one for one in data]

    def _let_read(self, symbol: StateSymbol) -> None:
        """The values of an instance that this file may read: its exposed variables, and its outcome."""
        if symbol.model is None or symbol.token is None:
            return
        scope, place = self.context.scope, self.context.place(symbol.token)
        types = {one.name: one.type for one in symbol.model.variables}
        for name in symbol.model.exposed:
            scope.variables[f"{symbol.name}.{name}"] = Declared(types[name], False, place, symbol.name)  # noqa: FBT003
        finals = [one.own_name for one in symbol.model.states if one.kind is StateKind.FINAL and one.parent == 0]
        name = _outcome(symbol)
        if finals and name not in scope.variables:
            make = cast("Callable[..., type[StrEnum]]", StrEnum)  # called as a function, it makes a class
            members = dict.fromkeys(("none", *finals))
            kind = make(name, {f"value_{number}": one for number, one in enumerate(members)})
            scope.outcomes[name] = kind
            scope.variables[name] = Declared(Enumeration(name, tuple(members)), False, place, symbol.name)  # noqa: FBT003

    def _noting_outcomes(self, order: Sequence[StateSymbol], states: list[State]) -> list[State]:
        """The states, where those that end an instance note how it has ended, if anything reads that."""
        noted = list(states)
        for symbol in order:
            name = _outcome(symbol)
            kind = self.context.scope.outcomes.get(name)
            if kind is None or name not in self.context.scope.used.known or symbol.token is None:
                continue
            place, declared = self.context.place(symbol.token), self.context.scope.variables[name].type
            first = Literal(kind("none"), declared, place)
            variable = Variable(name, declared, first, symbol.index, place=place, exposed=True)
            self.declarations.variables.append(variable)
            for index, state in enumerate(noted):
                if state.parent == symbol.index and state.kind is StateKind.FINAL:
                    note = Assign(name, Literal(kind(state.own_name), declared, place), place)
                    noted[index] = replace(state, entry=(note, *state.entry))
        return noted

    def _connected(self, model: Model, symbols: Sequence[StateSymbol]) -> Model:
        """The machine, in which what is sent goes to those members that know the event, and to this file."""
        members = {one.name: one.model.events or frozenset() for one in symbols if one.member and one.model is not None}

        def connect(action: Action) -> Action:
            if not isinstance(action, Emit):
                return action
            sender = next((name for name in members if action.event.startswith(f"{name}.")), None)
            event = action.event if sender is None else action.event[len(sender) + 1 :]
            receivers = [f"{name}.{event}" for name, known in members.items() if name != sender and event in known]
            if sender is not None and event in self.declarations.declared:
                receivers.append(event)
            return replace(action, receivers=tuple(receivers))

        return Rewriter(action=connect).model(model) if members else model

    def _subject(self, order: Sequence[StateSymbol], model: Model) -> AnalysisInput:
        table = self.context.symbols
        imports = [
            name for name in table.imports if name not in self.instantiated and self.machines.get(name) is not None
        ]
        return AnalysisInput(
            file=self.context.tree.name,
            model=model,
            stays={symbol.index: tuple(map(self.behaviour.stay, symbol.stays)) for symbol in order if symbol.stays},
            doubtful=table.doubtful,
            leading_anywhere=table.entered.unknown,
            uncertain=frozenset(self.behaviour.uncertain),
            awaiting_unknown=frozenset(symbol.index for symbol in order if symbol.awaited.unknown),
            erroneous=frozenset(symbol.index for symbol in order if symbol.erroneous),
            reporting_unknown=frozenset(symbol.index for symbol in order if symbol.reported.unknown),
            unused=tuple(self.declarations.unused(imports)),
        )

    def _model(self, order: Sequence[StateSymbol], states: list[State]) -> Model:
        table = self.context.symbols
        heading = table.heading
        files = [self.context.tree.name]
        for unit in self.machines.values():
            if unit is not None and unit.model is not None:
                files.extend(name for name in unit.model.files if name not in files)
        stated = (*self._claims(ast.PropertyLine, states), *self.copied_properties)
        assumed = (*self._claims(ast.AssumptionLine, states), *self.copied_assumptions)
        return Model(
            self.context.symbols.root.name,
            tuple(self._noting_outcomes(order, states)),
            tuple(self.behaviour.transitions),
            tuple(self.declarations.variables),
            tuple(self.declarations.parameters),
            self.declarations.derived,
            tuple(files),
            self.context.tree.comment_above(heading.name.line) if heading is not None else "",
            stated,
            frozenset((*self.declarations.events, *self.context.library.events)),
            enumerations=self.context.scope.own_enumerations(),
            event_data=tuple(self.declarations.data.values()),
            exposed=tuple(self.declarations.exposed),
            members=tuple(table.members()),
            assumptions=assumed,
            adjustable=tuple(self.declarations.adjustable.values()),
        )

    def _claims(self, kind: type[ast.PropertyLine], states: list[State]) -> tuple[Property, ...]:
        """What is stated in lines of one kind."""
        table = self.context.symbols
        doubts = (table.root.reported, table.entered, self.behaviour.performed, self.declarations.heard)
        further = Names(unknown=any(names.unknown for names in doubts))
        lines = (line for line in table.root.lines if type(line) is kind)
        return compile_properties(lines, self.context.tree.lines, self.context.scope, states, further)

    def _find_machine(self, symbol: StateSymbol) -> None:
        if symbol.instance is None:
            return
        name = symbol.instance.name
        symbol.kind = StateKind.COMPOUND
        unit = self.machines.get(str(name))
        symbol.model = unit.model if unit is not None else None
        if symbol.model is not None and symbol.model.members:
            symbol.model = None
            message = f"machine `{name}` has members: it is not part of another machine"
            self.context.add_once("E0208", name, message, "write its members into this file")
        if symbol.model is None:
            symbol.reported.add_unknown()
            self.context.symbols.doubtful.add(symbol.name)
        self.instantiated.add(str(name))
        if name in self.machines:
            return
        self.instantiated.add_unknown()
        # If an import is invalid, it is most likely the one that is meant.
        if None in self.machines.values() or name in self.context.symbols.doubtful:
            return
        hint = (
            self.context.report.guess(name, self.machines).text or f"import it at the top of the file: `import {name}`"
        )
        self.context.add_once("E0208", name, f"there is no machine `{name}`", hint)

    def _request_histories(self, symbol: StateSymbol) -> None:
        for line in symbol.lines:
            if not isinstance(line, ast.TransitionLine) or line.target is None:
                continue
            for target in line.target.names:
                owner_name, dot, suffix = target.rpartition(".")
                owner = self.context.symbols.states.get(owner_name)
                if not dot or suffix not in HISTORY or owner is None:
                    continue
                if owner.kind in (StateKind.ATOMIC, StateKind.FINAL):
                    if not (owner.erroneous or owner.reported.unknown or self.context.symbols.possible):
                        message = f"`{owner_name}` has no states inside it, so it has no history"
                        self.context.add_once("E0407", target, message, f"go to `{owner_name}`")
                    self.context.symbols.entered.add_unknown()
                elif HISTORY[suffix] not in owner.histories:
                    kind = HISTORY[suffix]
                    owner.histories[kind] = StateSymbol(str(target), kind, owner, owner.token)

    def _number(self) -> list[StateSymbol]:
        """All states in document order, numbered with the states of instances between them."""
        order: list[StateSymbol] = []
        count = 0
        stack = [self.context.symbols.root]
        while stack:
            symbol = stack.pop()
            symbol.index = count
            count += len(symbol.model.states) if symbol.model is not None else 1
            order.append(symbol)
            stack.extend(reversed(symbol.inner()))
        for symbol in reversed(order):
            inner = symbol.inner()
            copied = len(symbol.model.states) - 1 if symbol.model is not None else 0
            symbol.last = inner[-1].last if inner else symbol.index + copied
        return order

    def _names_of_states(self, order: list[StateSymbol]) -> frozenset[str]:
        names = set(self.context.symbols.states)
        for symbol in order:
            if symbol.model is not None:
                names.update(f"{symbol.name}.{state.name}" for state in symbol.model.states[1:])
        return frozenset(names)

    def _states(self, symbol: StateSymbol) -> list[State]:
        """A state, followed by its copied states if it is an instance."""
        if symbol.model is None:
            if symbol.instance is not None:
                self.behaviour.look_at(symbol.instance)
            return [self._state(symbol, None)]
        copied = instantiate(
            symbol.model, symbol.name, symbol.index, len(self.behaviour.transitions), member=symbol.member
        )
        self.behaviour.transitions.extend(copied.transitions)
        self.copied_properties.extend(copied.properties)
        self.copied_assumptions.extend(copied.assumptions)
        self._bind(symbol, symbol.model, copied)
        return [self._state(symbol, copied.root), *copied.states]

    def _bind(self, symbol: StateSymbol, model: Model, copied: InstanceCopy) -> None:
        """The parameters of an instance become constants that its state's entry sets."""
        assert symbol.instance is not None
        arguments = self.context.scope.arguments(
            symbol.instance, model.parameters, f"machine `{symbol.instance.name}`", copied.derived
        )
        if arguments is not None:
            place = self.context.place(symbol.instance.name, symbol.instance.closing)
            for parameter, value in zip(model.parameters, arguments, strict=True):
                name = f"{symbol.name}.{parameter.name}"
                self.declarations.variables.append(
                    Variable(name, parameter.type, value, symbol.index, constant=True, place=place)
                )
        self.declarations.variables.extend(copied.variables)

    def _state(self, symbol: StateSymbol, machine: State | None) -> State:
        """A state; for an instance, the lines of its machine's root come first."""
        base = machine if machine is not None else State(symbol.index, symbol.name, symbol.kind, -1)
        numbers, entry, exits = list(base.transitions), list(base.entry), list(base.exit)
        for line in symbol.lines:
            match line:
                case ast.TransitionLine():
                    numbers.append(len(self.behaviour.transitions))
                    self.behaviour.transitions.append(self.behaviour.transition(symbol, line))
                case ast.EntryLine(actions):
                    entry.extend(self.behaviour.actions(actions))
                case ast.ExitLine(actions):
                    exits.extend(self.behaviour.actions(actions))
        initial, initial_actions = (base.initial, base.initial_actions) if machine else self._initial(symbol)
        token, nested = symbol.token, symbol.parent is not None and symbol.kind not in PSEUDO
        return State(
            index=symbol.index,
            name=symbol.name,
            kind=symbol.kind,
            parent=symbol.parent.index if symbol.parent is not None else -1,
            children=(*base.children, *(one.index for one in symbol.inner())),
            last=symbol.last,
            initial=initial,
            initial_actions=initial_actions,
            entry=tuple(entry),
            exit=tuple(exits),
            activity=base.activity if machine else self.behaviour.activity(symbol),
            transitions=tuple(numbers),
            instance=str(symbol.instance.name) if symbol.instance is not None else None,
            doc=self.context.tree.comment_above(token.line) if token is not None and nested else "",
            place=self.context.place(token) if token is not None else None,
        )

    def _initial(self, symbol: StateSymbol) -> tuple[tuple[int, ...], tuple[Action, ...]]:
        if symbol.kind in PSEUDO:
            assert symbol.parent is not None
            return self._default_of(symbol.parent), ()
        if symbol.initial is None:
            return self._default_of(symbol), ()
        target = self.behaviour.named_state(symbol.initial.target)
        actions = self.behaviour.actions(symbol.initial.actions)
        if target is not None and not symbol.erroneous and (target is symbol or symbol not in target.ancestors()):
            hint = "name one of the states inside it"
            self.context.add("E0405", symbol.initial.target, f"`{target.name}` is not inside `{symbol.name}`", hint)
            target = None
        return (target.index,) if target is not None else (), actions

    def _default_of(self, symbol: StateSymbol) -> tuple[int, ...]:
        """The state that entry enters unless a history overrides it."""
        if symbol.model is not None:
            return tuple(symbol.index + one for one in symbol.model.states[0].initial)
        if symbol.kind is StateKind.PARALLEL:
            return tuple(child.index for child in symbol.children)
        if symbol.initial is not None:
            target = self.context.symbols.states.get(str(symbol.initial.target))
            return (target.index,) if target is not None else ()
        return tuple(child.index for child in symbol.children[:1])


def _outcome(symbol: StateSymbol) -> str:
    """How an expression names the way in which an instance has ended."""
    return f"{symbol.name}.outcome"
