"""XML elements with the places where they are, read without recursion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from xml.parsers import expat

from hsm.model.codes import finding
from hsm.model.diagnostics import MachineError, Place
from hsm.model.values import dataclass

NAMESPACE = "http://www.w3.org/2005/07/scxml"


@dataclass(slots=True)
class Element:
    """One element.

    Attributes:
        tag: its local name; in braces before it the namespace, where that is not SCXML's or none.
        attributes: its attributes by their names, as ``tag`` is named.
        place: where its start tag is.
        children: the elements in it.
        text: the text directly in it.
    """

    tag: str
    attributes: dict[str, str]
    place: Place
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def of(self, *tags: str) -> Iterator[Element]:
        """The children with one of these tags."""
        return (child for child in self.children if child.tag in tags)


def parse(text: str | bytes, file: str) -> Element:
    """The document element.

    Raises:
        MachineError: the text is not well-formed XML.
    """
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.buffer_text = True
    top: list[Element] = []
    opened: list[Element] = []

    def place() -> Place:
        line, column = parser.CurrentLineNumber, parser.CurrentColumnNumber + 1
        return Place(file, line, column, line, column + 1)

    def start(name: str, attributes: dict[str, str]) -> None:
        here = place()
        tag = _local(name)
        width = len(name.rpartition(" ")[2]) + 1
        here = Place(file, here.line, here.column, here.line, here.column + width)
        element = Element(tag, {_local(key): value for key, value in attributes.items()}, here)
        (opened[-1].children if opened else top).append(element)
        opened.append(element)

    def end(_name: str) -> None:
        opened.pop()

    def characters(data: str) -> None:
        opened[-1].text += data

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = characters
    try:
        parser.Parse(text, True)  # noqa: FBT003 - expat's own signature
    except (expat.ExpatError, UnicodeError, ValueError, LookupError) as error:
        line = getattr(error, "lineno", 1)
        column = getattr(error, "offset", 0) + 1
        reason = expat.ErrorString(error.code) if isinstance(error, expat.ExpatError) else str(error)
        here = Place(file, line, column, line, column + 1)
        raise MachineError([finding("E0901", here, f"this is not well-formed XML: {reason}")]) from None
    return top[0]


def _local(name: str) -> str:
    namespace, _, local = name.rpartition(" ")
    return local if namespace in ("", NAMESPACE) else f"{{{namespace}}}{local}"
