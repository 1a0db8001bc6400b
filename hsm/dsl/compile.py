"""From an outline to a model: states are numbered, names get a meaning, instances their copies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from lark import Token

from hsm.diagnostics import Diagnostic, Place, Related, Severity
from hsm.dsl import checks, syntax
from hsm.dsl.codes import Report
from hsm.dsl.instances import Graft, graft
from hsm.dsl.outline import HISTORY, Draft, Outline, outline
from hsm.dsl.properties import compile_properties
from hsm.dsl.subject import PSEUDO, Stay, Subject
from hsm.dsl.syntax import place_of
from hsm.dsl.typing import FUNCTIONS, Declared, Scope
from hsm.expressions import Expression, Literal
from hsm.model import (
    Action,
    ActivityCall,
    After,
    Assign,
    Call,
    Model,
    On,
    Raise,
    State,
    StateKind,
    Transition,
    TransitionKind,
    Trigger,
    Variable,
    When,
)
from hsm.registry import Library, Parameter
from hsm.types import Quantity

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

    tree: syntax.File
    model: Model | None
    subject: Subject
    diagnostics: tuple[Diagnostic, ...]
    events: frozenset[str] = frozenset()


def compile_file(
    tree: syntax.File, found: list[Diagnostic], library: Library, machines: Mapping[str, Unit | None]
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
    return _Compiler(tree, library, report, machines, plan, Scope(library, report)).run()


@dataclass(slots=True)
class _Compiler:
    """The work of one compilation, in the order of ``run``."""

    tree: syntax.File
    library: Library
    report: Report
    machines: Mapping[str, Unit | None]
    plan: Outline
    scope: Scope
    events: dict[str, Place | None] = field(default_factory=dict)
    parameters: list[Parameter] = field(default_factory=list)
    variables: list[Variable] = field(default_factory=list)
    transitions: list[Transition] = field(default_factory=list)
    unresolved: bool = False
    instantiated: set[str] = field(default_factory=set)
    heard: set[str] = field(default_factory=set)

    def run(self) -> Unit:
        """All stages."""
        self.scope.doubtful = self.plan.doubtful
        self._declare_variables()
        drafts = self.plan.all_states()
        for draft in drafts:
            self._find_machine(draft)
        for draft in drafts:
            self._request_histories(draft)
        order = self._number()
        self.scope.states = self._names_of_states(order)
        self._gather_events(order)
        stays: dict[int, tuple[Stay, ...]] = {}
        states: list[State] = []
        for draft in order:
            states.extend(self._states(draft))
            if draft.stays:
                stays[draft.index] = tuple(map(self._stay, draft.stays))
        model = self._model(states)
        subject = Subject(
            file=self.tree.name,
            model=model,
            stays=stays,
            doubtful=frozenset(self.plan.doubtful),
            unresolved=self.unresolved,
            broken=frozenset(draft.index for draft in order if draft.broken),
            opaque=frozenset(draft.index for draft in order if draft.opaque),
            unused=() if self.plan.doubtful else tuple(self._unused()),
        )
        self.report.found.extend(checks.errors(subject))
        failed = any(one.severity is Severity.ERROR for one in self.report.found)
        findings = tuple(self.report.found)
        return Unit(self.tree, None if failed else model, subject, findings, frozenset(self.events))

    def _model(self, states: list[State]) -> Model:
        heading = self.plan.heading
        files = [self.tree.name]
        for unit in self.machines.values():
            if unit is not None and unit.model is not None:
                files.extend(name for name in unit.model.files if name not in files)
        return Model(
            self.plan.root.name,
            tuple(states),
            tuple(self.transitions),
            tuple(self.variables),
            tuple(self.parameters),
            tuple(files),
            self.tree.comment_above(heading.name.line or 1) if heading is not None else "",
            compile_properties(
                (line for line in self.plan.root.lines if isinstance(line, syntax.PropertyLine)),
                self.tree.lines,
                self.scope,
                states,
            ),
        )

    # -- declarations at the top of the file

    def _declare_variables(self) -> None:
        for line in self.plan.root.lines:
            match line:
                case syntax.ParameterLine(name, type_name, default):
                    self._declare(name, type_name, default, constant=True)
                case syntax.VariableLine(name, type_name, initial):
                    self._declare(name, type_name, initial, constant=False)
                case syntax.EventLine(names):
                    self._declare_events(names)

    def _declare_events(self, names: tuple[Token, ...]) -> None:
        for name in names:
            place = place_of(self.tree.name, name)
            first = self.events.setdefault(str(name), place)
            if first is not None and first is not place:
                related = Related(first, "first declared here")
                self.report.add("E0209", place, f"event `{name}` is declared twice", related=(related,))

    def _declare(self, name: Token, type_name: Token, value: syntax.Expression | None, *, constant: bool) -> None:
        new = self.plan.declared.get(str(name)) is name
        if name in self.library.signals or name in FUNCTIONS or name in ("true", "false") or "." in name:
            self._add("E0211", name, f"`{name}` cannot name a variable: it means something else already")
            new = False
        kind = self.scope.type_named(type_name)
        initial = self.scope.value(value, kind) if kind is not None and value is not None else None
        if initial is not None and not isinstance(initial, Literal) and (constant or not self._is_constant(initial)):
            message = f"`{name}` begins with a value made of constants{'' if constant else ' and parameters'}"
            self.report.add("E0303", initial.place, message)
            initial = None
        if kind is None or not new:
            self.plan.doubtful.add(str(name))
            return
        place = place_of(self.tree.name, name)
        self.scope.variables[str(name)] = Declared(kind, constant, place)
        if not constant and initial is not None:
            self.variables.append(Variable(str(name), kind, initial, place=place))
        elif constant and isinstance(initial, Literal):
            self.parameters.append(Parameter(str(name), kind, initial.value))
        elif constant:
            self.parameters.append(Parameter(str(name), kind))

    def _is_constant(self, expression: Expression) -> bool:
        return self.scope.is_constant(expression)

    # -- numbering, with the copies of instances

    def _find_machine(self, draft: Draft) -> None:
        if draft.instance is None:
            return
        name = draft.instance.name
        draft.kind = StateKind.COMPOUND
        self.instantiated.add(str(name))
        unit = self.machines.get(str(name))
        draft.model = unit.model if unit is not None else None
        draft.opaque = draft.model is None
        if name not in self.machines and name not in self.plan.doubtful:
            hint = self.report.guess(name, self.machines).text or f"import it at the top of the file: `import {name}`"
            self._add("E0208", name, f"there is no machine `{name}`", hint)

    def _request_histories(self, draft: Draft) -> None:
        for line in draft.lines:
            if not isinstance(line, syntax.TransitionLine) or line.target is None:
                continue
            for target in line.target.names:
                owner_name, dot, suffix = target.rpartition(".")
                owner = self.plan.states.get(owner_name)
                if not dot or suffix not in HISTORY or owner is None:
                    continue
                if owner.kind in (StateKind.ATOMIC, StateKind.FINAL):
                    self._add("E0407", target, f"`{owner_name}` has no states inside, so it has no history")
                    self.unresolved = True
                elif HISTORY[suffix] not in owner.histories:
                    kind = HISTORY[suffix]
                    owner.histories[kind] = Draft(str(target), kind, owner, owner.token)

    def _number(self) -> list[Draft]:
        """All states in document order, numbered with the states of instances between them."""
        order: list[Draft] = []
        count = 0
        stack = [self.plan.root]
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
        names = set(self.plan.states)
        for draft in order:
            if draft.model is not None:
                names.update(f"{draft.name}.{state.name}" for state in draft.model.states[1:])
        return frozenset(names)

    # -- events

    def _gather_events(self, order: list[Draft]) -> None:
        """Which events each state may hear of: outcomes inside it, its final states, what is raised anywhere."""
        for draft in order:
            if draft.initial is not None:
                self._gather_raised(draft.initial.actions)
            for line in draft.lines:
                if isinstance(line, syntax.TransitionLine | syntax.EntryLine | syntax.ExitLine):
                    self._gather_raised(line.actions)
        for unit in self.machines.values():
            for name in unit.events if unit is not None else ():
                self.events.setdefault(name, None)
                self.heard.add(name)
        for draft in reversed(order):
            self._gather_outcomes(draft)
            if draft.parent is not None:
                draft.parent.reported |= draft.reported
                draft.parent.opaque |= draft.opaque

    def _gather_raised(self, actions: tuple[syntax.ActionSyntax, ...]) -> None:
        for action in actions:
            if isinstance(action, syntax.RaiseSyntax):
                self.events.setdefault(str(action.event), None)
                self.heard.add(str(action.event))

    def _gather_outcomes(self, draft: Draft) -> None:
        draft.completions.update(child.name for child in draft.children if child.kind is StateKind.FINAL)
        if draft.activity is not None:
            activity = self.library.activities.get(str(draft.activity.call.name))
            draft.reported.update(activity.outcomes if activity is not None else ())
            draft.opaque |= activity is None
        if draft.model is not None:
            states = draft.model.states
            finals = (states[child] for child in states[0].children)
            draft.completions.update(child.name for child in finals if child.kind is StateKind.FINAL)
            for state in states:
                draft.reported.update(state.activity.activity.outcomes if state.activity is not None else ())
        if draft.completions or draft.kind is StateKind.PARALLEL:
            draft.completions.add("done")

    # -- states

    def _states(self, draft: Draft) -> list[State]:
        """A state; with its copied states behind it where it is an instance."""
        if draft.model is None:
            if draft.instance is not None:
                self._gather_doubts(draft.instance)
            return [self._state(draft, None)]
        copied = graft(draft.model, draft.name, draft.index, len(self.transitions))
        self.transitions.extend(copied.transitions)
        self._bind(draft, draft.model, copied)
        return [self._state(draft, copied.root), *copied.states]

    def _gather_doubts(self, call: syntax.CallSyntax) -> None:
        """Look at the arguments of an instance whose machine is not known, so that what they name counts as used."""
        for argument in call.arguments:
            self.scope.expression(argument.value if isinstance(argument, syntax.Named) else argument)

    def _bind(self, draft: Draft, model: Model, copied: Graft) -> None:
        """The parameters of an instance become constants that its state's entry sets."""
        assert draft.instance is not None
        arguments = self.scope.arguments(draft.instance, model.parameters, f"machine `{draft.instance.name}`")
        if arguments is not None:
            place = place_of(self.tree.name, draft.instance.name, draft.instance.closing)
            for parameter, value in zip(model.parameters, arguments, strict=True):
                name = f"{draft.name}.{parameter.name}"
                self.variables.append(Variable(name, parameter.type, value, draft.index, constant=True, place=place))
        self.variables.extend(copied.variables)

    def _state(self, draft: Draft, machine: State | None) -> State:
        """A state; what an instance's machine says of its root comes first."""
        base = machine if machine is not None else State(draft.index, draft.name, draft.kind, -1)
        numbers, entry, exits = list(base.transitions), list(base.entry), list(base.exit)
        for line in draft.lines:
            match line:
                case syntax.TransitionLine():
                    transition = self._transition(draft, line)
                    if transition is not None:
                        numbers.append(transition.index)
                        self.transitions.append(transition)
                case syntax.EntryLine(actions):
                    entry.extend(self._actions(actions))
                case syntax.ExitLine(actions):
                    exits.extend(self._actions(actions))
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
            activity=base.activity if machine else self._activity(draft),
            transitions=tuple(numbers),
            instance=str(draft.instance.name) if draft.instance is not None else None,
            doc=self.tree.comment_above(token.line or 1) if token is not None and nested else "",
            place=place_of(self.tree.name, token) if token is not None else None,
        )

    def _initial(self, draft: Draft) -> tuple[tuple[int, ...], tuple[Action, ...]]:
        if draft.kind in PSEUDO:
            assert draft.parent is not None
            return self._default_of(draft.parent), ()
        if draft.initial is None:
            return self._default_of(draft), ()
        target = self._named_state(draft.initial.target)
        actions = self._actions(draft.initial.actions)
        if target is not None and (target is draft or draft not in target.ancestors()):
            self._add("E0405", draft.initial.target, f"`{target.name}` does not lie in `{draft.name}`")
            target = None
        return (target.index,) if target is not None else (), actions

    def _default_of(self, draft: Draft) -> tuple[int, ...]:
        """What a state's entry enters where no history says otherwise."""
        if draft.model is not None:
            return tuple(draft.index + one for one in draft.model.states[0].initial)
        if draft.kind is StateKind.PARALLEL:
            return tuple(child.index for child in draft.children)
        if draft.initial is not None:
            target = self.plan.states.get(str(draft.initial.target))
            return (target.index,) if target is not None else ()
        return tuple(child.index for child in draft.children[:1])

    def _activity(self, draft: Draft) -> ActivityCall | None:
        if draft.activity is None:
            return None
        call = draft.activity.call
        declared = self.library.activities.get(str(call.name))
        if declared is None:
            if call.name not in self.plan.doubtful:
                hint = self.report.guess(call.name, self.library.activities).text
                self._add("E0204", call.name, f"there is no activity `{call.name}`", hint)
            self._gather_doubts(call)
            return None
        arguments = self.scope.arguments(call, declared.parameters, f"activity `{call.name}`")
        if arguments is None:
            return None
        return ActivityCall(declared, arguments, place_of(self.tree.name, call.name, call.closing))

    def _stay(self, line: syntax.StayLine) -> Stay:
        condition = self.scope.condition(line.condition) if line.condition is not None else None
        last = syntax.last_token(line.condition) if line.condition is not None else None
        return Stay(condition, place_of(self.tree.name, line.keyword, last), always=line.condition is None)

    # -- transitions

    def _transition(self, draft: Draft, line: syntax.TransitionLine) -> Transition | None:
        trigger = self._trigger(draft, line)
        guard = self.scope.condition(line.guard) if line.guard is not None else None
        actions = self._actions(line.actions)
        kind = TransitionKind.INTERNAL
        targets: tuple[int, ...] = ()
        if line.target is not None:
            kind = TransitionKind.LOCAL if line.target.arrow == "->" else TransitionKind.EXTERNAL
            targets = self._targets(line.target)
            kind = kind if targets else TransitionKind.INTERNAL
        elif not line.actions:
            hint = "say where it goes: `-> state`, or what it does: `/ action`"
            self._add("E0404", line.keyword, "this transition goes nowhere and does nothing", hint)
        if trigger is None or (line.guard is not None and guard is None):
            self.unresolved |= trigger is None and not targets
        if trigger is None:
            trigger = On(())
        place = place_of(self.tree.name, line.keyword, _last_token(line))
        return Transition(len(self.transitions), draft.index, targets, trigger, guard, actions, kind, place)

    def _trigger(self, draft: Draft, line: syntax.TransitionLine) -> Trigger | None:
        if line.operand is None:
            return On(tuple(self._event(draft, name) for name in line.names))
        if line.keyword == "when":
            condition = self.scope.condition(line.operand)
            return None if condition is None else When(condition)
        duration = self.scope.value(line.operand, _DURATION)
        return None if duration is None else After(duration)

    def _event(self, draft: Draft, token: Token) -> str:
        """The name of an event; of a misspelt one the name that was probably meant."""
        name = str(token)
        self.heard.add(name)
        sources = (self.library.events, self.events, draft.completions, draft.reported, ("fault",))
        if any(name in source for source in sources) or name in self.plan.doubtful or draft.opaque:
            return name
        known = [one for source in sources for one in source]
        hint = self.report.guess(name, known)
        self._add("E0203", token, f"nothing sends, raises or reports `{name}` in `{draft.name}`", hint.text)
        return hint.name or name

    def _targets(self, target: syntax.TargetSyntax) -> tuple[int, ...]:
        known: list[Draft] = []
        for name in target.names:
            draft = self._named_state(name)
            if draft is None:
                continue
            clash = next((other for other in known if not _orthogonal(draft, other)), None)
            if clash is not None:
                self._add("E0406", name, f"`{clash.name}` and `{draft.name}` cannot be active together")
                continue
            known.append(draft)
        return tuple(one.index for one in known)

    def _named_state(self, name: Token) -> Draft | None:
        """The state with a name; of a misspelt one the state that was probably meant."""
        found = self.plan.states.get(str(name))
        if found is not None:
            return found
        owner, dot, suffix = name.rpartition(".")
        if dot and owner in self.plan.states and suffix in HISTORY:
            return self.plan.states[owner].histories.get(HISTORY[suffix])
        if name in self.plan.doubtful or owner in self.plan.doubtful:
            self.unresolved = True
            return None
        if dot and owner in self.plan.states:
            hint = f"go to `{owner}`, or to `{owner}.history`"
            self._add("E0201", name, f"a state inside `{owner}` cannot be entered by this name", hint)
            return self.plan.states[owner]
        close = self.report.guess(name, self.plan.states)
        self._add("E0201", name, f"there is no state `{name}`", close.text)
        self.unresolved |= close.name is None
        return self.plan.states.get(close.name or "")

    # -- actions

    def _actions(self, lines: tuple[syntax.ActionSyntax, ...]) -> tuple[Action, ...]:
        actions = [self._action(line) for line in lines]
        return tuple(one for one in actions if one is not None)

    def _action(self, line: syntax.ActionSyntax) -> Action | None:
        match line:
            case syntax.RaiseSyntax(event):
                return Raise(str(event), place_of(self.tree.name, event))
            case syntax.AssignSyntax():
                return self._assignment(line)
            case syntax.CallSyntax(name):
                declared = self.library.actions.get(str(name))
                if declared is None:
                    if name not in self.plan.doubtful:
                        hint = self.report.guess(name, self.library.actions).text
                        if name.value in self.library.activities:
                            hint = f"`{name}` is an activity: it takes time, and stands behind `do`"
                        self._add("E0205", name, f"there is no action `{name}`", hint)
                    self._gather_doubts(line)
                    return None
                arguments = self.scope.arguments(line, declared.parameters, f"action `{name}`")
                if arguments is None:
                    return None
                return Call(declared, arguments, place_of(self.tree.name, name, line.closing))

    def _assignment(self, line: syntax.AssignSyntax) -> Assign | None:
        name = line.variable
        declared = self.scope.variables.get(str(name))
        if declared is None:
            if name not in self.plan.doubtful:
                close = self.report.guess(name, self.scope.variables)
                self._add("E0202", name, f"there is no variable `{name}`", close.text)
            self.scope.expression(line.value)
            return None
        if declared.constant:
            message, hint = f"`{name}` is a parameter: it keeps its value", f"declare it with `var {name}`"
            related = Related(declared.place, "declared here")
            self.report.add("E0304", place_of(self.tree.name, name), message, hint, (related,))
            return None
        was_used = name in self.scope.used
        node = line.value
        if line.operator != "=":
            operator = Token.new_borrow_pos("OPERATOR", line.operator[0], line.operator)
            node = syntax.Binary(operator, name, node, 1 + syntax.depth_of(node))
        value = self.scope.value(node, declared.type)
        if not was_used and line.operator != "=":
            self.scope.used.discard(str(name))
        return None if value is None else Assign(str(name), value, place_of(self.tree.name, name, line.operator))

    # -- reporting

    def _unused(self) -> list[tuple[str, str, Place]]:
        """Kind, name and place of everything that is declared and never used."""
        found: list[tuple[str, str, Place]] = []
        for name, token in self.plan.imports.items():
            if name not in self.instantiated and self.machines.get(name) is not None:
                found.append(("import", name, place_of(self.tree.name, token)))
        for name, declared in self.scope.variables.items():
            if name not in self.scope.used:
                found.append(("parameter" if declared.constant else "variable", name, declared.place))
        for name, place in self.events.items():
            if place is not None and name not in self.heard:
                found.append(("event", name, place))
        return found

    def _add(self, code: str, token: Token, message: str, suggestion: str | None = None) -> None:
        self.report.add(code, place_of(self.tree.name, token), message, suggestion)


def _last_token(line: syntax.TransitionLine) -> Token:
    """The last token of a transition's trigger, guard and target."""
    if line.target is not None:
        return line.target.names[-1]
    if line.guard is not None:
        return syntax.last_token(line.guard)
    if line.operand is not None:
        return syntax.last_token(line.operand)
    return line.names[-1]


def _orthogonal(one: Draft, other: Draft) -> bool:
    """Whether two states lie in different regions of a parallel state."""
    above = list(other.ancestors())
    common = next((state for state in one.ancestors() if state in above), None)
    return common is not None and common.kind is StateKind.PARALLEL and common not in (one, other)
