"""The errors that a running machine raises to its caller."""

from __future__ import annotations

from hsm.model.diagnostics import Place


class MachineFault(Exception):  # noqa: N818 - a fault is the language's word
    """A call or a computation of a machine failed, and the machine does not handle the fault.

    The machine is back in the configuration before the step. The original exception, if there is one, is the
    ``__cause__``.

    Attributes:
        reason: what went wrong.
        state: full name of the state in which it failed.
        place: its place in the machine's file; None if the machine was not read from a file.
    """

    def __init__(self, reason: str, state: str, place: Place | None) -> None:
        self.reason = reason
        self.state = state
        self.place = place
        super().__init__(f"{f'{place}: ' if place else ''}state {state}: {reason}")


class Spin(MachineFault):
    """Transitions that repeat without end within one step."""
