"""A machine as declared: immutable, flat, in document order; all its runs share it.

Readers (the language, SCXML) fill it; the engine, diagrams, coverage and exports read it. States and transitions refer
to one another by their index, so a deep machine needs no deep recursion. State 0 is the root, which represents the
machine.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import field
from enum import Enum, StrEnum
from math import inf
from typing import Any

from hsm.model.diagnostics import Place
from hsm.model.expressions import Expression
from hsm.model.messages import Occurrence, ScxmlEvent, Store
from hsm.model.properties import Property
from hsm.model.registry import ActionDeclaration, ActivityDeclaration, EventField, Parameter
from hsm.model.types import Type
from hsm.model.values import dataclass


class StateKind(Enum):
    """What a state is, in the terms of SCXML."""

    ATOMIC = "atomic"
    COMPOUND = "compound"
    PARALLEL = "parallel"
    FINAL = "final"
    SHALLOW_HISTORY = "history"
    DEEP_HISTORY = "deep history"


class TransitionKind(Enum):
    """Which states around its source a transition leaves.

    INTERNAL has no target and leaves nothing. LOCAL, to a state inside its compound source, does not leave the source.
    EXTERNAL leaves and re-enters it.
    """

    INTERNAL = "internal"
    LOCAL = "local"
    EXTERNAL = "external"


@dataclass(frozen=True, slots=True)
class On:
    """Fires on any of these events.

    A name matches an event from outside or one that a machine raises. It also matches an outcome of the activity of the
    transition's source, or of a state inside it, and the completion of the source: ``done``, or the name of the final
    state.

    Attributes:
        names: event names; ``*`` is any event from outside or raised. With ``prefix`` an event also matches by its
            leading dotted parts.
        prefix: SCXML's matching of event descriptors; the language itself matches whole names.
    """

    names: tuple[str, ...]
    prefix: bool = False


@dataclass(frozen=True, slots=True)
class Defer(On):
    """Defers any of these events until another state is active."""


@dataclass(frozen=True, slots=True)
class When:
    """Fires in a step in which the condition holds."""

    condition: Expression


@dataclass(frozen=True, slots=True)
class Else(When):
    """Fires in a step in which no earlier condition of the source holds; its own condition says so."""


@dataclass(frozen=True, slots=True)
class Held:
    """Fires once the condition has held at the end of each step for a duration in seconds, evaluated when it begins.

    It is due in the first step after that time in which the condition still holds.
    """

    condition: Expression
    duration: Expression


@dataclass(frozen=True, slots=True)
class Every:
    """Fires whenever a duration in seconds has passed since the source was entered, or since it was due last."""

    duration: Expression


@dataclass(frozen=True, slots=True)
class After:
    """Fires once the source has been active for a duration in seconds, evaluated on entry."""

    duration: Expression


@dataclass(frozen=True, slots=True)
class Always:
    """Fires as soon as its guard holds: SCXML's eventless transition."""


Trigger = On | When | After | Every | Held | Always

Timed = After | Every | Held
"""Triggers with a deadline."""


@dataclass(frozen=True, slots=True)
class Assign:
    """Set a variable, by its full name."""

    variable: str
    value: Expression
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Call:
    """Run a one-shot action of the registry."""

    action: ActionDeclaration
    arguments: tuple[Expression, ...] = ()
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Raise:
    """Put an event into the machine's internal queue, which is handled before events from outside.

    Attributes:
        event: its name.
        place: where it is written.
        arguments: what it carries, in the order of its declaration.
    """

    event: str
    place: Place | None = None
    arguments: tuple[Expression, ...] = ()


@dataclass(frozen=True, slots=True)
class Send:
    """Send an event to the machine itself as if from outside: after the events that wait already, or after a delay.

    Attributes:
        event: its name.
        delay: after that many seconds of logical time.
        label: what a ``Cancel`` calls it, or None.
        place: where it is written.
        message: the event with its data, once it was sent.
        arguments: what it carries, in the order of its declaration; evaluated when it is sent.
        target: the session that it goes to; None for the machine itself.
    """

    event: str
    delay: float = 0.0
    label: str | None = None
    place: Place | None = None
    message: ScxmlEvent | Occurrence | None = None
    arguments: tuple[Expression, ...] = ()
    target: str | None = None


@dataclass(frozen=True, slots=True)
class Emit:
    """Send an event to other machines; they receive it in their next step.

    Attributes:
        event: its name.
        place: where it is written.
        arguments: what it carries, in the order of its declaration.
        receivers: how the members of this machine that receive it call it; empty where others run elsewhere.
    """

    event: str
    place: Place | None = None
    arguments: tuple[Expression, ...] = ()
    receivers: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Cancel:
    """Cancel events that were sent with this label and have not arrived."""

    label: str
    place: Place | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Execute:
    """A block of executable content of a chart with a data model.

    Attributes:
        text: what is in it, for reports.
        run: runs it, with the signals of the step (which hold the data), the active states and the machine's queue.
        place: where it is written.
    """

    text: str
    run: Callable[[dict[Any, Any], Collection[int], Any], None]
    place: Place | None = None


Action = Assign | Call | Raise | Send | Emit | Cancel | Execute


@dataclass(frozen=True, slots=True, eq=False)
class Invoked:
    """A chart that begins to run.

    Attributes:
        identifier: what the invoking chart calls it.
        model: the chart.
        data: values for its data, by name.
        autoforward: it is sent all events that its invoker is sent.
        finalize: run on each of its events before the invoker handles it, or None.
    """

    identifier: str
    model: Model
    data: Mapping[str, Any]
    autoforward: bool = False
    finalize: Callable[[dict[Any, Any], Collection[int], Any], None] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Invoke:
    """A chart that runs while a state is active.

    Attributes:
        begin: makes it, with the signals of the step, the active states and the machine's queue; None after an error.
        place: where it is written.
    """

    begin: Callable[[dict[Any, Any], Collection[int], Any], Invoked | None]
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class ActivityCall:
    """What a state does while it is active, with its arguments in the order of the declaration (defaults filled in)."""

    activity: ActivityDeclaration
    arguments: tuple[Expression, ...] = ()
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Transition:
    """One way out of (or within) a state.

    Attributes:
        index: position in document order.
        source: index of its state.
        targets: indices of the states to enter; empty for an internal transition.
        trigger: what it waits for.
        guard: the extra condition, or None.
        actions: run between exits and entries.
        kind: how far it leaves its source.
        place: where it is written.
    """

    index: int
    source: int
    targets: tuple[int, ...]
    trigger: Trigger
    guard: Expression | None = None
    actions: tuple[Action, ...] = ()
    kind: TransitionKind = TransitionKind.LOCAL
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class State:
    """One state.

    Attributes:
        index: position in document order (depth first).
        name: full name, unique in the machine; states of an instance carry the instance's name (``open_door.ringing``).
        kind: what it is.
        parent: index of the state it lies in; -1 for the root.
        children: indices of its direct children, in document order.
        last: index of its last descendant; its descendants are ``index + 1 .. last``.
        initial: what is entered by default (for a history state: where nothing was remembered).
        initial_actions: run when ``initial`` is taken.
        entry: actions on entry.
        exit: actions on exit.
        activity: what it does while active.
        transitions: indices of its transitions, in document order.
        invokes: the charts that run while it is active.
        instance: name of the machine that this state is an instance of, or None.
        doc: the comment above it.
        place: where its name is written.
    """

    index: int
    name: str
    kind: StateKind
    parent: int
    children: tuple[int, ...] = ()
    last: int = -1
    initial: tuple[int, ...] = ()
    initial_actions: tuple[Action, ...] = ()
    entry: tuple[Action, ...] = ()
    exit: tuple[Action, ...] = ()
    activity: ActivityCall | None = None
    transitions: tuple[int, ...] = ()
    invokes: tuple[Invoke, ...] = ()
    instance: str | None = None
    doc: str = ""
    place: Place | None = None

    @property
    def own_name(self) -> str:
        """The last part of the full name."""
        return self.name.rpartition(".")[2]

    @property
    def subtree(self) -> range:
        """The indices of this state and its descendants."""
        return range(self.index, self.last + 1)


@dataclass(frozen=True, slots=True)
class Variable:
    """A typed variable.

    Attributes:
        name: full name, unique in the machine.
        type: its type.
        initial: its value on entry of ``scope``.
        scope: index of the state whose entry sets it (0: when the machine starts).
        constant: nothing assigns it (a parameter of an instance).
        exposed: machines that import this one may read it, also while the instance is not active.
        place: where it is declared.
    """

    name: str
    type: Type
    initial: Expression
    scope: int = 0
    constant: bool = False
    place: Place | None = None
    exposed: bool = False


@dataclass(frozen=True, slots=True)
class EventData:
    """What an event carries.

    Attributes:
        event: the event's name.
        fields: the names and types of its parts, in order.
        place: where it is declared.
    """

    event: str
    fields: tuple[EventField, ...]
    place: Place | None = None

    def variable(self, field: EventField) -> str:
        """How expressions name a part of it: ``floor.number``."""
        return f"{self.event}.{field.name}"


@dataclass(frozen=True, slots=True)
class Adjustable:
    """A parameter that an operator may change while the machine runs.

    Attributes:
        parameter: its name.
        least: the smallest value of a number, in SI units.
        most: the largest one.
    """

    parameter: str
    least: float = -inf
    most: float = inf


@dataclass(frozen=True, slots=True)
class Model:
    """The declaration of a machine.

    Attributes:
        name: the machine's name.
        states: all states in document order; ``states[0]`` is the root.
        transitions: all transitions in document order.
        variables: all variables in document order.
        parameters: the values that can be set at the start of a run, with defaults in SI units.
        derived: for each parameter with a computed default, the expression over the parameters before it, by its name.
        files: the source files it was read from, the machine's own first.
        doc: the comment at the top of the file.
        properties: the claims about every run, including those of instances.
        events: the events that may come from outside: those that the machine, its imports and its library declare; None
            if nothing is declared and any event may come, as in SCXML.
        store: the initial data of a chart; None for a machine without a data model.
        enumerations: those that its files declare.
        event_data: the data of its events, for those that carry data.
        exposed: the variables that importing machines may read.
        members: the states that are machines with a robot and events of their own.
        adjustable: the parameters that an operator may change while the machine runs.
        assumptions: the claims about the robot's surroundings that proofs assume, including those of instances.
    """

    name: str
    states: tuple[State, ...]
    transitions: tuple[Transition, ...] = ()
    variables: tuple[Variable, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    derived: Mapping[str, Expression] = field(default_factory=dict)
    files: tuple[str, ...] = ()
    doc: str = ""
    properties: tuple[Property, ...] = ()
    events: frozenset[str] | None = None
    store: Store | None = None
    enumerations: tuple[type[StrEnum], ...] = ()
    event_data: tuple[EventData, ...] = ()
    exposed: tuple[str, ...] = ()
    members: tuple[str, ...] = ()
    adjustable: tuple[Adjustable, ...] = ()
    assumptions: tuple[Property, ...] = ()

    def data_of(self, event: str) -> EventData | None:
        """The data of an event; None if it carries none."""
        return next((one for one in self.event_data if one.event == event), None)

    def defers_events(self) -> bool:
        """Whether some events wait until another state is active."""
        return any(isinstance(one.trigger, Defer) for one in self.transitions)

    def adjustable_named(self, parameter: str) -> Adjustable | None:
        """The bounds of an adjustable parameter; None if it is not adjustable."""
        return next((one for one in self.adjustable if one.parameter == parameter), None)
