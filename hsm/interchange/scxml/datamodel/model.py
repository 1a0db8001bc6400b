"""The data model of one chart: its guards, blocks and data as the engine's conditions and actions."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import field, replace
from typing import Any, Protocol

from hsm.interchange.scxml.datamodel.content import BlockContext, Builder, Step, run_block
from hsm.interchange.scxml.datamodel.ecmascript import EcmaScriptLanguage
from hsm.interchange.scxml.datamodel.expressions import PROCESSORS, DataError, Environment, Evaluate, Language
from hsm.interchange.scxml.datamodel.python import PythonLanguage
from hsm.interchange.scxml.elements import Element
from hsm.model.chart import Execute, Invoke, Invoked, Model
from hsm.model.expressions import Computed
from hsm.model.messages import STORE, Store
from hsm.model.registry import SignalDeclaration
from hsm.model.types import BOOLEAN
from hsm.model.values import dataclass

DATA_MODELS: dict[str, type[Language]] = {"ecmascript": EcmaScriptLanguage, "python": PythonLanguage}
"""The data models, by name, with the language of their expressions."""

CHARTS = ("scxml", "http://www.w3.org/TR/scxml", "http://www.w3.org/TR/scxml/")
"""The types of what can be invoked."""


class Load(Protocol):
    """Reads charts that are invoked."""

    def element(self, element: Element) -> Model | None:
        """A chart within the chart; None, with diagnostics, if it is invalid."""
        ...

    def file(self, element: Element) -> Model | None:
        """The chart in a file that an ``invoke`` names; None, with diagnostics, if it is not valid."""
        ...

    def data(self, element: Element) -> str | None:
        """The text of the file that a ``data`` names; None, with diagnostics, if it cannot be read."""
        ...

    def text(self, text: Any) -> Model:
        """A chart that is made while the machine runs.

        Raises:
            DataError: it is invalid.
        """
        ...

    def at_run_time(self, name: Any) -> Model:
        """The chart in a file that is named while the machine runs.

        Raises:
            DataError: it is invalid.
        """
        ...


@dataclass(slots=True)
class DataModel:
    """Compiles the parts of a chart that use data into conditions and actions.

    Attributes:
        name: of the chart.
        language: of its expressions.
        states: the index of each state, by name.
        refuse: reports an element, its unsupported feature, and a suggestion.
        load: reads the files that the chart names.
    """

    name: str
    language: type[Language]
    states: Mapping[str, int]
    refuse: Callable[[Element, str, str], None]
    load: Load
    system: Mapping[str, Any] = field(init=False)
    _builder: Builder = field(init=False)

    elements = frozenset({"datamodel", "donedata", "script", "invoke"})
    """What a state or the chart may contain in addition."""

    def __post_init__(self) -> None:
        session = self.name or "chart"
        location = {"location": f"#_scxml_{session}"}
        self.system = {
            "_sessionid": session,
            "_name": self.name,
            "_ioprocessors": {PROCESSORS[0]: location, PROCESSORS[-1]: location},
            "_x": {},
        }
        self._builder = Builder(self.refuse, self.language)

    def guard(self, element: Element) -> Computed:
        """The condition of a transition."""
        text = element.attributes["cond"].strip()
        condition, truth = self._builder.expression(element, text), self.language.truth

        def compute(memo: Mapping[Any, Any], active: Collection[int]) -> bool:
            return truth(condition(Environment(memo[STORE], active, self.states, self.system)))

        declared = SignalDeclaration(text, BOOLEAN, lambda _: False)
        return Computed(declared, (), element.place, compute)

    def script(self, element: Element) -> tuple[Execute, ...]:
        """A script that is run when the chart begins."""
        return (self._execute(element, [self._builder.script(element)]),)

    def block(self, element: Element) -> tuple[Execute, ...]:
        """The executable content of an element, which an error ends as a whole."""
        steps = self._builder.block(element.children)
        return (self._execute(element, steps),) if steps else ()

    def begin(self, elements: Iterable[Element], state: int, *, first: bool) -> tuple[Execute, ...]:
        """Set data when a state is entered.

        Args:
            elements: the ``data`` elements.
            state: index of the state.
            first: only on its first entry.
        """
        found = [(one.attributes.get("id", ""), self._data(one), one) for one in elements]
        if not found:
            return ()

        def begin(session: BlockContext) -> None:
            if first and state in session.store.begun:
                return
            session.memo[STORE] = replace(session.store, begun=session.store.begun | {state})
            for name, value, _ in found:
                if state == 0 and name in session.store.given:
                    session.set(name, session.store.given[name])
                    continue
                try:
                    session.set(name, session.evaluate(value))
                except DataError as error:
                    session.set(name, None)
                    session.fail(error)

        return (self._execute(found[0][2], [begin]),)

    def _data(self, element: Element) -> Evaluate:
        if "src" in element.attributes:
            text = self.load.data(element) or ""
            if text.lstrip().startswith("<"):
                self.refuse(element, "XML as data is not supported", "write the data as an expression")
            return self._builder.literal(element, text)
        return self._builder.value(element)

    def declare(self, names: Iterable[str]) -> Store:
        """All data as it is before it is set."""
        return Store(dict.fromkeys(names))

    def result(self, element: Element, state: int) -> tuple[Execute, ...]:
        """What the completion of a state carries, set when its final state is entered."""
        payload = self._builder.payload(element)

        def note(session: BlockContext) -> None:
            try:
                value = payload(session)
            except DataError as error:
                value = None
                session.fail(error)
            session.memo[STORE] = replace(session.store, results={**session.store.results, state: value})

        return (self._execute(element, [note]),)

    def invoke(self, element: Element, state: str, number: int) -> Invoke:
        """A chart that runs while a state is active.

        Args:
            element: the ``invoke`` element.
            state: the state's name.
            number: which of the state's it is.
        """
        builder, attributes = self._builder, element.attributes
        content = next(iter(element.of("content")), None)
        inline = next(iter(content.of("scxml")), None) if content is not None else None
        kind, source = builder.either(element, "type", "scxml"), builder.either(element, "src")
        known = self.load.element(inline) if inline is not None else None
        if content is None and "src" in attributes:
            known = self.load.file(element)
        written = builder.value(content) if content is not None and inline is None else None
        data = builder.payload(element, content=False)
        final = [builder.block(one.children) for one in element.of("finalize")]
        identifier, place = attributes.get("id", f"{state}.{number}"), attributes.get("idlocation")

        def begin(memo: dict[Any, Any], active: Collection[int], queue: Any) -> Invoked | None:
            session = BlockContext(memo, active, queue, self.states, self.system)
            try:
                if kind(session) not in CHARTS:
                    raise DataError(f"a chart of the type `{kind(session)}` cannot be invoked")
                model = known
                if model is None:
                    text = session.evaluate(written) if written is not None else None
                    model = self.load.text(text) if written is not None else self.load.at_run_time(source(session))
                if place is not None:
                    session.set(place, identifier)
                given = data(session)
            except DataError as error:
                session.fail(error)
                return None
            forward = attributes.get("autoforward") == "true"
            return Invoked(identifier, model, given or {}, forward, finalize if final else None)

        def finalize(memo: dict[Any, Any], active: Collection[int], queue: Any) -> None:
            run_block(final[0], BlockContext(memo, active, queue, self.states, self.system))

        return Invoke(begin, element.place)

    def _execute(self, element: Element, steps: list[Step]) -> Execute:
        def run(memo: dict[Any, Any], active: Collection[int], queue: Any) -> None:
            run_block(steps, BlockContext(memo, active, queue, self.states, self.system))

        text = ", ".join(one.tag for one in element.children) or element.tag
        return Execute(text, run, element.place)
