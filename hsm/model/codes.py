"""The codes of all diagnostics: of the language, of charts in SCXML and of the backend ``transitions``."""

from __future__ import annotations

from hsm.model.diagnostics import Diagnostic, Place, Related, Severity
from hsm.model.values import dataclass


@dataclass(frozen=True, slots=True)
class Code:
    """One kind of diagnostic: its stable code and its subject in a few words; the letter is its severity."""

    name: str
    title: str

    @property
    def severity(self) -> Severity:
        """An E keeps a machine from being built, a W is likely a mistake, an N may be intended."""
        return {"E": Severity.ERROR, "W": Severity.WARNING, "N": Severity.NOTE}[self.name[0]]


CODES: dict[str, Code] = {
    name: Code(name, title)
    for name, title in {
        # the text
        "E0101": "a line that cannot be read",
        "E0102": "a tab",
        "E0103": "a line indented under a line without a block",
        "E0104": "a bracket that is never closed",
        "E0105": "an indentation that fits no block",
        "E0106": "an expression nested too deep",
        "E0107": "a file that cannot be read",
        # names
        "E0201": "an unknown state",
        "E0202": "an unknown name in an expression",
        "E0203": "an unknown event",
        "E0204": "an unknown activity",
        "E0205": "an unknown action",
        "E0206": "an unknown type",
        "E0207": "an unknown unit",
        "E0208": "an unknown machine",
        "E0209": "a name declared twice",
        "E0210": "an unknown argument",
        "E0211": "a name that cannot be declared",
        "E0212": "a missing argument",
        "E0213": "an argument given twice or too many",
        "E0214": "an argument that the robot cannot follow",
        # types and units
        "E0301": "a value of the wrong type or unit",
        "E0302": "operands that do not go together",
        "E0303": "a value that is not constant",
        "E0304": "an assignment to something that cannot change",
        "E0305": "a division by zero",
        "E0306": "a number that is too large",
        "E0307": "a duration that is negative",
        # structure
        "E0401": "a file that does not begin with its machine",
        "E0402": "a line in the wrong place",
        "E0403": "a second line where only one can be",
        "E0404": "a transition that does nothing",
        "E0405": "an initial state that is elsewhere",
        "E0406": "targets that cannot be active together",
        "E0407": "history of a state without states inside it",
        "E0408": "a parallel state with fewer than two regions",
        "E0409": "a machine without a state",
        "E0410": "an import cycle",
        "E0411": "two activities that use the same resource at once",
        # reachability
        "W0501": "a state that nothing enters",
        "W0502": "a state with no way out",
        "W0503": "a transition that earlier ones hide",
        "W0504": "an outcome that nothing handles",
        "W0505": "transitions that repeat within one tick",
        "W0506": "a condition that never holds",
        # unused declarations
        "W0601": "an unused import",
        "W0602": "an unused parameter",
        "W0603": "an unused variable",
        "W0604": "an unused event",
        "W0605": "nothing to accept",
        "W0606": "an unused definition",
        "N0601": "an event that only comes from outside",
        # tables of conditions
        "N0701": "two transitions that can fire at once",
        "N0702": "a case in which no transition fires",
        "N0703": "an outcome that is handled only under a condition",
        "N0704": "regions that exclude each other's transitions",
        # charts in SCXML
        "E0901": "not well-formed XML",
        "E0902": "not an SCXML document",
        "E0903": "an element of SCXML that is not supported",
        "E0904": "an attribute of SCXML that is not supported",
        "E0905": "a condition that needs a data model",
        "E0906": "an unknown state of a chart",
        "E0907": "a name that two states have",
        "E0908": "an initial state that is not inside its state",
        "E0909": "an element that lacks a required part",
        "E0910": "a value that cannot be read",
        "E0911": "targets of a chart that cannot be active together",
        # other engines and formats
        "E0921": "a feature that the library transitions lacks",
        "E0922": "a feature of SCXML that the language lacks",
        "W0923": "a feature that has another meaning in SCXML",
    }.items()
}
"""All codes, in order."""


def finding(
    code: str,
    place: Place | None,
    message: str,
    suggestion: str | None = None,
    related: tuple[Related, ...] = (),
) -> Diagnostic:
    """A diagnostic with the severity of its code."""
    return Diagnostic(code, CODES[code].severity, message, place, suggestion, related)
