"""Invoked charts: each is a separate run, stored as a value within its invoker's run."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any, Generic, TypeVar

from hsm.engine.compiled import CompiledChart
from hsm.model.messages import ScxmlEvent
from hsm.model.values import dataclass

MOST_SESSIONS = 1000
"""At most this many invoked charts may run at once."""

S = TypeVar("S")


@dataclass(frozen=True, slots=True)
class InvokedChart(Generic[S]):
    """A chart that was invoked.

    Attributes:
        identifier: what its invoker calls it.
        name: its session identifier, unlike that of any other.
        chart: the chart.
        state: where its run is.
        source: index of its invoker's state.
        autoforward: it is sent all events that its invoker is sent.
        finalize: run on each of its events before the invoker handles it.
        inbox: events that it was sent and has not handled.
        ended: it runs no more; its last events are still to be handled by its invoker.
    """

    identifier: str
    name: str
    chart: CompiledChart
    state: S
    source: int
    autoforward: bool
    finalize: Callable[[dict[Any, Any], Collection[int], Any], None] | None
    inbox: tuple[ScxmlEvent, ...] = ()
    ended: bool = False

    @property
    def targets(self) -> tuple[str, ...]:
        """How events are addressed to it; not at all once it has ended."""
        return () if self.ended else (f"#_{self.identifier}", f"#_scxml_{self.name}")
