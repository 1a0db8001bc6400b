"""From SCXML text to a model."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import field, replace
from difflib import get_close_matches
from pathlib import Path

from hsm.interchange.scxml.data_use import all_of, has_data, uses_data
from hsm.interchange.scxml.datamodel.content import NAME, CommunicationError
from hsm.interchange.scxml.datamodel.expressions import DataError
from hsm.interchange.scxml.datamodel.model import CHARTS, DATA_MODELS, DataModel
from hsm.interchange.scxml.elements import Element, parse
from hsm.interchange.scxml.null_model import NullModel, report_unsupported
from hsm.interchange.scxml.own_words import OWN_DATA_MODEL
from hsm.interchange.scxml.vocabulary import breaches
from hsm.model.chart import (
    Action,
    Always,
    Invoke,
    Model,
    On,
    State,
    StateKind,
    Transition,
    TransitionKind,
)
from hsm.model.codes import finding
from hsm.model.diagnostics import Diagnostic, MachineError, Place, Related
from hsm.model.topology import Topology
from hsm.model.values import dataclass

_STATES = ("state", "parallel", "final", "history")
"""Elements without an effect on the states: they are ignored."""

_LARGEST = 32 * 2**20
_DEEPEST_INVOKE = 16


def read_file(path: str | Path) -> Model:
    """The model of an SCXML file.

    Raises:
        MachineError: the file cannot be read or is not a chart that is supported; all diagnostics are in it.
    """
    return read_text(_content(Path(path)), str(path))


def _content(path: Path) -> bytes:
    """What is in a file.

    Raises:
        MachineError: it cannot be read.
    """
    try:
        if path.is_fifo():  # opening one waits for a writer
            raise MachineError([finding("E0902", None, f"{path} cannot be read: it is a pipe")])
        with path.open("rb") as file:  # not to the end: a device may have none
            text = file.read(_LARGEST + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise MachineError([finding("E0902", None, f"{path} cannot be read: {reason}")]) from None
    if len(text) > _LARGEST:
        raise MachineError([finding("E0902", None, f"{path} cannot be read: it is larger than 32 MiB")])
    return text


def read_text(text: str | bytes, file: str = "<text>") -> Model:
    """The model of an SCXML text.

    Args:
        text: the document.
        file: what diagnostics call it.

    Raises:
        MachineError: it is not a chart that is supported; all diagnostics are in it.
    """
    model, found = _read(parse(text, file), file, 0)
    if found:
        raise MachineError(sorted(found, key=lambda one: (one.place is not None and one.place, one.code)))
    return model


def _read(top: Element, file: str, depth: int) -> tuple[Model, list[Diagnostic]]:
    """A document with all its diagnostics; ``depth`` is how many charts around it invoke each other."""
    reader = _Reader(file, depth)
    model = reader.read(top)
    found = list(breaches(top))
    told = {(one.place, one.code) for one in found}
    return model, found + [one for one in reader.findings if (one.place, one.code) not in told]


@dataclass(frozen=True, slots=True)
class _Loader:
    """Reads the charts that a chart invokes.

    Attributes:
        reader: of the invoking chart.
    """

    reader: _Reader

    def element(self, element: Element) -> Model | None:
        """A chart within the chart."""
        model, found = _read(element, self.reader.file, self.reader.depth + 1)
        self.reader.findings += found
        return None if found else model

    def file(self, element: Element) -> Model | None:
        """The chart in the file beside this one that an ``invoke`` names."""
        try:
            return self._file(element.attributes["src"])
        except MachineError as error:
            self.reader.findings += [replace(one, place=one.place or element.place) for one in error.diagnostics]
            return None

    def data(self, element: Element) -> str | None:
        """The text of the file beside this chart that a ``data`` names."""
        try:
            return _content(self._beside(element.attributes["src"])).decode()
        except MachineError as error:
            self.reader.findings += [replace(one, place=element.place) for one in error.diagnostics]
        except UnicodeDecodeError:
            self.reader.find("E0902", f"`{element.attributes['src']}` is not text in UTF-8", element.place)
        return None

    def text(self, text: object) -> Model:
        """A chart that is made while the machine runs."""
        if not isinstance(text, str):
            raise DataError("only a chart can be invoked")
        return self._at_run_time(lambda: parse(text, self.reader.file), self.reader.file)

    def at_run_time(self, name: object) -> Model:
        """The chart in a file that is named while the machine runs."""
        if not isinstance(name, str) or not name:
            raise DataError(f"`{name}` names no chart to invoke")
        try:
            return self._file(name)
        except MachineError as error:
            raise CommunicationError(str(error)) from None

    def _at_run_time(self, read: Callable[[], Element], file: str) -> Model:
        try:
            model, found = _read(read(), file, self.reader.depth + 1)
        except MachineError as error:
            raise DataError(str(error)) from None
        if found:
            raise DataError(str(found[0].message))
        return model

    def _file(self, name: str) -> Model:
        if self.reader.depth >= _DEEPEST_INVOKE:
            message = f"charts invoke each other more than {_DEEPEST_INVOKE} levels deep"
            hint = "name the chart by `srcexpr`, which is read when it is due"
            raise MachineError([finding("E0902", None, message, hint)])
        path = self._beside(name)
        model, found = _read(parse(_content(path), str(path)), str(path), self.reader.depth + 1)
        if found:
            raise MachineError(found)
        return model

    def _beside(self, name: str) -> Path:
        if "://" in name.removeprefix("file://"):
            hint = "save it as a file beside the chart"
            raise MachineError([finding("E0902", None, f"`{name[:200]}` cannot be read: it is not a file", hint)])
        return Path(self.reader.file).parent / name.removeprefix("file:")


@dataclass(slots=True)
class _Draft:
    """A state while the document is read."""

    element: Element
    name: str
    parent: int
    children: list[int] = field(default_factory=list)
    last: int = 0


class _Reader:
    """One document: states are numbered first, as transitions may name any of them."""

    def __init__(self, file: str, depth: int = 0) -> None:
        self.file = file
        self.depth = depth
        self.findings: list[Diagnostic] = []
        self.drafts: list[_Draft] = []
        self.indices: dict[str, int] = {}
        self.transitions: list[Transition] = []
        self.data: DataModel | NullModel = NullModel(self.find, lambda names, place: list(self._targets(names, place)))

    def read(self, top: Element) -> Model:
        if top.tag != "scxml":
            self.find("E0902", f"the document is a <{top.tag}>, not an <scxml>", top.place)
            return Model("", ())
        if top.attributes.get("datamodel") == OWN_DATA_MODEL:
            message = "the data model `maze-machine` is not supported: a chart has no robot to ask"
            self.find("E0904", message, top.place, "use the machine's own file, or write the chart in `ecmascript`")
            return Model("", ())
        self._number(top)
        self.data = self._data_model(top) or self.data
        states = tuple(self._state(index) for index in range(len(self.drafts)))
        name = states[0].name
        store = self.data.declare(self._data_names())
        model = Model(name, states, tuple(self.transitions), files=(self.file,), store=store)
        if not self.findings:
            self._check_targets(model)
        return model

    def find(
        self, code: str, message: str, place: Place, suggestion: str | None = None, related: tuple[Related, ...] = ()
    ) -> None:
        self.findings.append(finding(code, place, message, suggestion, related))

    def _number(self, top: Element) -> None:
        """Give every state its index, in document order."""
        pending = [(top, -1)]
        while pending:
            element, parent = pending.pop()
            index = len(self.drafts)
            self.drafts.append(_Draft(element, self._name(element, index, parent), parent))
            if parent >= 0:
                self.drafts[parent].children.append(index)
            pending.extend((child, index) for child in reversed(list(element.of(*_STATES))))
        for index in reversed(range(len(self.drafts))):
            draft = self.drafts[index]
            draft.last = max(draft.last, index)
            if draft.parent >= 0:
                outer = self.drafts[draft.parent]
                outer.last = max(outer.last, draft.last)
        if len(self.drafts) == 1:
            self.find("E0909", "the chart has no state", top.place, "add a <state>")

    def _name(self, element: Element, index: int, parent: int) -> str:
        if parent < 0:
            return element.attributes.get("name") or Path(self.file).stem
        name = element.attributes.get("id") or f"{element.tag}-{index}"
        if name in self.indices:
            first = self.drafts[self.indices[name]].element.place
            related = (Related(first, "first used here"),)
            self.find("E0907", f"two states are called `{name}`", element.place, "rename one of them", related)
        self.indices.setdefault(name, index)
        return name

    def _state(self, index: int) -> State:
        draft = self.drafts[index]
        element = draft.element
        self._refuse_strangers(element)
        kind = self._kind(draft)
        initial, initial_actions = self._initial(index, kind)
        transitions: tuple[int, ...] = ()
        if kind not in (StateKind.SHALLOW_HISTORY, StateKind.DEEP_HISTORY):
            transitions = tuple(self._transition(one, index, kind) for one in element.of("transition"))
        return State(
            index=index,
            name=draft.name,
            kind=kind,
            parent=draft.parent,
            children=tuple(draft.children),
            last=draft.last,
            initial=initial,
            initial_actions=initial_actions,
            entry=(
                *self._begun(index),
                *self._scripts(element),
                *(action for block in element.of("onentry") for action in self.data.block(block)),
                *self._result(draft),
            ),
            exit=tuple(action for block in element.of("onexit") for action in self.data.block(block)),
            transitions=transitions,
            invokes=self._invokes(draft),
            place=element.place,
        )

    def _invokes(self, draft: _Draft) -> tuple[Invoke, ...]:
        """The charts that run while a state is active."""
        if isinstance(self.data, NullModel) or draft.parent < 0:
            return ()
        for one in draft.element.of("invoke"):
            kind = one.attributes.get("type", "scxml")
            if kind not in CHARTS:
                message, hint = (
                    f"an <invoke> of type `{kind}` is not supported",
                    "only charts in SCXML can be invoked: `scxml`",
                )
                self.find("E0904", message, one.place, hint)
            elif not ({"src", "srcexpr"} & one.attributes.keys() or any(one.of("content"))):
                self.find("E0909", "<invoke> needs a chart", one.place, "name it by `src`, or write it in <content>")
        if self.findings:
            return ()
        elements = enumerate(draft.element.of("invoke"), 1)
        return tuple(self.data.invoke(one, draft.name, number) for number, one in elements)

    def _refuse_strangers(self, element: Element) -> None:
        known = {*_STATES, "transition", "onentry", "onexit", "initial", *self.data.elements}
        known.discard("invoke" if element.tag == "scxml" else "script")
        for child in element.children:
            empty_data = child.tag == "datamodel" and not child.children
            if child.tag not in known and not empty_data:
                report_unsupported(self.find, child)
        if "initial" in element.attributes and element.tag in ("parallel", "final", "history"):
            self.find("E0904", f"a <{element.tag}> has no `initial`", element.place, "leave it out")

    def _kind(self, draft: _Draft) -> StateKind:
        element = draft.element
        if element.tag == "history":
            depth = element.attributes.get("type", "shallow")
            if depth not in ("shallow", "deep"):
                self.find("E0910", f"the type of a history is `shallow` or `deep`, not `{depth}`", element.place)
            return StateKind.DEEP_HISTORY if depth == "deep" else StateKind.SHALLOW_HISTORY
        inner = [child for child in draft.children if self.drafts[child].element.tag != "history"]
        if element.tag == "final":
            if draft.children:
                self.find("E0909", "a <final> has no states in it", element.place)
            return StateKind.FINAL
        if draft.parent < 0:
            return StateKind.COMPOUND
        if element.tag == "parallel" and inner:
            return StateKind.PARALLEL
        if not inner and draft.children:
            self.find("E0909", f"`{draft.name}` has a history but no state to remember", element.place)
        return StateKind.COMPOUND if inner else StateKind.ATOMIC

    def _initial(self, index: int, kind: StateKind) -> tuple[tuple[int, ...], tuple[Action, ...]]:
        """What is entered by default, with the actions run then."""
        draft = self.drafts[index]
        element = draft.element
        if kind in (StateKind.SHALLOW_HISTORY, StateKind.DEEP_HISTORY):
            return self._default(index, list(element.of("transition")), draft.parent)
        if kind is not StateKind.COMPOUND:
            if kind is StateKind.ATOMIC and ("initial" in element.attributes or any(element.of("initial"))):
                self.find("E0909", f"`{draft.name}` has an `initial` and no state inside", element.place)
            return (), ()
        elements = [one for initial in element.of("initial") for one in initial.of("transition")]
        if any(element.of("initial")):
            if "initial" in element.attributes or len(list(element.of("initial"))) > 1:
                self.find("E0909", f"`{draft.name}` has two initial states", element.place, "keep one `initial`")
            return self._default(index, elements, index)
        names = element.attributes.get("initial", "").split()
        targets = tuple(self._targets(names, element.place))
        self._check_within(targets, index, index, element.place)
        if names:
            return targets, ()
        return tuple(child for child in draft.children if self.drafts[child].element.tag != "history")[:1], ()

    def _default(
        self, index: int, transitions: list[Element], around: int
    ) -> tuple[tuple[int, ...], tuple[Action, ...]]:
        element = self.drafts[index].element
        if len(transitions) != 1 or not transitions[0].attributes.get("target", "").split():
            what = "the default of a history" if around != index else "an <initial>"
            self.find("E0909", f"{what} is one <transition> with a target", element.place)
            return (), ()
        transition = transitions[0]
        for name in ("event", "cond"):
            if name in transition.attributes:
                self.find("E0904", f"a default transition has no `{name}`", transition.place, "leave it out")
        targets = tuple(self._targets(transition.attributes["target"].split(), transition.place))
        self._check_within(targets, index, around, transition.place)
        return targets, self.data.block(transition)

    def _check_within(self, targets: tuple[int, ...], index: int, around: int, place: Place) -> None:
        for target in targets:
            if target == index or not around < target <= self.drafts[around].last:
                name = self.drafts[around].name
                self.find("E0908", f"`{self.drafts[target].name}` is not a state inside `{name}`", place)

    def _targets(self, names: list[str], place: Place) -> Iterator[int]:
        for name in names:
            index = self.indices.get(name)
            if index is None:
                close = get_close_matches(name, self.indices, 1)
                hint = f"did you mean `{close[0]}`?" if close else None
                self.find("E0906", f"there is no state `{name}`", place, hint)
            else:
                yield index

    def _transition(self, element: Element, source: int, kind: StateKind) -> int:
        attributes = element.attributes
        names = attributes.get("target", "").split()
        targets = tuple(dict.fromkeys(self._targets(names, element.place)))
        events = tuple(attributes.get("event", "").split())
        if not events and not names and "cond" not in attributes:
            self.find("E0909", "a transition needs an event, a condition or a target", element.place)
        how = attributes.get("type", "external")
        if how not in ("internal", "external"):
            self.find("E0910", f"the type of a transition is `internal` or `external`, not `{how}`", element.place)
        leaves = TransitionKind.EXTERNAL
        if not names:
            leaves = TransitionKind.INTERNAL
        elif how == "internal" and kind is StateKind.COMPOUND:
            leaves = TransitionKind.LOCAL
        self.transitions.append(
            Transition(
                index=len(self.transitions),
                source=source,
                targets=targets,
                trigger=On(events, prefix=True) if events else Always(),
                guard=self.data.guard(element) if "cond" in attributes else None,
                actions=self.data.block(element),
                kind=leaves,
                place=element.place,
            )
        )
        return len(self.transitions) - 1

    def _data_model(self, top: Element) -> DataModel | None:
        """The data model that a chart uses; None if it uses none.

        The standard leaves it to the platform which one a chart has that names none: here it is ``ecmascript`` if the
        chart has data.
        """
        name = top.attributes.get("datamodel") or ("ecmascript" if has_data(top) else "null")
        if name == "null" and (any(all_of(top, "invoke")) or self.depth):
            name = "ecmascript"  # sessions that communicate need it; there is no data
        if name in DATA_MODELS:

            def refuse(element: Element, reason: str, hint: str) -> None:
                self.find("E0905", reason, element.place, hint)

            if uses_data(top) or self.depth:
                return DataModel(self.drafts[0].name, DATA_MODELS[name], self.indices, refuse, _Loader(self))
        elif name != "null":
            known = ", ".join(("null", *DATA_MODELS))
            self.find("E0904", f"the data model `{name}` is not supported", top.place, f"those are: {known}")
        return None

    def _data_of(self, index: int) -> list[Element]:
        element = self.drafts[index].element
        return [data for model in element.of("datamodel") for data in model.of("data")]

    def _data_names(self) -> list[str]:
        """The names of all data."""
        found: dict[str, Element] = {}
        for one in (data for index in range(len(self.drafts)) for data in self._data_of(index)):
            name = one.attributes.get("id", "")
            if name in found:
                related = (Related(found[name].place, "first used here"),)
                self.find("E0907", f"two pieces of data are called `{name}`", one.place, "rename one of them", related)
            elif name and not NAME.fullmatch(name):
                hint = "use letters, digits and `_`, and no digit first"
                self.find("E0910", f"`{name}` is not a name for data", one.place, hint)
            found.setdefault(name, one)
        return list(found)

    def _begun(self, index: int) -> tuple[Action, ...]:
        """The code that sets the data of a state: all at the start, or each on its first entry."""
        if self.drafts[0].element.attributes.get("binding", "early") == "late":
            return self.data.begin(self._data_of(index), index, first=index > 0)
        if index > 0:
            return ()
        every = [one for state in range(len(self.drafts)) for one in self._data_of(state)]
        return self.data.begin(every, index, first=False)

    def _scripts(self, element: Element) -> tuple[Action, ...]:
        """What the scripts at the top of a chart do when it begins."""
        scripts = element.of("script") if element.tag == "scxml" else ()
        return tuple(action for one in scripts for action in self.data.script(one))

    def _result(self, draft: _Draft) -> tuple[Action, ...]:
        """The data of the completion that a final state causes."""
        return tuple(one for data in draft.element.of("donedata") for one in self.data.result(data, draft.parent))

    def _check_targets(self, model: Model) -> None:
        """Several targets must lie in different regions of a parallel state."""
        topology = Topology(model)
        several = [(one.targets, one.place) for one in model.transitions]
        several += [(one.initial, one.place) for one in model.states]
        for targets, place in several:
            for number, target in enumerate(targets):
                for other in targets[:number]:
                    around = next(one for one in topology.up(target) if other in model.states[one].subtree)
                    if model.states[around].kind is not StateKind.PARALLEL and place is not None:
                        pair = f"`{model.states[other].name}` and `{model.states[target].name}`"
                        self.find("E0911", f"{pair} cannot be active together", place)
