"""From a syntax tree to a model: states get their places in the tree, names their meaning, instances their copies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from lark import Token

from hsm.diagnostics import Diagnostic, Related
from hsm.dsl import syntax
from hsm.dsl.codes import Report, did_you_mean
from hsm.dsl.instances import Graft, graft
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

HISTORY = {"history": StateKind.SHALLOW_HISTORY, "deep_history": StateKind.DEEP_HISTORY}
"""How the history of a state is named behind the state's own name."""

_DURATION = Quantity(time=1)


@dataclass(frozen=True, slots=True)
class Unit:
    """One file, compiled on its own.

    Attributes:
        name: the file's name.
        tree: its syntax tree.
        model: the machine; None where there are errors.
        diagnostics: what was found in this file.
        events: events that it declares or raises.
    """

    name: str
    tree: syntax.File
    model: Model | None
    diagnostics: tuple[Diagnostic, ...]
    events: frozenset[str] = frozenset()


@dataclass(slots=True, eq=False)
class _Draft:
    """A state while its model is being built."""

    name: str
    kind: StateKind
    parent: _Draft | None
    token: Token | None = None
    children: list[_Draft] = field(default_factory=list)
    histories: dict[StateKind, _Draft] = field(default_factory=dict)
    lines: list[syntax.Item] = field(default_factory=list)
    initial: syntax.InitialLine | None = None
    activity: syntax.DoLine | None = None
    instance: syntax.CallSyntax | None = None
    machine: Unit | None = None
    outcomes: set[str] = field(default_factory=set)
    index: int = -1
    last: int = -1

    def ancestors(self) -> Iterator[_Draft]:
        """The state and all that it lies in, innermost first."""
        found: _Draft | None = self
        while found is not None:
            yield found
            found = found.parent


def compile_file(
    tree: syntax.File, syntax_findings: list[Diagnostic], library: Library, machines: Mapping[str, Unit | None]
) -> Unit:
    """Build a machine from its syntax tree.

    Args:
        tree: the file as read.
        syntax_findings: what the parser found; with an error among it no model is built.
        library: the registry.
        machines: what the file imports, by name; None for one that cannot be had.
    """
    report = Report(tree.name, syntax_findings)
    return _Compiler(tree, library, report, machines).run()


class _Compiler:
    """The work of one compilation, in the order of ``run``."""

    def __init__(
        self, tree: syntax.File, library: Library, report: Report, machines: Mapping[str, Unit | None]
    ) -> None:
        self.tree = tree
        self.library = library
        self.report = report
        self.machines = machines
        self.scope = Scope(library, report)
        self.root = _Draft("", StateKind.COMPOUND, None)
        self.states: dict[str, _Draft] = {}
        self.declared: dict[str, Token] = {}
        self.events: dict[str, Token] = {}
        self.parameters: list[Parameter] = []
        self.variables: list[Variable] = []
        self.initials: list[tuple[_Draft, Expression, Token]] = []
        self.doubtful: set[str] = set()
        self.heading: syntax.MachineLine | None = None

    def run(self) -> Unit:
        """All stages."""
        self._collect()
        self._heading()
        self.scope.doubtful = self.doubtful
        self._declare_variables()
        order = self._number()
        self.scope.states = self._names_of_states(order)
        self._gather_events(order)
        model = self._model(order)
        failed = any(one.code.startswith("E") for one in self.report.found)
        findings = tuple(self.report.found)
        return Unit(self.tree.name, self.tree, None if failed else model, findings, frozenset(self.events))

    # -- the tree of states

    def _collect(self) -> None:
        stack: list[tuple[_Draft, Iterator[syntax.Item]]] = [(self.root, iter(self.tree.items))]
        while stack:
            draft, items = stack[-1]
            for item in items:
                inner = self._take(draft, item)
                if inner is not None:
                    stack.append(inner)
                    break
            else:
                stack.pop()
        for draft in [self.root, *self.states.values()]:
            if draft.kind is StateKind.PARALLEL and len(draft.children) < 2:
                self._add("E0408", draft.token, f"parallel state `{draft.name}` has fewer than two states inside")

    def _take(  # noqa: PLR0912
        self, draft: _Draft, item: syntax.Item
    ) -> tuple[_Draft, Iterator[syntax.Item]] | None:
        """Note one line; a block is returned to be walked next."""
        match item:
            case syntax.BadLine(names, items):
                self.doubtful |= names
                return _Draft("", StateKind.COMPOUND, draft), iter(items)
            case syntax.StateBlock(name, parallel, instance, items):
                if draft.instance is not None:
                    self._add("E0402", name, "an instance of a machine has no states of its own here")
                kind = StateKind.PARALLEL if parallel else StateKind.ATOMIC
                inner = self._new_state(draft, name, kind)
                inner.instance = instance
                return inner, iter(items)
            case syntax.FinalLine(name):
                if draft.kind is StateKind.PARALLEL or draft.instance is not None:
                    self._add("E0402", name, "a final state lies in a machine or in a state that is not parallel")
                self._new_state(draft, name, StateKind.FINAL)
            case syntax.InitialLine(target):
                if draft.kind is StateKind.PARALLEL or draft.instance is not None:
                    self._add("E0402", target, "all regions of a parallel state are entered: it has no `initial`")
                elif draft.initial is not None:
                    self._second("initial", target, draft.initial.target)
                draft.initial = item
            case syntax.DoLine(call):
                if draft.instance is not None:
                    self._add("E0402", call.name, "an instance of a machine does what that machine does")
                elif draft.activity is not None:
                    self._second("do", call.name, draft.activity.call.name)
                draft.activity = item
            case syntax.MachineLine():
                if draft is self.root and self.heading is None and item is self.tree.items[0]:
                    self.heading = item
                elif self.heading is not None:
                    self._second("machine", item.name, self.heading.name)
                else:
                    self._add("E0402", item.name, "the line `machine` is the first of its file")
                    self.heading = item
            case syntax.TransitionLine() | syntax.EntryLine() | syntax.ExitLine():
                draft.lines.append(item)
            case syntax.ImportLine(name) | syntax.ParameterLine(name) | syntax.VariableLine(name):
                self._declaration(draft, item, name)
            case syntax.EventLine(names):
                self._declaration(draft, item, names[0])
        return None

    def _declaration(self, draft: _Draft, item: syntax.Item, name: Token) -> None:
        if draft is self.root:
            draft.lines.append(item)
        else:
            self._add("E0402", name, "this is declared at the top of the file, not in a state")

    def _new_state(self, parent: _Draft, name: Token, kind: StateKind) -> _Draft:
        draft = _Draft(str(name), kind, parent, name)
        if "." in name:
            self._add("E0211", name, f"`{name}` cannot name a state: a name that is declared has no dot")
        elif self._is_new(name):
            self.states[draft.name] = draft
        if parent.kind is StateKind.ATOMIC:
            parent.kind = StateKind.COMPOUND
        parent.children.append(draft)
        return draft

    def _is_new(self, name: Token) -> bool:
        first = self.declared.setdefault(str(name), name)
        if first is name:
            return True
        related = Related(place_of(self.tree.name, first), "first declared here")
        self.report.add("E0209", place_of(self.tree.name, name), f"`{name}` is declared twice", related=(related,))
        return False

    def _heading(self) -> None:
        if self.heading is None:
            if not self.doubtful:
                first = Token("NAME", "", 0, 1, 1, 1, 2)
                self._add("E0401", first, "the first line is to be `machine`, with a name")
            return
        self.root.name = str(self.heading.name)
        self.root.token = self.heading.name
        if "." in self.heading.name:
            self._add("E0211", self.heading.name, "the name of a machine has no dot")
        elif self.root.name in self.states:
            self._add("E0209", self.states[self.root.name].token, f"`{self.root.name}` names the machine itself")
        if not self.root.children and not self.doubtful:
            self._add("E0409", self.heading.name, f"machine `{self.root.name}` has no state")

    # -- declarations at the top of the file

    def _declare_variables(self) -> None:
        for line in self.root.lines:
            match line:
                case syntax.ParameterLine(name, type_name, default):
                    self._declare(name, type_name, default, constant=True)
                case syntax.VariableLine(name, type_name, initial):
                    self._declare(name, type_name, initial, constant=False)
                case syntax.EventLine(names):
                    for name in names:
                        if name in self.events:
                            self._second(f"event {name}", name, self.events[name])
                        self.events[str(name)] = name

    def _declare(self, name: Token, type_name: Token, value: syntax.Expression | None, *, constant: bool) -> None:
        new = self._is_new(name)
        if name in self.library.signals or name in FUNCTIONS or name in ("true", "false") or "." in name:
            self._add("E0211", name, f"`{name}` cannot name a variable: it means something else already")
            new = False
        kind = self.scope.type_named(type_name)
        initial = self.scope.value(value, kind) if kind is not None and value is not None else None
        if initial is not None and not isinstance(initial, Literal):
            message = f"the value of `{name}` is to be a constant" if constant else None
            if constant or not self.scope.is_constant(initial):
                message = message or f"`{name}` can begin with constants and parameters only"
                self.report.add("E0303", initial.place, message)
                return
        if kind is None or not new:
            self.doubtful.add(str(name))
            return
        place = place_of(self.tree.name, name)
        self.scope.variables[str(name)] = Declared(kind, constant, place)
        if not constant and initial is not None:
            self.variables.append(Variable(str(name), kind, initial, place=place))
        elif constant and value is None:
            self.parameters.append(Parameter(str(name), kind))
        elif constant and isinstance(initial, Literal):
            self.parameters.append(Parameter(str(name), kind, initial.value))

    # -- numbering, with the copies of instances

    def _number(self) -> list[_Draft]:
        """Finds the machines of instances, adds the history states that are asked for, numbers all in order."""
        for draft in self.states.values():
            if draft.instance is not None:
                self._instantiate(draft)
            for line in draft.lines:
                self._request_history(line)
        for line in self.root.lines:
            self._request_history(line)
        order: list[_Draft] = []
        count = 0
        stack = [self.root]
        while stack:
            draft = stack.pop()
            draft.index = count
            copied = draft.machine.model if draft.machine is not None else None
            count += 1 if copied is None else len(copied.states)
            order.append(draft)
            stack.extend(reversed([*draft.children, *draft.histories.values()]))
        for draft in reversed(order):
            inner = [*draft.children, *draft.histories.values()]
            copied = draft.machine.model if draft.machine is not None else None
            draft.last = inner[-1].last if inner else draft.index + (len(copied.states) - 1 if copied else 0)
        return order

    def _instantiate(self, draft: _Draft) -> None:
        assert draft.instance is not None
        draft.kind = StateKind.COMPOUND
        name = draft.instance.name
        if name in self.machines:
            draft.machine = self.machines[str(name)]
            if draft.machine is None or draft.machine.model is None:
                draft.machine = None
        elif name not in self.doubtful:
            hint = did_you_mean(name, self.machines) or f"import it at the top of the file: `import {name}`"
            self._add("E0208", name, f"there is no machine `{name}`", hint)

    def _request_history(self, line: syntax.Item) -> None:
        if not isinstance(line, syntax.TransitionLine) or line.target is None:
            return
        for target in line.target.names:
            owner, dot, suffix = target.rpartition(".")
            draft = self.states.get(owner)
            if not dot or suffix not in HISTORY or draft is None:
                continue
            if draft.kind in (StateKind.ATOMIC, StateKind.FINAL):
                self._add("E0407", target, f"`{owner}` has no states inside, so it has no history")
                continue
            kind = HISTORY[suffix]
            if kind not in draft.histories:
                draft.histories[kind] = _Draft(str(target), kind, draft, target)

    def _names_of_states(self, order: list[_Draft]) -> frozenset[str]:
        names = set(self.states)
        for draft in order:
            if draft.machine is not None and draft.machine.model is not None:
                names.update(f"{draft.name}.{state.name}" for state in draft.machine.model.states[1:])
        return frozenset(names)

    # -- events

    def _gather_events(self, order: list[_Draft]) -> None:
        """Which events each state may hear of: outcomes inside it, its final states, what is raised anywhere."""
        for draft in order:
            for line in draft.lines:
                self._gather_raised(line)
            if draft.initial is not None:
                self._raised(draft.initial.actions)
            if draft.machine is not None:
                for name in draft.machine.events:
                    self.events.setdefault(name, Token("NAME", name))
        for draft in reversed(order):
            own = self._outcomes(draft)
            draft.outcomes |= own
            if draft.parent is not None:
                heard = draft.outcomes - {one.name for one in draft.children if one.kind is StateKind.FINAL}
                draft.parent.outcomes |= heard

    def _gather_raised(self, line: syntax.Item) -> None:
        if isinstance(line, syntax.TransitionLine | syntax.EntryLine | syntax.ExitLine):
            self._raised(line.actions)

    def _raised(self, actions: tuple[syntax.ActionSyntax, ...]) -> None:
        for action in actions:
            if isinstance(action, syntax.RaiseSyntax):
                self.events.setdefault(str(action.event), action.event)

    def _outcomes(self, draft: _Draft) -> set[str]:
        found = {child.name for child in draft.children if child.kind is StateKind.FINAL}
        if found or draft.kind is StateKind.PARALLEL or draft.instance is not None:
            found.add("done")
        if draft.activity is not None:
            activity = self.library.activities.get(str(draft.activity.call.name))
            found.update(activity.outcomes if activity is not None else ())
        if draft.machine is not None and draft.machine.model is not None:
            states = draft.machine.model.states
            found.update(states[child].name for child in states[0].children if states[child].kind is StateKind.FINAL)
        return found

    # -- the model

    def _model(self, order: list[_Draft]) -> Model:
        states: list[State] = []
        transitions: list[Transition] = []
        for draft in order:
            copied: Graft | None = None
            if draft.machine is not None and draft.machine.model is not None:
                copied = graft(draft.machine.model, draft.name, draft.index, len(transitions))
                transitions.extend(copied.transitions)
                self._bind(draft, draft.machine.model, copied)
            elif draft.instance is not None:
                self.doubtful.add(draft.name)
            states.append(self._state(draft, transitions, copied))
            if copied is not None:
                states.extend(copied.states)
        doc = ""
        if self.heading is not None:
            doc = self.tree.comment_above(self.heading.name.line or 1)
        files = [self.tree.name]
        for unit in self.machines.values():
            if unit is not None and unit.model is not None:
                files.extend(name for name in unit.model.files if name not in files)
        return Model(
            self.root.name,
            tuple(states),
            tuple(transitions),
            tuple(self.variables),
            tuple(self.parameters),
            tuple(files),
            doc,
        )

    def _bind(self, draft: _Draft, model: Model, copied: Graft) -> None:
        """The parameters of an instance become constants that its state's entry sets."""
        assert draft.instance is not None
        subject = f"machine `{draft.instance.name}`"
        arguments = self.scope.arguments(draft.instance, model.parameters, subject)
        if arguments is None:
            return
        place = place_of(self.tree.name, draft.instance.name, draft.instance.closing)
        for parameter, value in zip(model.parameters, arguments, strict=True):
            name = f"{draft.name}.{parameter.name}"
            self.variables.append(Variable(name, parameter.type, value, draft.index, constant=True, place=place))
        self.variables.extend(copied.variables)

    def _state(self, draft: _Draft, transitions: list[Transition], copied: Graft | None) -> State:
        numbers: list[int] = list(copied.root.transitions) if copied is not None else []
        entry: list[Action] = list(copied.root.entry) if copied is not None else []
        exit_: list[Action] = list(copied.root.exit) if copied is not None else []
        for line in draft.lines:
            match line:
                case syntax.TransitionLine():
                    transition = self._transition(draft, line, len(transitions))
                    if transition is not None:
                        numbers.append(transition.index)
                        transitions.append(transition)
                case syntax.EntryLine(actions):
                    entry.extend(self._actions(actions))
                case syntax.ExitLine(actions):
                    exit_.extend(self._actions(actions))
        children = [one.index for one in (*draft.children, *draft.histories.values())]
        initial, initial_actions = self._initial(draft)
        activity = self._activity(draft)
        if copied is not None:
            root = copied.root
            children = [*root.children, *children]
            initial, initial_actions, activity = root.initial, root.initial_actions, root.activity
            if draft.kind in (StateKind.SHALLOW_HISTORY, StateKind.DEEP_HISTORY):
                initial = root.initial
        token = draft.token
        return State(
            draft.index,
            draft.name,
            draft.kind,
            draft.parent.index if draft.parent is not None else -1,
            tuple(children),
            draft.last,
            initial,
            initial_actions,
            tuple(entry),
            tuple(exit_),
            activity,
            tuple(numbers),
            str(draft.instance.name) if draft.instance is not None else None,
            self.tree.comment_above(token.line or 1) if token is not None and draft.parent is not None else "",
            place_of(self.tree.name, token) if token is not None else None,
        )

    def _initial(self, draft: _Draft) -> tuple[tuple[int, ...], tuple[Action, ...]]:
        if draft.kind in (StateKind.SHALLOW_HISTORY, StateKind.DEEP_HISTORY):
            assert draft.parent is not None
            owner = draft.parent
            if owner.kind is StateKind.PARALLEL:
                return tuple(child.index for child in owner.children), ()
            if owner.machine is not None and owner.machine.model is not None:
                return tuple(owner.index + one for one in owner.machine.model.states[0].initial), ()
            return self._initial(owner)[0], ()
        line = draft.initial
        if line is None or draft.kind is StateKind.PARALLEL:
            first = draft.children[:1] if draft.kind is StateKind.COMPOUND else []
            return tuple(child.index for child in first), ()
        target = self._named_state(line.target)
        if target is None:
            return (), ()
        if draft not in list(target.ancestors())[1:]:
            message = f"`{target.name}` does not lie in `{draft.name}`"
            self._add("E0405", line.target, message)
            return (), ()
        return (target.index,), self._actions(line.actions)

    def _activity(self, draft: _Draft) -> ActivityCall | None:
        if draft.activity is None:
            return None
        call = draft.activity.call
        declared = self.library.activities.get(str(call.name))
        if declared is None:
            if call.name not in self.doubtful:
                hint = did_you_mean(call.name, self.library.activities)
                self._add("E0204", call.name, f"there is no activity `{call.name}`", hint)
            return None
        arguments = self.scope.arguments(call, declared.parameters, f"activity `{call.name}`")
        if arguments is None:
            return None
        return ActivityCall(declared, arguments, place_of(self.tree.name, call.name, call.closing))

    def _transition(self, draft: _Draft, line: syntax.TransitionLine, index: int) -> Transition | None:
        trigger = self._trigger(draft, line)
        guard = self.scope.condition(line.guard) if line.guard is not None else None
        actions = self._actions(line.actions)
        kind = TransitionKind.INTERNAL
        targets: tuple[int, ...] = ()
        if line.target is not None:
            kind = TransitionKind.LOCAL if line.target.arrow == "->" else TransitionKind.EXTERNAL
            targets = self._targets(line.target)
        elif not line.actions:
            hint = "say where it goes: `-> state`, or what it does: `/ action`"
            self._add("E0404", line.keyword, "this transition goes nowhere and does nothing", hint)
        if trigger is None:
            return None
        place = place_of(self.tree.name, line.keyword, self._last(line))
        return Transition(index, draft.index, targets, trigger, guard, actions, kind, place)

    def _last(self, line: syntax.TransitionLine) -> Token:
        """The last token of a transition's trigger, guard and target."""
        if line.target is not None:
            return line.target.names[-1]
        if line.guard is not None:
            return syntax.last_token(line.guard)
        if line.operand is not None:
            return syntax.last_token(line.operand)
        return line.names[-1]

    def _trigger(self, draft: _Draft, line: syntax.TransitionLine) -> Trigger | None:
        if line.operand is None:
            for name in line.names:
                self._check_event(draft, name)
            return On(tuple(map(str, line.names)))
        if line.keyword == "when":
            condition = self.scope.condition(line.operand)
            return None if condition is None else When(condition)
        duration = self.scope.value(line.operand, _DURATION)
        return None if duration is None else After(duration)

    def _check_event(self, draft: _Draft, name: Token) -> None:
        known = {*self.library.events, *self.events, *draft.outcomes, "fault"}
        if name in known or name in self.doubtful or self._has_unknown_outcomes(draft):
            return
        hint = did_you_mean(name, known)
        self._add("E0203", name, f"nothing sends, raises or reports `{name}` to `{draft.name}`", hint)

    def _has_unknown_outcomes(self, draft: _Draft) -> bool:
        """Whether something inside cannot be compiled, so that its outcomes are not known."""
        for one in self.states.values():
            opaque = (one.instance is not None and one.machine is None) or (
                one.activity is not None and one.activity.call.name not in self.library.activities
            )
            if opaque and draft in one.ancestors():
                return True
        return False

    def _targets(self, target: syntax.TargetSyntax) -> tuple[int, ...]:
        drafts = [self._named_state(name) for name in target.names]
        known = [one for one in drafts if one is not None]
        for position, one in enumerate(known):
            for other in known[:position]:
                if not _orthogonal(one, other):
                    message = f"`{other.name}` and `{one.name}` cannot be active together"
                    self._add("E0406", target.names[position], message)
        return tuple(one.index for one in known)

    def _named_state(self, name: Token) -> _Draft | None:
        found = self.states.get(str(name))
        if found is not None:
            return found
        owner, dot, suffix = name.rpartition(".")
        if dot and owner in self.states and suffix in HISTORY:
            return self.states[owner].histories.get(HISTORY[suffix])
        if name in self.doubtful or owner in self.doubtful:
            return None
        if owner in self.states:
            hint = f"go to `{owner}`, or to `{owner}.history`"
            self._add("E0201", name, f"a state inside `{owner}` cannot be entered by this name", hint)
            return None
        self._add("E0201", name, f"there is no state `{name}`", did_you_mean(name, self.states))
        return None

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
                    if name not in self.doubtful:
                        hint = did_you_mean(name, self.library.actions)
                        self._add("E0205", name, f"there is no action `{name}`", hint)
                    return None
                arguments = self.scope.arguments(line, declared.parameters, f"action `{name}`")
                if arguments is None:
                    return None
                return Call(declared, arguments, place_of(self.tree.name, name, line.closing))

    def _assignment(self, line: syntax.AssignSyntax) -> Assign | None:
        name = line.variable
        declared = self.scope.variables.get(str(name))
        if declared is None:
            if name not in self.doubtful:
                hint = did_you_mean(name, self.scope.variables)
                self._add("E0202", name, f"there is no variable `{name}`", hint)
            return None
        if declared.constant:
            related = Related(declared.place, "declared here as a parameter")
            self.report.add(
                "E0304",
                place_of(self.tree.name, name),
                f"`{name}` is a parameter: it keeps its value",
                "declare it with `var`",
                (related,),
            )
            return None
        node = line.value
        if line.operator != "=":
            operator = Token.new_borrow_pos("OPERATOR", line.operator[0], line.operator)
            node = syntax.Binary(operator, name, node, 1 + syntax.depth_of(node))
        value = self.scope.value(node, declared.type)
        return None if value is None else Assign(str(name), value, place_of(self.tree.name, name, line.operator))

    # -- reporting

    def _add(self, code: str, token: Token | None, message: str, suggestion: str | None = None) -> None:
        place = place_of(self.tree.name, token) if token is not None else None
        self.report.add(code, place, message, suggestion)

    def _second(self, what: str, token: Token, first: Token) -> None:
        related = Related(place_of(self.tree.name, first), "the first is here")
        self.report.add("E0403", place_of(self.tree.name, token), f"a second `{what}`", related=(related,))


def _orthogonal(one: _Draft, other: _Draft) -> bool:
    """Whether two states lie in different regions of a parallel state."""
    above = list(other.ancestors())
    common = next((state for state in one.ancestors() if state in above), None)
    return common is not None and common.kind is StateKind.PARALLEL and common not in (one, other)
