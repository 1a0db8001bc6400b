"""Decision trees: the selections of a configuration as generated Python functions of nested ``if``.

A tree evaluates each signal at most once, and no condition that was decided on the way to it. A large tree is cut; the
rest is generated when steps reach it. These cases run in full: a transition that does more than move, a second move by
conditions, a signal that is to the right of an ``and`` within a comparison, the data of an SCXML chart, and guards so
wide that steps rarely take the same path twice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import field, replace
from functools import partial
from typing import Any, NoReturn

from hsm.engine.codegen import Generator, operation_code
from hsm.engine.configuration import Leaf, Looked
from hsm.engine.decisions import FALSE, TRUE, Condition, Connective, Constant, Decision, Negation, Tree
from hsm.engine.evaluation import all_signals, eager_signals
from hsm.engine.looks import Found, Interrupted, Known, Look, SlowPath
from hsm.model.expressions import Active, Expression, Literal, SignalValue, VariableValue
from hsm.model.messages import OutsideInput
from hsm.model.values import dataclass

WIDEST = 16
"""One function has at most this many conditions; another one continues."""

DEEPEST = 40
"""Its ``if``s are nested at most this deep; Python allows 100."""

LARGEST = 256
"""At most this many trees grow from one configuration; all further steps are done in full."""


class Undecidable(Exception):  # noqa: N818 - not an error
    """An expression that trees do not decide."""


@dataclass(slots=True)
class _Function:
    """The code of a look.

    Attributes:
        lines: its body.
        ends: what it gives at its ends. It holds them alone, so that a tree that is dropped keeps nothing.
        conditions: how many conditions it has.
    """

    lines: list[str] = field(default_factory=list[str])
    ends: list[Leaf | Found] = field(default_factory=list["Leaf | Found"])
    conditions: int = 0

    def add(self, depth: int, line: str) -> None:
        self.lines.append("    " * depth + line)

    def end(self, value: Leaf | Found) -> str:
        """The name of what is given at an end."""
        self.ends.append(value)
        return f"e{len(self.ends) - 1}"


_Rest = Callable[[_Function, int, Known], None]
"""Writes what follows at a depth, with what is known there."""


class Trees:
    """Generates the trees of one machine.

    Args:
        generator: gives signals, variables and functions their names.
    """

    def __init__(self, generator: Generator) -> None:
        self.generator = generator
        self._calls: dict[int, SignalValue] = {}
        self._carries = bool(generator.model.event_data)

    def grow(self, leaf: Leaf, event: OutsideInput | None) -> Look | Leaf:
        """The next look after a leaf: for an event, for conditions, or the rest of one that was cut.

        Returns:
            The look; for an event, the leaf where it ends if no guard has to be decided and no signal is carried on.

        Raises:
            SlowPath: the event is none that the machine knows, or events carry something, which is among the
                variables while one is handled.
        """
        if event is not None and (not isinstance(event, str) or self._carries or not self._declared(event)):
            raise SlowPath
        leaf.grown[0] += 1
        moves = sum(one.event is None for one in leaf.looked)
        if leaf.grown[0] > LARGEST or moves > 1:
            return _in_full
        try:
            return _Growth(self, leaf, event).whole(leaf) if leaf.rest is None else leaf.rest(leaf)
        except Undecidable:
            return _in_full

    def _declared(self, event: str) -> bool:
        events = self.generator.model.events
        return events is None or event in events

    def call(self, call: SignalValue) -> int:
        """The slot of a signal, which is remembered for its key."""
        slot = self.generator.slot(call)
        self._calls.setdefault(slot, call)
        return slot

    def keys(self, slots: Sequence[int], values: Sequence[Any]) -> Iterator[Any]:
        """Where the values of signals are kept within a step, given the variables."""
        return (self.generator.key(self._calls[slot], values) for slot in slots)


def _in_full(_facts: Any, _values: Sequence[Any], _found: Found) -> NoReturn:
    raise SlowPath


class _Growth:
    """One look as a tree, which may be several functions.

    Args:
        trees: those of the machine.
        leaf: what the look follows.
        event: what is searched for; None for conditions.
    """

    def __init__(self, trees: Trees, leaf: Leaf, event: str | None) -> None:
        self._trees = trees
        self._generator = trees.generator
        self._event = event
        self._configuration = configuration = leaf.after
        self._looked = leaf.looked
        self._grown = leaf.grown
        selector = configuration.when if event is None else configuration.on(event)
        self._chains = () if selector is None else tuple(chain.candidates for chain in selector.chains)

    def whole(self, leaf: Leaf) -> Look | Leaf:
        """The look from its beginning; for an event, the leaf where it ends if it ends only there, without values."""
        function = _Function()
        known = replace(leaf.known, picked=())
        look = self._written(function, self._from(0, 0), known)
        if self._event is not None and not function.conditions and not known.carried:
            (only,) = function.ends
            return only if isinstance(only, Leaf) else _leaf_of(only)
        return look

    def _function(self, body: _Rest, known: Known) -> Look:
        return self._written(_Function(), body, known)

    def _written(self, function: _Function, body: _Rest, known: Known) -> Look:
        function.add(1, "def look(f, v, found):")
        if known.carried:
            function.add(2, f"_, {', '.join(f's{slot}' for slot in known.carried)} = found")
        function.add(2, "try:")
        body(function, 3, known)
        function.add(2, "except Exception as error:")
        function.add(3, f"raise {self._generator.named(Interrupted)}(locals()) from error")
        function.add(1, "return look")
        head = f"def make({', '.join(f'e{number}' for number in range(len(function.ends)))}):"
        look: Look = self._generator.function([head, *function.lines], "make")(*function.ends)
        return look

    # What a function is made of.

    def _from(self, chain: int, place: int) -> _Rest:
        """The rest of the look from a candidate of a chain on."""

        def write(function: _Function, depth: int, known: Known) -> None:
            if chain == len(self._chains):
                self._end(function, depth, known)
            elif place == len(self._chains[chain]):
                self._from(chain + 1, 0)(function, depth, known)
            else:
                index = self._chains[chain][place]
                picked = _picking(index, self._from(chain + 1, 0))
                self._guard(index, picked, self._from(chain, place + 1))(function, depth, known)

        return write

    def _guard(self, index: int, true: _Rest, false: _Rest) -> _Rest:
        """What decides whether a transition fires, and what follows."""
        decision = self._generator.decision(index)
        if not decision.conditions:
            return self._branch(decision, decision.tree, true, false)
        return self._branch(decision, decision.tree, _marking(index, true), _marking(index, false))

    def _branch(self, decision: Decision, tree: Tree, true: _Rest, false: _Rest) -> _Rest:
        match tree:
            case Condition(number):
                expression = decision.conditions[number]
                return self._condition(expression, _stepping(number, TRUE, true), _stepping(number, FALSE, false))
            case Constant(held):
                return true if held else false
            case Negation(operand):
                return self._branch(decision, operand, false, true)
            case Connective(parts, conjunction):
                for part in reversed(parts):
                    branch = self._branch(decision, part, true, false)
                    true, false = (branch, false) if conjunction else (true, branch)
                return true if conjunction else false

    def _condition(self, expression: Expression, true: _Rest, false: _Rest) -> _Rest:
        """A condition, and what follows; where it was decided before, only that."""

        def write(function: _Function, depth: int, known: Known) -> None:
            held = self._decided(expression, known)
            if held is not None:
                (true if held else false)(function, depth, known)
            elif function.conditions >= WIDEST or depth >= DEEPEST:
                self._cut(function, depth, known, write)
            else:
                function.conditions += 1
                known = self._fetch(function, depth, known, expression)
                function.add(depth, f"if {self._code(expression, known)}:")
                true(function, depth + 1, self._learned(expression, known, held=True))
                false(function, depth, self._learned(expression, known, held=False))

        return write

    def _fetch(self, function: _Function, depth: int, known: Known, expression: Expression) -> Known:
        """Evaluate the signals of a condition that are not evaluated yet."""
        for call in eager_signals(expression):
            slot = self._trees.call(call)
            if slot not in known.carried and slot not in known.flags:
                function.add(depth, f"s{slot} = {self._ask(call)}")
                if call is not expression:
                    known = replace(known, carried=(*known.carried, slot))
        return known

    def _end(self, function: _Function, depth: int, known: Known) -> None:
        """The look is over."""
        looked, configuration = self._looked, self._configuration
        if known.picked:
            picked = known.picked if len(known.picked) > 1 else known.picked[0]
            leaf = Leaf(self._trees, configuration, known, looked, self._grown, move=(self._event, picked))
        elif self._event is not None:
            looked = (*looked, Looked(self._event, configuration, None))
            leaf = Leaf(self._trees, configuration, known, looked, self._grown)
        else:
            leaf = Leaf(self._trees, configuration, known, looked, self._grown)
            leaf.go = None
        self._give(function, depth, leaf)

    def _cut(self, function: _Function, depth: int, known: Known, rest: _Rest) -> None:
        def go_on(leaf: Leaf) -> Look:
            return self._function(rest, leaf.known)

        self._give(
            function, depth, Leaf(self._trees, self._configuration, known, self._looked, self._grown, rest=go_on)
        )

    def _give(self, function: _Function, depth: int, leaf: Leaf) -> None:
        carried = "".join(f", s{slot}" for slot in leaf.known.carried)
        end = function.end(leaf if carried else leaf.found)
        function.add(depth, f"return ({end}{carried})" if carried else f"return {end}")

    # Conditions.

    def _decided(self, expression: Expression, known: Known) -> bool | None:
        """The known value of a condition; None if it is unknown."""
        if isinstance(expression, SignalValue) and (slot := self._trees.call(expression)) in known.flags:
            return known.flags[slot]
        if isinstance(expression, Active):
            return self._generator.states[expression.state] in self._configuration.active
        return known.truths.get(self._code(expression, known))

    def _learned(self, expression: Expression, known: Known, *, held: bool) -> Known:
        if isinstance(expression, SignalValue) and (slot := self._trees.call(expression)) not in known.carried:
            return replace(known, flags={**known.flags, slot: held})
        return replace(known, truths={**known.truths, self._code(expression, known): held})

    def _code(self, expression: Expression, known: Known) -> str:
        """A condition in Python, whose signals were fetched before."""
        if len(list(all_signals(expression))) != len(list(eager_signals(expression))):
            raise Undecidable
        return operation_code(expression, partial(self._operand, known))

    def _operand(self, known: Known, operand: Expression) -> str:
        match operand:
            case SignalValue():
                slot = self._trees.call(operand)
                return repr(known.flags[slot]) if slot in known.flags else f"s{slot}"
            case Active(state):
                return repr(self._generator.states[state] in self._configuration.active)
            case Literal() | VariableValue():
                return self._generator.plain(operand)
            case _:
                raise Undecidable

    def _ask(self, call: SignalValue) -> str:
        arguments = "".join(f", {operation_code(one, partial(self._operand, Known()))}" for one in call.arguments)
        return f"{self._generator.named(call.signal.function)}(f{arguments})"


def _leaf_of(found: Found) -> Leaf:
    leaf: Leaf = found[0]
    return leaf


def _picking(index: int, rest: _Rest) -> _Rest:
    """The transition fires; then the rest."""

    def write(function: _Function, depth: int, known: Known) -> None:
        picked = known.picked if index in known.picked else (*known.picked, index)
        rest(function, depth, replace(known, picked=picked))

    return write


def _stepping(number: int, digit: int, rest: _Rest) -> _Rest:
    """The condition with this number was decided; then the rest."""

    def write(function: _Function, depth: int, known: Known) -> None:
        rest(function, depth, replace(known, path=known.path + digit * 3**number))

    return write


def _marking(index: int, rest: _Rest) -> _Rest:
    """The guard of a transition was decided; then the rest."""

    def write(function: _Function, depth: int, known: Known) -> None:
        rest(function, depth, replace(known, path=0, marks=(*known.marks, (index, known.path))))

    return write
