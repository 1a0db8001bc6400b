"""What reaches the caller of a running machine when something in it goes wrong."""

from __future__ import annotations

from hsm.model.diagnostics import Place


class MachineFault(Exception):  # noqa: N818 - a fault is the language's word
    """Something that a machine called or computed went wrong, and the machine does not handle it.

    The machine is in the configuration before the step. The original exception, if there is one, is the ``__cause__``.

    Attributes:
        reason: what went wrong.
        state: full name of the state concerned.
        place: where in the machine's file it is written; None where the machine was not read from a file.
    """

    def __init__(self, reason: str, state: str, place: Place | None) -> None:
        self.reason = reason
        self.state = state
        self.place = place
        super().__init__(f"{f'{place}: ' if place else ''}state {state}: {reason}")


class Spin(MachineFault):
    """Transitions that follow one another without end within one step."""
