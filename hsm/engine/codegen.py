"""From guards and actions to Python functions, made when they are first needed.

A *chain* is the transitions that one active atomic state, with the states around it, offers to one kind of trigger,
inner states first: a function that gives the first whose guard holds. A *block* is what happens when one state is
entered or left, or one transition is taken. All functions share the names of their arguments:

    f  the facts of the step          v  the values of the variables       q  the machine's own events
    m  the signals evaluated so far   c  the active states, by index       t  the deadlines of time-outs
    h  the paths seen (coverage)      now  the time of the step in nanoseconds
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from itertools import count
from typing import Any, NamedTuple

from hsm.engine.decisions import Condition, Connective, Constant, Decision, Negation, Tree, decision_of
from hsm.engine.evaluation import Evaluation, eager_signals
from hsm.engine.generated import NONE, Block, CandidateChain, Occasion
from hsm.engine.limits import duration, finite, following, interval, whole
from hsm.model.chart import Action, After, Assign, Call, Emit, Every, Execute, Model, Raise, Send, State, Timed
from hsm.model.diagnostics import Place
from hsm.model.expressions import (
    Active,
    Binary,
    Choice,
    Computed,
    Expression,
    Literal,
    SignalValue,
    Unary,
    VariableValue,
)
from hsm.model.messages import Emission, Occurrence
from hsm.model.types import Integer, Quantity, Type
from hsm.model.values import dataclass

FEW_PATHS = 16
"""A guard with up to this many paths is decided by nested ``if``s, one with more by adding up its path."""


_Continuation = Callable[[int, int], None]
"""Writes the code that follows a decided condition, at a depth and with the path so far."""


class _PreparedCall(NamedTuple):
    """A signal's call with what is computed of it once.

    Attributes:
        call: kept, so that its id remains its own.
        slot: of the signal with these arguments.
        changing: whether the arguments can change during a run.
        arguments: their function.
    """

    call: SignalValue
    slot: int
    changing: bool
    arguments: Callable[..., tuple[Any, ...]]


@dataclass(slots=True)
class _Writer:
    """Lines of Python, each with the place that it represents.

    Attributes:
        lines: the lines.
        places: where in the machine's file each comes from.
        known: the signals that have been fetched whenever this line is reached.
    """

    lines: list[str] = field(default_factory=list)
    places: list[Place | None] = field(default_factory=list)
    known: set[int] = field(default_factory=set)

    def add(self, depth: int, line: str, place: Place | None = None) -> None:
        self.lines.append("    " * depth + line)
        self.places.append(place)


class Generator:
    """Makes chains and blocks for one model, and gives signals, variables and foreign objects their slots.

    Attributes:
        variables: slot of each parameter, each variable and each part of what events carry, by name.
        own_variables: the names of the parameters and variables: what keeps its value between events.
        states: index of each state, by name.
    """

    def __init__(self, model: Model) -> None:
        self.model = model
        names = [parameter.name for parameter in model.parameters] + [variable.name for variable in model.variables]
        carried = [declared.variable(part) for declared in model.event_data for part in declared.fields]
        self.variables = {name: slot for slot, name in enumerate((*names, *carried))}
        self.own_variables = names
        self._types = {one.name: one.type for one in model.variables}
        self._changing = {one.name for one in model.variables if not one.constant or one.scope}
        self._changing.update(one.parameter for one in model.adjustable)
        self.states = {state.name: state.index for state in model.states}
        # Runs in several threads share the generator: a counter and ``setdefault`` keep them from assigning a number
        # twice.
        self._numbers = count()
        self._slots: dict[tuple[str, str], int] = {}
        self._decisions = [decision_of(transition) for transition in model.transitions]
        self._chains: dict[tuple[tuple[int, ...], bool], CandidateChain] = {}
        self._namespace: dict[str, Any] = {}
        self._objects: dict[int, str] = {}
        self._opened: dict[int, tuple[int, ...]] = {}
        self._calls: dict[int, _PreparedCall] = {}
        self._functions: dict[int, tuple[object, Callable[..., Any]]] = {}
        for slot, variable in enumerate(model.variables, len(model.parameters)):
            self._opened[variable.scope] = (*self._opened.get(variable.scope, ()), slot)

    def evaluation(
        self,
        memo: Mapping[Any, Any],
        values: Sequence[Any],
        active: frozenset[int],
        ask: Callable[[SignalValue], Any],
    ) -> Evaluation:
        """The values that expressions use at one moment of a run."""
        return Evaluation(values, self.variables, active, self.states, memo, self.key, ask)

    def first_values(self, parameters: Sequence[Any]) -> list[Any]:
        """The values of all slots before a run begins: what is exposed can be read from the start.

        Args:
            parameters: the values of the parameters, in order; for a run in progress followed by those of the
                variables.
        """
        values = [*parameters, *[None] * (len(self.variables) - len(parameters))]
        for slot, variable in enumerate(self.model.variables, len(self.model.parameters)):
            if variable.exposed and slot >= len(parameters) and isinstance(variable.initial, Literal):
                values[slot] = variable.initial.value
        return values

    def decision(self, transition: int) -> Decision:
        """What decides whether a transition fires."""
        return self._decisions[transition]

    def chain(self, candidates: tuple[int, ...]) -> CandidateChain:
        """The chain of some transitions, all of one kind of trigger."""
        timed = isinstance(self.model.transitions[candidates[0]].trigger, Timed)
        found = self._chains.get((candidates, timed))
        if found is None:
            found = self._chains[candidates, timed] = self._make_chain(candidates, timed)
        return found

    def _make_chain(self, candidates: tuple[int, ...], timed: bool) -> CandidateChain:  # noqa: FBT001
        writer = _Writer()
        writer.add(0, "def pick(f, m, v, c, h, due):" if timed else "def pick(f, m, v, c, h):")
        for index in candidates:
            self._candidate(writer, index, timed)
        writer.add(1, f"return {NONE}")
        return CandidateChain(candidates, self._written(writer, "pick"))

    def _candidate(self, writer: _Writer, index: int, timed: bool) -> None:  # noqa: FBT001
        decision = self.decision(index)
        known = set(writer.known)
        if timed:
            writer.add(1, f"if {index} in due:")
        depth = 2 if timed else 1
        if not decision.conditions:
            decided = decision.follow(bool)[0]
            writer.add(depth, f"return {index}" if decided else "pass")
        elif decision.count <= FEW_PATHS:
            self._nested(writer, index, decision, depth)
        else:
            self._flat(writer, index, decision, depth)
        # Only the first condition of a guard is always evaluated, and none of a time-out that is not due.
        first = _first(decision.tree)
        if isinstance(first, Condition) and not timed:
            known.update(self.slot(call) for call in eager_signals(decision.conditions[first.number]))
        writer.known = known

    def _nested(self, writer: _Writer, index: int, decision: Decision, depth: int) -> None:
        """Nested ``if``s with a mark at the end of each path."""

        def end(*, outcome: bool) -> _Continuation:
            def write(depth: int, path: int) -> None:
                writer.add(depth, f"h.add(({index}, {path}))")
                if outcome:
                    writer.add(depth, f"return {index}")

            return write

        def branch(tree: Tree, depth: int, path: int, true: _Continuation, false: _Continuation) -> None:
            match tree:
                case Condition(number):
                    before = set(writer.known)
                    test = self._fetch(writer, decision.conditions[number], depth)
                    inside = set(writer.known)
                    writer.add(depth, f"if {test}:")
                    true(depth + 1, path + 2 * 3**number)
                    writer.known = set(inside)
                    writer.add(depth, "else:")
                    false(depth + 1, path + 3**number)
                    writer.known = before
                case Constant(held):
                    (true if held else false)(depth, path)
                case Negation(operand):
                    branch(operand, depth, path, false, true)
                case _:
                    first, *rest = tree.parts
                    if not rest:
                        branch(first, depth, path, true, false)
                        return
                    others = Connective(tuple(rest), conjunction=tree.conjunction)

                    def further(depth: int, path: int) -> None:
                        branch(others, depth, path, true=true, false=false)

                    if tree.conjunction:
                        branch(first, depth, path, true=further, false=false)
                    else:
                        branch(first, depth, path, true=true, false=further)

        branch(decision.tree, depth, 0, end(outcome=True), end(outcome=False))

    def _flat(self, writer: _Writer, index: int, decision: Decision, depth: int) -> None:
        """One condition after the other, adding up the path."""

        def decide(tree: Tree, depth: int) -> None:
            match tree:
                case Condition(number):
                    test = self._fetch(writer, decision.conditions[number], depth)
                    writer.add(depth, f"if {test}:")
                    writer.add(depth + 1, "r = True")
                    writer.add(depth + 1, f"p += {2 * 3**number}")
                    writer.add(depth, "else:")
                    writer.add(depth + 1, "r = False")
                    writer.add(depth + 1, f"p += {3**number}")
                case Constant(held):
                    writer.add(depth, f"r = {held}")
                case Negation(operand):
                    decide(operand, depth)
                    writer.add(depth, "r = not r")
                case _:
                    first, *rest = tree.parts
                    decide(first, depth)
                    for part in rest:
                        writer.add(depth, "if r:" if tree.conjunction else "if not r:")
                        before = set(writer.known)
                        decide(part, depth + 1)
                        writer.known = before

        writer.add(depth, "p = 0")
        decide(decision.tree, depth)
        writer.add(depth, f"h.add(({index}, p))")
        writer.add(depth, "if r:")
        writer.add(depth + 1, f"return {index}")

    def entry(self, state: State) -> Block | None:
        """What happens when a state is entered: its variables, its time-outs, its entry actions."""
        writer = _Writer()
        writer.add(0, "def run(f, m, v, c, q, t, now):")
        for slot in self.opened(state.index):
            variable = self.model.variables[slot - len(self.model.parameters)]
            writer.add(1, f"v[{slot}] = {self._held(writer, variable.initial, variable.type)}", variable.place)
        for index in state.transitions:
            transition = self.model.transitions[index]
            if isinstance(transition.trigger, After | Every):
                writer.add(1, f"t[{index}] = now + {self._duration(writer, transition.trigger)}", transition.place)
        return self._block(writer, state.index, Occasion.ENTRY, state.entry)

    def actions(self, state: int, role: Occasion, actions: tuple[Action, ...]) -> Block | None:
        """The exit actions of a state, those of one of its transitions or of its initial transition."""
        writer = _Writer()
        writer.add(0, "def run(f, m, v, c, q, t, now):")
        return self._block(writer, state, role, actions)

    def opened(self, state: int) -> tuple[int, ...]:
        """The slots of the variables that are set when a state is entered."""
        return self._opened.get(state, ())

    def _block(self, writer: _Writer, state: int, role: Occasion, actions: tuple[Action, ...]) -> Block | None:
        for action in actions:
            match action:
                case Assign(variable, value, place):
                    held = self._held(writer, value, self._types[variable])
                    writer.add(1, f"v[{self.variables[variable]}] = {held}", place)
                case Call(declared, arguments, place):
                    given = "".join(f", {self._inline(writer, argument)}" for argument in arguments)
                    writer.add(1, f"{self.named(declared.function)}(f{given})", place)
                case Execute(run=execute, place=place):
                    writer.add(1, f"{self.named(execute)}(m, c, q)", place)
                case Raise(event, place, arguments) if arguments:
                    writer.add(1, f"q.append({self._occurrence(writer, event, arguments)})", place)
                case Raise(event, place):
                    writer.add(1, f"q.append({event!r})", place)
                case Emit(event, place, arguments, receivers):
                    sent = self._occurrence(writer, event, arguments) if arguments else repr(event)
                    writer.add(1, f"q.append({self.named(Emission)}({sent}, {receivers!r}))", place)
                case Send(event=event, place=place, arguments=arguments) if arguments:
                    sent = self._occurrence(writer, event, arguments)
                    writer.add(1, f"q.append({self.named(replace)}({self.named(action)}, message={sent}))", place)
                case _:
                    writer.add(1, f"q.append({self.named(action)})", action.place)
        if len(writer.lines) == 1:
            return None
        watches = any("in c" in line or "(m, c, q)" in line for line in writer.lines)
        run = self._written(writer, "run")
        return Block(run, actions, state, role, run.__code__, tuple(writer.places), watches)

    def arguments(self, expressions: tuple[Expression, ...]) -> Callable[..., tuple[Any, ...]]:
        """A function of ``(f, m, v, c)`` that returns the values of expressions, made once for each tuple object."""
        return self._once(
            expressions, lambda writer: f"({''.join(f'{self._inline(writer, one)}, ' for one in expressions)})"
        )

    def test(self, condition: Expression) -> Callable[..., Any]:
        """A function of ``(f, m, v, c)`` that returns the value of a condition, made once for each condition object."""
        return self._once(condition, lambda writer: self._inline(writer, condition))

    def _once(self, of: object, code: Callable[[_Writer], str]) -> Callable[..., Any]:
        """The function that returns what some code says, made once for an object."""
        found = self._functions.get(id(of))
        if found is None:
            writer = _Writer()
            writer.add(0, "def run(f, m, v, c):")
            writer.add(1, f"return {code(writer)}")
            # The object is kept with its function, so that its id remains its own.
            found = self._functions[id(of)] = of, self._written(writer, "run")
        return found[1]

    def slot(self, call: SignalValue) -> int:
        """The slot of a signal with these arguments."""
        key = (call.signal.name, ", ".join(map(self._code, call.arguments)))
        found = self._slots.get(key)
        return self._slots.setdefault(key, next(self._numbers)) if found is None else found

    def key(self, call: SignalValue, values: Sequence[Any]) -> Any:
        """Where the generated code keeps the value of a call within a step."""
        _, slot, changing, arguments = self._prepared(call)
        return (slot, *arguments(None, {}, values, ())) if changing else slot

    def given(self, call: SignalValue, values: Sequence[Any]) -> tuple[Any, ...]:
        """The arguments of a call."""
        return self._prepared(call).arguments(None, {}, values, ())

    def _prepared(self, call: SignalValue) -> _PreparedCall:
        """What is needed of a call: found once for each object."""
        found = self._calls.get(id(call))
        if found is None:
            found = _PreparedCall(call, self.slot(call), self.changing(call), self.arguments(call.arguments))
            self._calls[id(call)] = found
        return found

    def changing(self, call: SignalValue) -> bool:
        """Whether the arguments of a call can change during a run."""
        return any(name in self._changing for argument in call.arguments for name in _variables(argument))

    def function(self, lines: Sequence[str], name: str) -> Any:
        """The function that lines of Python define under a name; objects have the names that `named` gave them."""
        code = compile("\n".join(lines) + "\n", f"<machine {self.model.name}>", "exec")
        made: dict[str, Any] = {}
        exec(code, self._namespace, made)
        return made[name]

    def _written(self, writer: _Writer, name: str) -> Any:
        return self.function(writer.lines, name)

    def named(self, value: Any) -> str:
        """The name under which generated code knows an object."""
        name = self._objects.get(id(value))
        if name is None:
            name = self._objects.setdefault(id(value), f"k{next(self._numbers)}")
            self._namespace[name] = value
        return name

    def _fetch(self, writer: _Writer, condition: Expression, depth: int) -> str:
        """Write the code that fetches the signals of a condition, each once per step; return the condition's code."""
        for call in eager_signals(condition):
            slot = self.slot(call)
            if slot not in writer.known:
                key = self._key(slot, call)
                writer.add(depth, f"if {key} in m: s{slot} = m[{key}]")
                writer.add(depth, f"else: s{slot} = m[{key}] = {self._ask(call)}")
                writer.known.add(slot)
        return self._code(condition, writer.known)

    def _held(self, writer: _Writer, expression: Expression, kind: Type) -> str:
        """The value of an expression, checked against the limits of a type; beyond them the code raises."""
        code = self._inline(writer, expression)
        if isinstance(expression, Literal) or not isinstance(kind, Integer | Quantity):
            return code
        return f"{self.named(whole if isinstance(kind, Integer) else finite)}({code})"

    def _occurrence(self, writer: _Writer, event: str, arguments: tuple[Expression, ...]) -> str:
        """The code of an event with its data."""
        declared = self.model.data_of(event)
        assert declared is not None, "only declared events carry anything"
        parts = (
            f"{part.name!r}: {self._held(writer, argument, part.type)}"
            for part, argument in zip(declared.fields, arguments, strict=True)
        )
        return f"{self.named(Occurrence)}({event!r}, {{{', '.join(parts)}}})"

    def repeat(self, index: int) -> Block | None:
        """The code that sets the next deadline of a repeated transition that was taken and whose state stays active."""
        transition = self.model.transitions[index]
        assert isinstance(transition.trigger, Every), "nothing else is repeated"
        writer = _Writer()
        writer.add(0, "def run(f, m, v, c, q, t, now):")
        step = self._duration(writer, transition.trigger)
        writer.add(1, f"t[{index}] = {self.named(following)}(t[{index}], now, {step})", transition.place)
        return self._block(writer, transition.source, Occasion.REPEAT, ())

    def _duration(self, writer: _Writer, trigger: After | Every) -> str:
        """The duration of a time-out in nanoseconds."""
        check = interval if isinstance(trigger, Every) else duration
        return f"{self.named(check)}({self._inline(writer, trigger.duration)})"

    def _inline(self, writer: _Writer, expression: Expression) -> str:
        return self._code(expression, writer.known)

    def _key(self, slot: int, call: SignalValue) -> str:
        """Where the value of a call is kept within a step: by its slot and, where they change, its arguments."""
        if not self.changing(call):
            return str(slot)
        return f"({slot}, {', '.join(map(self._code, call.arguments))})"

    def _ask(self, call: SignalValue) -> str:
        arguments = "".join(f", {self._code(argument)}" for argument in call.arguments)
        return f"{self.named(call.signal.function)}(f{arguments})"

    def _code(self, expression: Expression, known: set[int] | frozenset[int] = frozenset()) -> str:
        """The expression in Python; signals that were not fetched before are fetched where they are."""

        def operand(one: Expression) -> str:
            match one:
                case Computed():
                    return f"{self.named(one.compute)}(m, c)"
                case SignalValue():
                    slot = self.slot(one)
                    if slot in known:
                        return f"s{slot}"
                    key = self._key(slot, one)
                    return f"(m[{key}] if {key} in m else m.setdefault({key}, {self._ask(one)}))"
                case Active(state):
                    return f"({self.states[state]} in c)"
                case _:
                    return self.plain(one)

        return operation_code(expression, operand)

    def plain(self, operand: Expression) -> str:
        """A literal or a variable in Python."""
        match operand:
            case Literal(value) if type(value) in (bool, int):
                return repr(value)
            case Literal(float() as value) if type(value) is float and value - value == 0:  # neither infinite nor NaN
                return repr(value)
            case Literal(value):
                return self.named(value)
            case VariableValue(name):
                return f"v[{self.variables[name]}]"
            case _:
                raise TypeError(f"{operand} is neither a literal nor a variable")


def operation_code(expression: Expression, operand: Callable[[Expression], str]) -> str:
    """An expression in Python.

    Args:
        expression: the expression.
        operand: returns the code of a literal or a variable.
    """
    match expression:
        case Unary("abs", inner):
            return f"abs({operation_code(inner, operand)})"
        case Unary(operator, inner):
            return f"({operator} {operation_code(inner, operand)})"
        case Binary("min" | "max" as operator, left, right):
            return f"{operator}({operation_code(left, operand)}, {operation_code(right, operand)})"
        case Binary(operator, left, right):
            return f"({operation_code(left, operand)} {operator} {operation_code(right, operand)})"
        case Choice(condition, then, otherwise):
            chosen, other = operation_code(then, operand), operation_code(otherwise, operand)
            return f"({chosen} if {operation_code(condition, operand)} else {other})"
        case _:
            return operand(expression)


def _first(tree: Tree) -> Tree:
    while not isinstance(tree, Condition | Constant):
        tree = tree.operand if isinstance(tree, Negation) else tree.parts[0]
    return tree


def _variables(expression: Expression) -> Iterator[str]:
    match expression:
        case VariableValue(name):
            yield name
        case Unary(_, operand):
            yield from _variables(operand)
        case Binary(_, left, right):
            yield from _variables(left)
            yield from _variables(right)
        case Choice(condition, then, otherwise):
            for one in (condition, then, otherwise):
                yield from _variables(one)
