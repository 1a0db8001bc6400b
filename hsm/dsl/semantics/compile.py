"""From an outline to a model: states are numbered, names get a meaning, instances their copies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from hsm.dsl.reporting.report import Report
from hsm.dsl.semantics.analysis import PSEUDO, AnalysisInput
from hsm.dsl.semantics.behaviour import Behaviour
from hsm.dsl.semantics.context import Context
from hsm.dsl.semantics.declarations import Declarations
from hsm.dsl.semantics.instances import InstanceCopy, instantiate
from hsm.dsl.semantics.names import Names
from hsm.dsl.semantics.properties import compile_properties
from hsm.dsl.semantics.symbols import HISTORY, StateSymbol, collect_symbols
from hsm.dsl.semantics.typing import Scope
from hsm.dsl.syntax import ast
from hsm.model.chart import Action, Model, State, StateKind, Variable
from hsm.model.diagnostics import Diagnostic, Severity
from hsm.model.properties import Property
from hsm.model.registry import Library
from hsm.model.types import Quantity

_DURATION = Quantity(time=1)


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
        found: what is already known to be wrong; with an error among it no model is given out.
        library: the registry.
        machines: what the file imports, by name; None for a machine that cannot be had.
    """
    report = Report(tree.name, found)
    table = collect_symbols(tree, report)
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
        behaviour: gives the lines of states their meaning.
        instantiated: the machines that states are instances of.
        copied_properties: those of instances.
    """

    context: Context
    machines: Mapping[str, CompilationUnit | None]
    declarations: Declarations
    behaviour: Behaviour
    instantiated: Names = field(default_factory=Names)
    copied_properties: list[Property] = field(default_factory=list)

    def run(self) -> CompilationUnit:
        """All stages."""
        table, report = self.context.symbols, self.context.report
        self.context.scope.doubtful = table.doubtful
        for unit in self.machines.values():
            for one in unit.model.enumerations if unit is not None and unit.model is not None else ():
                self.context.scope.enumerations.setdefault(one.__name__, one)
        units = [unit.model for unit in self.machines.values() if unit is not None and unit.model is not None]
        self.declarations.declare([one for model in units for one in model.event_data])
        symbols = table.all_states()
        for symbol in symbols:
            self._find_machine(symbol)
        for symbol in symbols:
            self._request_histories(symbol)
        order = self._number()
        self.context.scope.states = self._names_of_states(order)
        self.declarations.define()
        if self.instantiated.unknown or any(unit is None or unit.model is None for unit in self.machines.values()):
            table.events.add_unknown()
        events = [name for unit in self.machines.values() if unit is not None for name in unit.events]
        self.declarations.gather_events(order, events)
        states: list[State] = []
        for symbol in order:
            states.extend(self._states(symbol))
        subject = self._subject(order, self._model(states))
        failed = any(one.severity is Severity.ERROR for one in report.found)
        own = frozenset(self.declarations.events)
        return CompilationUnit(self.context.tree, None if failed else subject.model, subject, tuple(report.found), own)

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
            leading_anywhere=table.entered.unknown or table.unread > 0,
            uncertain=frozenset(self.behaviour.uncertain),
            awaiting_unknown=frozenset(symbol.index for symbol in order if symbol.awaited.unknown),
            erroneous=frozenset(symbol.index for symbol in order if symbol.erroneous),
            reporting_unknown=frozenset(symbol.index for symbol in order if symbol.reported.unknown),
            unused=() if table.unread else tuple(self.declarations.unused(imports)),
        )

    def _model(self, states: list[State]) -> Model:
        table = self.context.symbols
        heading = table.heading
        files = [self.context.tree.name]
        for unit in self.machines.values():
            if unit is not None and unit.model is not None:
                files.extend(name for name in unit.model.files if name not in files)
        return Model(
            self.context.symbols.root.name,
            tuple(states),
            tuple(self.behaviour.transitions),
            tuple(self.declarations.variables),
            tuple(self.declarations.parameters),
            self.declarations.derived,
            tuple(files),
            self.context.tree.comment_above(heading.name.line or 1) if heading is not None else "",
            compile_properties(
                (line for line in self.context.symbols.root.lines if isinstance(line, ast.PropertyLine)),
                self.context.tree.lines,
                self.context.scope,
                states,
                certain=not any(
                    names.unknown
                    for names in (
                        table.root.reported,
                        table.entered,
                        self.behaviour.performed,
                        self.declarations.heard,
                    )
                ),
            )
            + tuple(self.copied_properties),
            frozenset((*self.declarations.events, *self.context.library.events)),
            enumerations=self.context.scope.own_enumerations(),
            event_data=tuple(self.declarations.data.values()),
        )

    def _find_machine(self, symbol: StateSymbol) -> None:
        if symbol.instance is None:
            return
        name = symbol.instance.name
        symbol.kind = StateKind.COMPOUND
        unit = self.machines.get(str(name))
        symbol.model = unit.model if unit is not None else None
        if symbol.model is None:
            symbol.reported.add_unknown()
        self.instantiated.add(str(name))
        if name in self.machines:
            return
        self.instantiated.add_unknown()
        # Where an import is at fault, it is most likely the one that is meant.
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
                    if not (owner.erroneous or owner.reported.unknown or self.context.symbols.unread):
                        message = f"`{owner_name}` has no states inside, so it has no history"
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
        """A state; with its copied states behind it where it is an instance."""
        if symbol.model is None:
            if symbol.instance is not None:
                self.behaviour.look_at(symbol.instance)
            return [self._state(symbol, None)]
        copied = instantiate(symbol.model, symbol.name, symbol.index, len(self.behaviour.transitions))
        self.behaviour.transitions.extend(copied.transitions)
        self.copied_properties.extend(copied.properties)
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
        """A state; what an instance's machine says of its root comes first."""
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
            doc=self.context.tree.comment_above(token.line or 1) if token is not None and nested else "",
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
            hint = "name one of the states inside"
            self.context.add("E0405", symbol.initial.target, f"`{target.name}` does not lie in `{symbol.name}`", hint)
            target = None
        return (target.index,) if target is not None else (), actions

    def _default_of(self, symbol: StateSymbol) -> tuple[int, ...]:
        """What a state's entry enters where no history says otherwise."""
        if symbol.model is not None:
            return tuple(symbol.index + one for one in symbol.model.states[0].initial)
        if symbol.kind is StateKind.PARALLEL:
            return tuple(child.index for child in symbol.children)
        if symbol.initial is not None:
            target = self.context.symbols.states.get(str(symbol.initial.target))
            return (target.index,) if target is not None else ()
        return tuple(child.index for child in symbol.children[:1])
