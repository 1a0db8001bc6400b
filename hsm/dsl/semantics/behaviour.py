"""Activities, transitions and actions of states, with every name resolved."""

from __future__ import annotations

from dataclasses import field

from hsm.dsl.semantics.analysis import Stay
from hsm.dsl.semantics.context import Context
from hsm.dsl.semantics.declarations import Declarations
from hsm.dsl.semantics.names import Names
from hsm.dsl.semantics.symbols import HISTORY, StateSymbol
from hsm.dsl.syntax import ast
from hsm.dsl.syntax.tokens import Token
from hsm.engine.clock import nanoseconds
from hsm.model.chart import (
    Action,
    ActivityCall,
    After,
    Assign,
    Call,
    Cancel,
    Defer,
    Else,
    Emit,
    Every,
    Held,
    On,
    Raise,
    Send,
    StateKind,
    Transition,
    TransitionKind,
    Trigger,
    When,
)
from hsm.model.diagnostics import Related
from hsm.model.expressions import Binary, Expression, Literal, Unary
from hsm.model.registry import Choosy, Parameter
from hsm.model.types import BOOLEAN
from hsm.model.values import dataclass

_NO_STATES = {
    "self": "write the name of the state: a transition to the state itself leaves and enters it",
    **dict.fromkeys(("null", "None", "none", "nil"), "a transition that leaves no state has no target: `on go / ...`"),
    "end": "declare it: `final end`",
}
"""Words of other languages that name no state here, each with a suggestion."""


@dataclass(slots=True)
class Behaviour:
    """Analyses the lines of states.

    Attributes:
        context: what all stages share.
        declarations: the file's events.
        transitions: the machine's transitions so far.
        uncertain: those of which something is not known, by index.
        performed: the activities that states do.
    """

    context: Context
    declarations: Declarations
    transitions: list[Transition] = field(default_factory=list)
    uncertain: set[int] = field(default_factory=set)
    _tables: dict[int, list[Expression | None]] = field(default_factory=dict)
    performed: Names = field(default_factory=Names)

    def activity(self, symbol: StateSymbol) -> ActivityCall | None:
        """What a state does; None where that is nothing, or invalid."""
        if symbol.activity is None:
            return None
        found = self._activity(symbol.activity.call)
        if found is None:
            self.performed.add_unknown()
        return found

    def _activity(self, call: ast.CallSyntax) -> ActivityCall | None:
        activities = self.context.library.activities
        declared = activities.get(str(call.name))
        if declared is None:
            self._unknown_activity(call)
            return None
        arguments = self.context.scope.arguments(call, declared.parameters, f"activity `{call.name}`")
        if arguments is None:
            return None
        place = self.context.place(call.name, call.closing)
        if isinstance(declared.factory, Choosy):
            named = zip(declared.parameters, arguments, strict=True)
            known = {one.name: value.value for one, value in named if isinstance(value, Literal)}
            reason = declared.factory.refuses(**known)
            if reason:
                self.context.report.add("E0214", place, f"activity `{call.name}`: {reason}")
        return ActivityCall(declared, arguments, place)

    def _unknown_activity(self, call: ast.CallSyntax) -> None:
        """Report an unknown activity; check its arguments against the activity that was probably meant."""
        activities = self.context.library.activities
        guess = self.context.report.guess(call.name, activities)
        if call.name not in self.context.symbols.doubtful.known:
            hint = guess.text
            if call.name.value in self.context.library.actions:
                hint = f"`{call.name}` is an action, which takes no time: write it after a slash"
            if call.name.value in ("wait", "sleep", "delay"):
                hint = "wait in a state that a time-out leaves: `after 3 s -> ...`"
            hint = hint or "`maze-machine list activities` lists them"
            self.context.add_once("E0204", call.name, f"there is no activity `{call.name}`", hint)
        if guess.name is None:
            self.look_at(call)
        else:
            self.context.scope.arguments(call, activities[guess.name].parameters, f"activity `{guess.name}`")

    def look_at(self, call: ast.CallSyntax) -> None:
        """Visit the arguments of a call of something unknown, so that the names in them count as used."""
        for argument in call.arguments:
            self.context.scope.used.update(ast.names_in(argument))

    def stay(self, line: ast.StayLine) -> Stay:
        """A ``stay`` line with its typed condition."""
        condition = self.context.scope.condition(line.condition) if line.condition is not None else None
        last = ast.last_token(line.condition) if line.condition is not None else None
        return Stay(condition, self.context.place(line.keyword, last), always=line.condition is None)

    def transition(self, symbol: StateSymbol, line: ast.TransitionLine) -> Transition:
        """The next transition in document order; an invalid trigger waits for nothing."""
        uncertain = False
        trigger = self._trigger(symbol, line)
        scope = self.context.scope
        scope.heard = line.names
        guard = scope.condition(line.guard) if line.guard is not None else None
        actions = self.actions(line.actions)
        scope.heard = ()
        kind = TransitionKind.INTERNAL
        targets: tuple[int, ...] = ()
        if line.target is not None:
            kind = TransitionKind.LOCAL if line.target.arrow == "->" else TransitionKind.EXTERNAL
            targets = self._targets(line.target)
            kind = kind if targets else TransitionKind.INTERNAL
            uncertain = len(targets) < len(line.target.names)
        elif not line.actions and line.keyword != "defer":
            if trigger is not None and (guard is not None or line.guard is None):
                hint = "say where it goes: `-> state`, or what it does: `/ action`"
                self.context.add("E0404", line.keyword, "this transition goes nowhere and does nothing", hint)
            # The line is incomplete: the missing part may name anything.
            self.context.symbols.entered.add_unknown()
            symbol.awaited.add_unknown()
            self.context.scope.used.add_unknown()
            uncertain = True
        index = len(self.transitions)
        operands = [one for one in (line.operand, line.lasting, line.guard) if one is not None]
        uncertain |= any(name in self.context.symbols.doubtful.known for one in operands for name in ast.names_in(one))
        if trigger is None:
            symbol.awaited.add_unknown()
        if uncertain or trigger is None or (guard is None and line.guard is not None):
            self.uncertain.add(index)
        if line.keyword == "when" and line.lasting is None:
            row = trigger.condition if isinstance(trigger, When) else None
            if row is not None and line.guard is not None:
                row = None if guard is None else Binary("and", row, guard, BOOLEAN, row.place)
            self._tables.setdefault(symbol.index, []).append(row)
        place = self.context.place(line.keyword, _last_token(line))
        return Transition(index, symbol.index, targets, trigger or On(()), guard, actions, kind, place)

    def _trigger(self, symbol: StateSymbol, line: ast.TransitionLine) -> Trigger | None:
        if line.keyword == "else":
            return self._else(symbol, line.keyword)
        if line.keyword == "defer":
            return Defer(tuple(self.declarations.deferred(symbol, name) for name in line.names))
        if line.operand is None:
            return On(tuple(self.declarations.event(symbol, name) for name in line.names))
        if line.keyword == "when":
            condition = self.context.scope.condition(line.operand)
            if line.lasting is None:
                return None if condition is None else When(condition)
            lasting = self.context.scope.duration(line.lasting)
            return None if condition is None or lasting is None else Held(condition, lasting)
        duration = self.context.scope.duration(line.operand)
        if duration is None:
            return None
        if line.keyword == "after":
            return After(duration)
        if isinstance(duration, Literal) and nanoseconds(duration.value) == 0:
            hint = "write the time from one repetition to the next"
            self.context.report.add("E0307", duration.place, "`every` needs a duration of a nanosecond or more", hint)
            return None
        return Every(duration)

    def _else(self, symbol: StateSymbol, keyword: Token) -> Else | None:
        """The condition that none of the state's conditions so far holds."""
        rows = self._tables.get(symbol.index, [])
        if not rows and symbol.awaited.unknown:
            return None  # a `when` may be among what could not be read
        if not rows:
            hint = "`else` is the remaining case of the `when` lines before it"
            self.context.add("E0402", keyword, "there is no `when` in this state before this `else`", hint)
            return None
        known = [one for one in rows if one is not None]
        place = self.context.place(keyword)
        if len(known) < len(rows):
            return None
        return Else(Unary("not", self.context.scope.any_of(known), BOOLEAN, place))

    def _targets(self, target: ast.TargetSyntax) -> tuple[int, ...]:
        known: list[StateSymbol] = []
        for name in target.names:
            symbol = self.named_state(name)
            if symbol is None:
                continue
            clash = next((other for other in known if not _orthogonal(symbol, other)), None)
            if clash is not None:
                hint = "several targets must be in different regions of a parallel state"
                self.context.add("E0406", name, f"`{clash.name}` and `{symbol.name}` cannot be active together", hint)
                continue
            known.append(symbol)
        return tuple(one.index for one in known)

    def named_state(self, name: Token) -> StateSymbol | None:
        """The state with a name; of a misspelt one the state that was probably meant."""
        found = self.context.symbols.states.get(str(name))
        if found is not None:
            return found
        owner, dot, suffix = name.rpartition(".")
        if dot and owner in self.context.symbols.states and suffix in HISTORY:
            return self.context.symbols.states[owner].histories.get(HISTORY[suffix])
        if self.context.symbols.may_be_a_state(name):
            self.context.symbols.entered.add_unknown()
            return None
        if dot and owner in self.context.symbols.states and self.context.symbols.states[owner].instance is None:
            inside = suffix in self.context.symbols.states
            hint = f"the name alone is enough: `{suffix}`" if inside else f"there is no state `{suffix}` in `{owner}`"
            self.context.add("E0201", name, f"there is no state `{name}`", hint)
            return self.context.symbols.states.get(suffix, self.context.symbols.states[owner])
        if dot and owner in self.context.symbols.states:
            hint = f"go to `{owner}`, or to `{owner}.history`"
            self.context.add("E0201", name, f"a state inside the instance `{owner}` cannot be a target", hint)
            return self.context.symbols.states[owner]
        wanted = owner if dot and suffix in HISTORY else str(name)
        close = self.context.report.guess(wanted, self.context.symbols.states)
        hint = f"name the state: `state.{name}`" if name in HISTORY else _NO_STATES.get(name, close.text or "")
        place = self.context.place(name)
        self.context.report.add_once(
            "E0201", place, f"there is no state `{wanted}`", hint or "declare it, or correct the name"
        )
        if close.name is None:
            self.context.symbols.entered.add_unknown()
        return self.context.symbols.states.get(close.name or "")

    def actions(self, lines: tuple[ast.ActionSyntax, ...]) -> tuple[Action, ...]:
        """Actions in order, without the invalid ones."""
        actions = [self._action(line) for line in lines]
        return tuple(one for one in actions if one is not None)

    def _action(self, line: ast.ActionSyntax) -> Action | None:
        match line:
            case ast.RaiseSyntax():
                return self._raise(line)
            case ast.SendSyntax():
                return self._send(line)
            case ast.CancelSyntax(event):
                return self._cancel(event)
            case ast.AssignSyntax():
                return self._assignment(line)
            case ast.CallSyntax():
                return self._call(line)

    def _raise(self, line: ast.RaiseSyntax) -> Raise | Send | None:
        event, delay = line.event, line.delay
        arguments = self._data(line)
        found = self.context.scope.duration(delay) if delay is not None else None
        if arguments is None or (found is None and delay is not None):
            return None
        if found is None:
            return Raise(str(event), self.context.place(event), arguments)
        if not isinstance(found, Literal):
            message = "the delay of an event must be fixed, such as `3 s`: no parameter, variable or signal"
            self.context.report.add(
                "E0303", found.place, message, "use a state with an `after` transition that raises the event"
            )
            return None
        return Send(str(event), float(found.value), str(event), self.context.place(event), arguments=arguments)

    def _data(self, line: ast.RaiseSyntax | ast.SendSyntax) -> tuple[Expression, ...] | None:
        """What an event carries that is raised or sent; None where it is invalid."""
        data = self.declarations.data.get(str(line.event))
        if data is None and line.event in self.context.symbols.doubtful:
            self.look_at(line.data)
            return None
        if data is None and line.data.arguments:
            hint = f"declare at the top of the file what it carries: `event {line.event}(NAME : TYPE)`"
            self.context.add("E0213", line.event, f"event `{line.event}` carries no data", hint)
            return None
        fields = [Parameter(one.name, one.type) for one in (data.fields if data is not None else ())]
        return self.context.scope.arguments(line.data, fields, f"event `{line.event}`")

    def _send(self, line: ast.SendSyntax) -> Emit | None:
        event, known = line.event, [*self.declarations.declared, *self.context.library.events]
        if str(event) not in known:
            if event not in self.context.symbols.events and event not in self.context.symbols.doubtful:
                guess = self.context.report.guess(event, known)
                hint = guess.text or f"declare it at the top of the file: `event {event}`"
                self.context.add_once("E0203", event, f"`{event}` is sent to other machines, and not declared", hint)
                self.declarations.sent.add_probable(guess.name)
            return None
        arguments = self._data(line)
        return None if arguments is None else Emit(str(event), self.context.place(event), arguments)

    def _cancel(self, event: Token) -> Cancel | None:
        if event not in self.declarations.delayed and event not in self.context.symbols.events:
            guess = self.context.report.guess(event, self.declarations.delayed)
            hint = guess.text or "only an event that is raised `after` a duration can be cancelled"
            self.context.add_once("E0203", event, f"nothing raises `{event}` after a duration", hint)
            return None
        return Cancel(str(event), self.context.place(event))

    def _call(self, line: ast.CallSyntax) -> Call | None:
        declared = self.context.library.actions.get(str(line.name))
        if declared is None:
            self._unknown_action(line)
            return None
        arguments = self.context.scope.arguments(line, declared.parameters, f"action `{line.name}`")
        if arguments is None:
            return None
        return Call(declared, arguments, self.context.place(line.name, line.closing))

    def _unknown_action(self, line: ast.CallSyntax) -> None:
        """Report an unknown action; check its arguments against the action that was probably meant."""
        name, actions = line.name, self.context.library.actions
        guess = self.context.report.guess(name, actions)
        if name not in self.context.symbols.doubtful.known:
            hint = guess.text
            if name.value in self.context.library.activities:
                hint = f"`{name}` is an activity, which takes time: write it after `do`"
            hint = hint or "`maze-machine list actions` lists them"
            self.context.add_once("E0205", name, f"there is no action `{name}`", hint)
        if guess.name is None:
            self.look_at(line)
        else:
            self.context.scope.arguments(line, actions[guess.name].parameters, f"action `{guess.name}`")

    def _assignment(self, line: ast.AssignSyntax) -> Assign | None:
        name = line.variable
        declared = self.context.scope.variables.get(str(name))
        if declared is None:
            if name not in self.context.symbols.doubtful:
                close = self.context.report.guess(name, self.context.scope.variables)
                self.context.add_once("E0202", name, f"there is no variable `{name}`", close.text)
                if close.name is None:
                    self.context.scope.used.add_unknown()
            self.context.scope.expression(line.value)
            return None
        if declared.constant:
            message, hint = f"`{name}` is a parameter and cannot change", f"declare it with `var {name}`"
            related = Related(declared.place, "declared here")
            self.context.report.add("E0304", self.context.place(name), message, hint, (related,))
            return None
        if declared.owner is not None:
            message = f"`{name}` belongs to the instance `{declared.owner}`, which alone can change it"
            self.context.add("E0304", name, message, "raise an event that the instance handles")
            return None
        was_used = name in self.context.scope.used.known
        node = line.value
        if line.operator != "=":
            operator = line.operator.instead(line.operator[0])
            node = ast.BinarySyntax(operator, name, node, 1 + ast.depth_of(node))
        value = self.context.scope.value(node, declared.type)
        if not was_used and line.operator != "=":
            self.context.scope.used.discard(str(name))
        return None if value is None else Assign(str(name), value, self.context.place(name, line.operator))


def _last_token(line: ast.TransitionLine) -> Token:
    """The last token of a transition's trigger, guard and target."""
    if line.target is not None:
        return line.target.names[-1]
    if line.guard is not None:
        return ast.last_token(line.guard)
    if line.lasting is not None:
        return ast.last_token(line.lasting)
    if line.operand is not None:
        return ast.last_token(line.operand)
    return line.names[-1] if line.names else line.keyword


def _orthogonal(one: StateSymbol, other: StateSymbol) -> bool:
    """Whether two states lie in different regions of a parallel state."""
    above = list(other.ancestors())
    common = next((state for state in one.ancestors() if state in above), None)
    return common is not None and common.kind is StateKind.PARALLEL and common not in (one, other)
