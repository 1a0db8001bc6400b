"""Machines for tests, written as nested calls, and a library whose signals are looked up in a mapping of facts."""

from dataclasses import dataclass, field
from itertools import count
from typing import ClassVar

from hsm import Outcome, build
from hsm.model.chart import (
    ActivityCall,
    After,
    Always,
    Assign,
    Call,
    Model,
    On,
    Raise,
    State,
    StateKind,
    Transition,
    TransitionKind,
    Variable,
    When,
)
from hsm.model.diagnostics import Place
from hsm.model.expressions import Active, Binary, Literal, SignalValue, Unary, VariableValue
from hsm.model.registry import Library
from hsm.model.types import BOOLEAN, INTEGER, NUMBER, Quantity

SECONDS = Quantity(time=1)
LIBRARY = Library("test")
ASKED = []
"""The signals evaluated, in order; a test clears it."""
DONE = []
"""What one-shot actions did; a test clears it."""


def _make(name, kind):
    def read(facts) -> bool:
        ASKED.append(name)
        value = facts[name]
        if isinstance(value, Exception):
            raise value
        return value

    read.__annotations__["return"] = kind
    LIBRARY.signal(name)(read)


for _name in "abcdefgh":
    _make(_name, bool)
for _name in "xyz":
    _make(_name, float)


@LIBRARY.signal("within")
def within(facts, limit: float) -> bool:
    ASKED.append(("within", limit))
    return facts["x"] < limit


@LIBRARY.action("note")
def note(facts, what: int) -> None:
    DONE.append(what)


@LIBRARY.action("fail")
def fail(facts) -> None:
    raise OSError("the bell is broken")


@LIBRARY.activity("work", outcomes=("done", "stuck"))
class Work:
    """Gives its number until the facts name another outcome for it."""

    made: ClassVar[list] = []

    def __init__(self, number: int = 0) -> None:
        self.number = number
        self.stopped = False
        Work.made.append(self)

    def tick(self, facts):
        told = facts.get(self.number)
        if isinstance(told, Exception):
            raise told
        return Outcome(told) if told else self.number

    def stop(self):
        self.stopped = True


def signal(name, *arguments):
    return SignalValue(LIBRARY.signals[name], arguments)


def no(expression):
    return Unary("not", expression, BOOLEAN)


def both(*parts):
    return _join("and", parts)


def either(*parts):
    return _join("or", parts)


def _join(operator, parts):
    whole = parts[0]
    for part in parts[1:]:
        whole = Binary(operator, whole, part, BOOLEAN)
    return whole


def compare(left, operator, right):
    return Binary(operator, left, right, BOOLEAN)


def number(value):
    return Literal(value, INTEGER if isinstance(value, int) else NUMBER)


def variable(name):
    return VariableValue(name, INTEGER)


def plus(left, right):
    return Binary("+", left, right, INTEGER)


def active(name):
    return Active(name)


def put(name, value, line=None):
    place = Place("test.maze-machine", line, 1, line, 9) if line else None
    return Assign(name, number(value) if isinstance(value, int | float) else value, place)


def add(name, amount=1):
    return Assign(name, plus(variable(name), number(amount)))


def call(name, *arguments, line=None):
    place = Place("test.maze-machine", line, 1, line, 9) if line else None
    return Call(LIBRARY.actions[name], tuple(number(one) for one in arguments), place)


def noting(what):
    """An action that leaves a trace."""
    return call("note", what)


def raising(event):
    return Raise(event)


@dataclass
class Way:
    trigger: object
    targets: tuple
    guard: object = None
    actions: tuple = ()
    kind: TransitionKind = TransitionKind.LOCAL


def _way(trigger, targets, options):
    targets = (targets,) if isinstance(targets, str) else tuple(targets or ())
    options.setdefault("kind", TransitionKind.LOCAL if targets else TransitionKind.INTERNAL)
    options["actions"] = tuple(options.get("actions", ()))
    return Way(trigger, targets, **options)


def on(names, targets=None, **options):
    return _way(On(tuple(names.split()), options.pop("prefix", False)), targets, options)


def when(condition, targets=None, **options):
    return _way(When(signal(condition) if isinstance(condition, str) else condition), targets, options)


def after(seconds, targets=None, **options):
    duration = Literal(float(seconds), SECONDS) if isinstance(seconds, int | float) else seconds
    return _way(After(duration), targets, options)


def always(targets=None, **options):
    return _way(Always(), targets, options)


EXTERNAL = {"kind": TransitionKind.EXTERNAL}


@dataclass
class Spec:
    name: str
    inner: list
    ways: list
    kind: StateKind
    options: dict = field(default_factory=dict)


def state(name, *parts, kind=None, **options):
    """A state; its parts are states and transitions. Options: initial, entry, exit, activity, variables."""
    inner = [one for one in parts if isinstance(one, Spec)]
    ways = [one for one in parts if isinstance(one, Way)]
    return Spec(name, inner, ways, kind or (StateKind.COMPOUND if inner else StateKind.ATOMIC), options)


def parallel(name, *parts, **options):
    return state(name, *parts, kind=StateKind.PARALLEL, **options)


def final(name, **options):
    return state(name, kind=StateKind.FINAL, **options)


def history(name, default, *, deep=False):
    return state(name, kind=StateKind.DEEP_HISTORY if deep else StateKind.SHALLOW_HISTORY, initial=default)


def doing(number_, name="work"):
    return ActivityCall(LIBRARY.activities[name], (number(number_),))


def model(*parts, name="m", parameters=(), **options):
    """A model; the first state is the initial one unless ``initial`` says otherwise."""
    top = state(name, *parts, kind=StateKind.COMPOUND, **options)
    specs, parents = [], []
    pending = [(top, -1)]
    while pending:
        spec, parent = pending.pop()
        pending.extend((one, len(specs)) for one in reversed(spec.inner))
        specs.append(spec)
        parents.append(parent)
    index = {spec.name: at for at, spec in enumerate(specs)}
    last = list(range(len(specs)))
    children = [[] for _ in specs]
    for at in range(len(specs) - 1, 0, -1):
        last[parents[at]] = max(last[parents[at]], last[at])
        children[parents[at]].insert(0, at)
    numbers = count()
    ways, states, variables = [], [], []
    for at, spec in enumerate(specs):
        own = []
        for way in spec.ways:
            targets = tuple(index[one] for one in way.targets)
            place = Place("test.maze-machine", len(ways) + 1, 1, len(ways) + 1, 9)
            ways.append(Transition(next(numbers), at, targets, way.trigger, way.guard, way.actions, way.kind, place))
            own.append(ways[-1].index)
        states.append(_state(at, spec, (parents[at], children[at], last[at]), index, specs, own))
        for variable_, value in spec.options.get("variables", {}).items():
            initial = number(value) if isinstance(value, int | float) else value
            constant = variable_ in spec.options.get("constants", ())
            variables.append(Variable(variable_, INTEGER, initial, at, constant))
    return Model(name, tuple(states), tuple(ways), tuple(variables), tuple(parameters))


def _state(at, spec, stands, index, specs, own):  # noqa: PLR0917
    parent, children, last = stands
    initial = spec.options.get("initial")
    histories = (StateKind.SHALLOW_HISTORY, StateKind.DEEP_HISTORY)
    if initial is not None:
        names = (initial,) if isinstance(initial, str) else initial
        targets = tuple(index[one] for one in names)
    elif spec.kind is StateKind.COMPOUND:
        targets = tuple(child for child in children if specs[child].kind not in histories)[:1]
    else:
        targets = ()
    return State(
        at,
        spec.name,
        spec.kind,
        parent,
        tuple(children),
        last,
        targets,
        tuple(spec.options.get("initial_actions", ())),
        tuple(spec.options.get("entry", ())),
        tuple(spec.options.get("exit", ())),
        spec.options.get("activity"),
        tuple(own),
    )


def start(*parts, **options):
    """A run of a machine made of these parts."""
    return build(model(*parts, **options)).start()


class Truth(dict):
    """Facts that are false unless they are given."""

    def __missing__(self, key):
        return False


def facts(*true, **values):
    return Truth(dict.fromkeys(true, True), **values)
