"""From an outline to a model: states are numbered, names get a meaning, instances their copies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from hsm.dsl import checks
from hsm.dsl.reporting.report import Report
from hsm.dsl.semantics.behaviour import Behaviour
from hsm.dsl.semantics.context import Context
from hsm.dsl.semantics.declarations import Declarations
from hsm.dsl.semantics.instances import Graft, graft
from hsm.dsl.semantics.outline import HISTORY, Draft, outline
from hsm.dsl.semantics.properties import compile_properties
from hsm.dsl.semantics.subject import PSEUDO, Subject
from hsm.dsl.semantics.typing import Scope
from hsm.dsl.syntax import ast
from hsm.model.chart import Action, Model, State, StateKind, Variable
from hsm.model.diagnostics import Diagnostic, Severity
from hsm.model.properties import Property
from hsm.model.registry import Library
from hsm.model.types import Quantity

_DURATION = Quantity(time=1)


@dataclass(frozen=True, slots=True)
class Unit:
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
    subject: Subject
    diagnostics: tuple[Diagnostic, ...]
    events: frozenset[str] = frozenset()


def compile_file(
    tree: ast.File, found: list[Diagnostic], library: Library, machines: Mapping[str, Unit | None]
) -> Unit:
    """Build a machine from its syntax tree.

    Args:
        tree: the file as read.
        found: what is already known to be wrong; with an error among it no model is given out.
        library: the registry.
        machines: what the file imports, by name; None for a machine that cannot be had.
    """
    report = Report(tree.name, found)
    plan = outline(tree, report)
    context = Context(tree, library, report, plan, Scope(library, report))
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
        strange: some state is an instance of a machine that is not imported.
        copied_properties: those of instances.
    """

    context: Context
    machines: Mapping[str, Unit | None]
    declarations: Declarations
    behaviour: Behaviour
    strange: bool = False
    copied_properties: list[Property] = field(default_factory=list)

    def run(self) -> Unit:
        """All stages."""
        plan, report = self.context.plan, self.context.report
        self.context.scope.doubt = plan.doubt
        self.declarations.declare()
        drafts = plan.all_states()
        for draft in drafts:
            self._find_machine(draft)
        for draft in drafts:
            self._request_histories(draft)
        order = self._number()
        self.context.scope.states = self._names_of_states(order)
        known = [unit for unit in self.machines.values() if unit is not None and unit.model is not None]
        events = [name for unit in self.machines.values() if unit is not None for name in unit.events]
        complete = len(known) == len(self.machines) and not self.strange and not plan.doubt.eventful
        self.declarations.gather_events(order, events, complete=complete)
        states: list[State] = []
        for draft in order:
            states.extend(self._states(draft))
        subject = self._subject(order, self._model(states))
        report.found.extend(checks.errors(subject))
        failed = any(one.severity is Severity.ERROR for one in report.found)
        own = frozenset(self.declarations.events)
        return Unit(self.context.tree, None if failed else subject.model, subject, tuple(report.found), own)

    def _subject(self, order: Sequence[Draft], model: Model) -> Subject:
        plan = self.context.plan
        instantiated = {str(draft.instance.name) for draft in order if draft.instance is not None}
        idle = [name for name in plan.imports if name not in instantiated and self.machines.get(name) is not None]
        return Subject(
            file=self.context.tree.name,
            model=model,
            stays={draft.index: tuple(map(self.behaviour.stay, draft.stays)) for draft in order if draft.stays},
            doubt=plan.doubt,
            unresolved=plan.unresolved or plan.doubt.unread,
            uncertain=frozenset(self.behaviour.uncertain),
            deaf=frozenset(draft.index for draft in order if draft.deaf),
            broken=frozenset(draft.index for draft in order if draft.broken),
            opaque=frozenset(draft.index for draft in order if draft.opaque),
            unused=() if plan.doubt.unread else tuple(self.declarations.unused([] if self.strange else idle)),
        )

    def _model(self, states: list[State]) -> Model:
        plan = self.context.plan
        heading = plan.heading
        files = [self.context.tree.name]
        for unit in self.machines.values():
            if unit is not None and unit.model is not None:
                files.extend(name for name in unit.model.files if name not in files)
        return Model(
            self.context.plan.root.name,
            tuple(states),
            tuple(self.behaviour.transitions),
            tuple(self.declarations.variables),
            tuple(self.declarations.parameters),
            tuple(files),
            self.context.tree.comment_above(heading.name.line or 1) if heading is not None else "",
            compile_properties(
                (line for line in self.context.plan.root.lines if isinstance(line, ast.PropertyLine)),
                self.context.tree.lines,
                self.context.scope,
                states,
                certain=not (plan.root.opaque or plan.unresolved or self.behaviour.idle or self.declarations.puzzled),
            )
            + tuple(self.copied_properties),
        )

    def _find_machine(self, draft: Draft) -> None:
        if draft.instance is None:
            return
        name = draft.instance.name
        draft.kind = StateKind.COMPOUND
        unit = self.machines.get(str(name))
        draft.model = unit.model if unit is not None else None
        draft.opaque = draft.model is None
        if name in self.machines:
            return
        self.strange = True
        # Where an import is at fault, it is most likely the one that is meant.
        if None in self.machines.values() or name in self.context.plan.doubt:
            return
        hint = (
            self.context.report.guess(name, self.machines).text or f"import it at the top of the file: `import {name}`"
        )
        self.context.add_once("E0208", name, f"there is no machine `{name}`", hint)

    def _request_histories(self, draft: Draft) -> None:
        for line in draft.lines:
            if not isinstance(line, ast.TransitionLine) or line.target is None:
                continue
            for target in line.target.names:
                owner_name, dot, suffix = target.rpartition(".")
                owner = self.context.plan.states.get(owner_name)
                if not dot or suffix not in HISTORY or owner is None:
                    continue
                if owner.kind in (StateKind.ATOMIC, StateKind.FINAL):
                    if not (owner.broken or owner.opaque or self.context.plan.doubt.unread):
                        message = f"`{owner_name}` has no states inside, so it has no history"
                        self.context.add_once("E0407", target, message, f"go to `{owner_name}`")
                    self.context.plan.unresolved = True
                elif HISTORY[suffix] not in owner.histories:
                    kind = HISTORY[suffix]
                    owner.histories[kind] = Draft(str(target), kind, owner, owner.token)

    def _number(self) -> list[Draft]:
        """All states in document order, numbered with the states of instances between them."""
        order: list[Draft] = []
        count = 0
        stack = [self.context.plan.root]
        while stack:
            draft = stack.pop()
            draft.index = count
            count += len(draft.model.states) if draft.model is not None else 1
            order.append(draft)
            stack.extend(reversed(draft.inner()))
        for draft in reversed(order):
            inner = draft.inner()
            copied = len(draft.model.states) - 1 if draft.model is not None else 0
            draft.last = inner[-1].last if inner else draft.index + copied
        return order

    def _names_of_states(self, order: list[Draft]) -> frozenset[str]:
        names = set(self.context.plan.states)
        for draft in order:
            if draft.model is not None:
                names.update(f"{draft.name}.{state.name}" for state in draft.model.states[1:])
        return frozenset(names)

    def _states(self, draft: Draft) -> list[State]:
        """A state; with its copied states behind it where it is an instance."""
        if draft.model is None:
            if draft.instance is not None:
                self.behaviour.look_at(draft.instance)
            return [self._state(draft, None)]
        copied = graft(draft.model, draft.name, draft.index, len(self.behaviour.transitions))
        self.behaviour.transitions.extend(copied.transitions)
        self.copied_properties.extend(copied.properties)
        self._bind(draft, draft.model, copied)
        return [self._state(draft, copied.root), *copied.states]

    def _bind(self, draft: Draft, model: Model, copied: Graft) -> None:
        """The parameters of an instance become constants that its state's entry sets."""
        assert draft.instance is not None
        arguments = self.context.scope.arguments(draft.instance, model.parameters, f"machine `{draft.instance.name}`")
        if arguments is not None:
            place = self.context.place(draft.instance.name, draft.instance.closing)
            for parameter, value in zip(model.parameters, arguments, strict=True):
                name = f"{draft.name}.{parameter.name}"
                self.declarations.variables.append(
                    Variable(name, parameter.type, value, draft.index, constant=True, place=place)
                )
        self.declarations.variables.extend(copied.variables)

    def _state(self, draft: Draft, machine: State | None) -> State:
        """A state; what an instance's machine says of its root comes first."""
        base = machine if machine is not None else State(draft.index, draft.name, draft.kind, -1)
        numbers, entry, exits = list(base.transitions), list(base.entry), list(base.exit)
        for line in draft.lines:
            match line:
                case ast.TransitionLine():
                    numbers.append(len(self.behaviour.transitions))
                    self.behaviour.transitions.append(self.behaviour.transition(draft, line))
                case ast.EntryLine(actions):
                    entry.extend(self.behaviour.actions(actions))
                case ast.ExitLine(actions):
                    exits.extend(self.behaviour.actions(actions))
        initial, initial_actions = (base.initial, base.initial_actions) if machine else self._initial(draft)
        token, nested = draft.token, draft.parent is not None and draft.kind not in PSEUDO
        return State(
            index=draft.index,
            name=draft.name,
            kind=draft.kind,
            parent=draft.parent.index if draft.parent is not None else -1,
            children=(*base.children, *(one.index for one in draft.inner())),
            last=draft.last,
            initial=initial,
            initial_actions=initial_actions,
            entry=tuple(entry),
            exit=tuple(exits),
            activity=base.activity if machine else self.behaviour.activity(draft),
            transitions=tuple(numbers),
            instance=str(draft.instance.name) if draft.instance is not None else None,
            doc=self.context.tree.comment_above(token.line or 1) if token is not None and nested else "",
            place=self.context.place(token) if token is not None else None,
        )

    def _initial(self, draft: Draft) -> tuple[tuple[int, ...], tuple[Action, ...]]:
        if draft.kind in PSEUDO:
            assert draft.parent is not None
            return self._default_of(draft.parent), ()
        if draft.initial is None:
            return self._default_of(draft), ()
        target = self.behaviour.named_state(draft.initial.target)
        actions = self.behaviour.actions(draft.initial.actions)
        if target is not None and not draft.broken and (target is draft or draft not in target.ancestors()):
            hint = "name one of the states inside"
            self.context.add("E0405", draft.initial.target, f"`{target.name}` does not lie in `{draft.name}`", hint)
            target = None
        return (target.index,) if target is not None else (), actions

    def _default_of(self, draft: Draft) -> tuple[int, ...]:
        """What a state's entry enters where no history says otherwise."""
        if draft.model is not None:
            return tuple(draft.index + one for one in draft.model.states[0].initial)
        if draft.kind is StateKind.PARALLEL:
            return tuple(child.index for child in draft.children)
        if draft.initial is not None:
            target = self.context.plan.states.get(str(draft.initial.target))
            return (target.index,) if target is not None else ()
        return tuple(child.index for child in draft.children[:1])
