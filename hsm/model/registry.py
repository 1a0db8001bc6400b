"""The registry: all names that a machine may use from outside, declared in Python.

A robot's package fills a ``Library`` with decorated functions and classes; their annotations, defaults and docstrings
are the declaration. The checker, editors, the reference and the engine all read this one registry.

    library = Library("pico")

    @library.signal("space.left")
    def space_left(facts: Facts) -> bool:
        "Whether the beam to the left is free."

    @library.activity("rotate", outcomes=("done", "blocked"), holds=("base",))
    class Rotate:
        "Turn on the spot."
        def __init__(self, angle: Angle, rate: TurnRate = 0.8) -> None: ...
        def tick(self, facts: Facts) -> Command | Outcome: ...
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import field
from enum import StrEnum
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Any,
    Concatenate,
    Generic,
    ParamSpec,
    Protocol,
    TypeAlias,
    TypeVar,
    get_type_hints,
    runtime_checkable,
)

from hsm.model.types import Enumeration, Type, type_of
from hsm.model.values import dataclass

if TYPE_CHECKING:
    from typing_extensions import TypeVar as DefaultTypeVar

    F = DefaultTypeVar("F", default=Any)
    E = DefaultTypeVar("E", default=Any)
else:
    F = TypeVar("F")
    E = TypeVar("E")

FactsT_contra = TypeVar("FactsT_contra", contravariant=True)
EffectT_co = TypeVar("EffectT_co", covariant=True)
_P = ParamSpec("_P")
_R = TypeVar("_R")


@dataclass(frozen=True, slots=True)
class Outcome:
    """How an activity ended; returned from its ``tick``, seen by the machine in the next step."""

    name: str


class Activity(Protocol[FactsT_contra, EffectT_co]):
    """An activity runs while a state is active: it is created on entry, ticked once per step, and dropped on exit."""

    def tick(self, facts: FactsT_contra, /) -> EffectT_co | Outcome | None:
        """Do the work of one step.

        Args:
            facts: the facts of this step.

        Returns:
            An effect for the caller, such as a velocity; an ``Outcome`` when the activity has ended; None for neither.
        """
        ...


@runtime_checkable
class Stoppable(Protocol):
    """An activity that is notified when its state is left."""

    def stop(self) -> None:
        """Called once, when the state is left."""
        ...


def stop_activity(activity: object) -> None:
    """Notify an activity that its state is left, if it has a method for that.

    Args:
        activity: any activity; one that is not `Stoppable` is left alone.
    """
    # Not isinstance: a check against a protocol takes longer than a step.
    stop = getattr(activity, "stop", None)
    if stop is not None:
        stop()


@runtime_checkable
class Choosy(Protocol):
    """The class of an activity that cannot handle all values that the types of its arguments allow."""

    def refuses(self, **arguments: Any) -> str:
        """Why it cannot run with these arguments, or nothing; called on the class, with the arguments known so far."""
        ...


class RegistryError(Exception):
    """A declaration in Python that the registry rejects; the message names it."""


EnumerationClass: TypeAlias = type[StrEnum]

_REQUIRED: Any = inspect.Parameter.empty

_NAME = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*", re.ASCII)


@dataclass(frozen=True, slots=True)
class Parameter:
    """An argument of a signal, an activity or an action, or of a machine."""

    name: str
    type: Type
    default: Any = _REQUIRED

    @property
    def required(self) -> bool:
        """Whether a call must give it."""
        return self.default is _REQUIRED


@dataclass(frozen=True, slots=True)
class SignalDeclaration:
    """A value that a machine may ask for in a step: a pure function of the step's facts (and its arguments)."""

    name: str
    type: Type
    function: Callable[..., Any]
    parameters: tuple[Parameter, ...] = ()
    doc: str = ""


@dataclass(frozen=True, slots=True)
class ActivityDeclaration:
    """Something that a state may ``do``: the class that does it, how it can end, what it holds meanwhile."""

    name: str
    factory: Callable[..., Activity[Any, Any]]
    outcomes: tuple[str, ...] = ()
    holds: tuple[str, ...] = ()
    parameters: tuple[Parameter, ...] = ()
    doc: str = ""


@dataclass(frozen=True, slots=True)
class ActionDeclaration:
    """A one-shot action: called as ``function(facts, *arguments)`` when a transition, entry or exit runs it."""

    name: str
    function: Callable[..., Any]
    parameters: tuple[Parameter, ...] = ()
    doc: str = ""


@dataclass(frozen=True, slots=True)
class EventField:
    """One part of what an event carries.

    Attributes:
        name: its name.
        type: its type.
        enumeration: the enumeration that its values are members of, or None.
    """

    name: str
    type: Type
    enumeration: EnumerationClass | None = None


@dataclass(frozen=True, slots=True)
class EventDeclaration:
    """An event that somebody outside may send to the machine, and what it carries."""

    name: str
    doc: str = ""
    fields: tuple[EventField, ...] = ()


@dataclass(frozen=True, slots=True)
class ConstantDeclaration:
    """A value that is known before a machine runs, such as a length of the robot."""

    name: str
    type: Type
    value: bool | int | float
    doc: str = ""


_A = TypeVar("_A", bound=Callable[..., Activity[Any, Any]])


@dataclass(slots=True)
class Library(Generic[F, E]):
    """A named set of declarations, filled by decorators when a robot's modules are imported, then only read.

    The signals, actions and activities of a ``Library[F, E]`` take facts of type ``F``, and its activities return
    effects of type ``E``; its machines and their runs have the same two types.

    Attributes:
        name: the name used in messages.
        signals: the signals, by name.
        activities: the activities, by name.
        actions: the one-shot actions, by name.
        events: the events that may come from outside, by name.
        constants: the values that are known before a run, by name.
        enumerations: the enumerations that the declarations use, by name.
        folders: folders with machines that any machine may import by name, unless there is one beside it.
    """

    name: str
    signals: dict[str, SignalDeclaration] = field(default_factory=dict)
    activities: dict[str, ActivityDeclaration] = field(default_factory=dict)
    actions: dict[str, ActionDeclaration] = field(default_factory=dict)
    events: dict[str, EventDeclaration] = field(default_factory=dict)
    constants: dict[str, ConstantDeclaration] = field(default_factory=dict)
    enumerations: dict[str, type[StrEnum]] = field(default_factory=dict)
    folders: list[Path] = field(default_factory=list)

    def signal(self, name: str) -> Callable[[Callable[Concatenate[F, _P], _R]], Callable[Concatenate[F, _P], _R]]:
        """Declare a function of the facts (its first argument) as a signal.

        Args:
            name: how machines name it; dots are allowed, as in ``space.left``.

        Raises:
            RegistryError: the name is taken or invalid, or an annotation is missing or not a type of the language.
        """

        def register(function: Callable[Concatenate[F, _P], _R]) -> Callable[Concatenate[F, _P], _R]:
            parameters, result = self._signature(name, function, skip=1)
            if result is _REQUIRED:
                raise RegistryError(
                    f"`{name}`: the signal's function has no annotation of its result, such as `-> bool`"
                )
            declared = SignalDeclaration(name, self._type(name, result), function, parameters, _doc(function))
            self._add(self.signals, name, declared)
            return function

        return register

    def activity(self, name: str, *, outcomes: Iterable[str] = (), holds: Iterable[str] = ()) -> Callable[[_A], _A]:
        """Declare a class with a ``tick`` method as an activity; the arguments of ``__init__`` are its parameters.

        Args:
            name: how machines name it.
            outcomes: the names of the outcomes that ``tick`` may return.
            holds: the resources that it needs exclusively; two activities that use the same one never run at once.

        Raises:
            RegistryError: the name is taken or invalid, or an annotation is missing or not a type of the language.
        """

        def register(factory: _A) -> _A:
            if isinstance(factory, type) and not callable(getattr(factory, "tick", None)):
                raise RegistryError(f"`{name}`: the class {factory.__name__} has no method `tick`")
            initialiser: Callable[..., Any] = getattr(factory, "__init__") if isinstance(factory, type) else factory  # noqa: B009
            own = initialiser is not object.__init__
            parameters = self._signature(name, initialiser, skip=int(isinstance(factory, type)))[0] if own else ()
            declared = ActivityDeclaration(
                name,
                factory,
                _names(name, "outcomes", outcomes),
                _names(name, "holds", holds),
                parameters,
                _doc(factory),
            )
            self._add(self.activities, name, declared)
            return factory

        return register

    def action(self, name: str) -> Callable[[Callable[Concatenate[F, _P], _R]], Callable[Concatenate[F, _P], _R]]:
        """Declare a function of the facts (its first argument) as a one-shot action.

        Args:
            name: how machines name it.

        Raises:
            RegistryError: the name is taken or invalid, or an annotation is missing or not a type of the language.
        """

        def register(function: Callable[Concatenate[F, _P], _R]) -> Callable[Concatenate[F, _P], _R]:
            parameters, _ = self._signature(name, function, skip=1)
            self._add(self.actions, name, ActionDeclaration(name, function, parameters, _doc(function)))
            return function

        return register

    def event(self, name: str, doc: str = "", *, data: Mapping[str, Any] | None = None) -> None:
        """Declare an event that may come from outside.

        Args:
            name: the name of the event.
            doc: when it is sent.
            data: the data that it carries: the types of its fields by name, written as annotations.

        Raises:
            RegistryError: the name is taken, or a type does not exist in the language.
        """
        if not isinstance(data, Mapping | None):
            raise RegistryError(f"`{name}`: the data of an event is a mapping from names to types, not {data!r:.40}")
        fields = tuple(self._field(name, part, annotation) for part, annotation in (data or {}).items())
        self._add(self.events, name, EventDeclaration(name, doc, fields))

    def _field(self, event: str, name: str, annotation: Any) -> EventField:
        kind = self._type(event, annotation)
        return EventField(name, kind, annotation if isinstance(kind, Enumeration) else None)

    def constant(self, name: str, kind: Type, value: bool | float, doc: str = "") -> None:  # noqa: FBT001
        """Declare a value in SI units that is known before a machine runs."""
        self._add(self.constants, name, ConstantDeclaration(name, kind, value, doc))

    def include(self, other: Library[F, E]) -> None:
        """Include all declarations of another library.

        Raises:
            RegistryError: both declare the same name differently.
        """
        tables: tuple[tuple[dict[str, Any], dict[str, Any]], ...] = (
            (self.signals, other.signals),
            (self.activities, other.activities),
            (self.actions, other.actions),
            (self.events, other.events),
            (self.constants, other.constants),
            (self.enumerations, other.enumerations),
        )
        for mine, theirs in tables:
            for name, declared in theirs.items():
                if mine.get(name, declared) != declared:
                    raise RegistryError(
                        f"`{name}` is declared in library {self.name} and, differently, in {other.name}"
                    )
                mine[name] = declared

    def _add(self, table: dict[str, Any], name: str, declared: object) -> None:
        if not isinstance(name, str) or not _NAME.fullmatch(name):
            raise RegistryError(
                f"{name!r:.40} cannot be a name: use letters, digits and underscores, as in `space.left`"
            )
        if name in table:
            raise RegistryError(f"`{name}` is declared twice in library {self.name}")
        table[name] = declared

    def _type(self, name: str, annotation: Any) -> Type:
        try:
            found = type_of(annotation)
        except TypeError as error:
            raise RegistryError(f"`{name}`: {error}") from None
        if isinstance(found, Enumeration):
            self.enumerations.setdefault(found.name, annotation)
        return found

    def _signature(self, name: str, function: Callable[..., Any], skip: int) -> tuple[tuple[Parameter, ...], Any]:
        if not callable(function):
            raise RegistryError(f"`{name}`: {function!r:.40} is neither a function nor a class")
        try:
            hints = get_type_hints(function, include_extras=True)
        except NameError as error:
            raise RegistryError(f"`{name}`: an annotation cannot be resolved: {error}") from None
        listed = list(inspect.signature(function).parameters.values())[skip:]
        bare = next((one.name for one in listed if one.name not in hints), None)
        if bare is not None:
            raise RegistryError(f"`{name}`: its argument `{bare}` has no annotation, such as `{bare}: float`")
        parameters = tuple(Parameter(one.name, self._type(name, hints[one.name]), one.default) for one in listed)
        return parameters, hints.get("return", _REQUIRED)


def _names(activity: str, which: str, given: Iterable[str]) -> tuple[str, ...]:
    """The outcomes of an activity or the resources that it needs."""
    names = (given,) if isinstance(given, str) or not isinstance(given, Iterable) else tuple(given)
    if isinstance(given, str) or not all(isinstance(one, str) and _NAME.fullmatch(one) for one in names):
        raise RegistryError(
            f'`{activity}`: {which} are a list of names, as in {which}=("one", "other"), not {given!r:.40}'
        )
    return names


def _doc(declared: object) -> str:
    return inspect.getdoc(declared) or ""
