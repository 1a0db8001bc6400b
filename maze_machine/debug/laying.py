"""Setting breakpoints from an editor: the answers say which of them are valid."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from maze_machine.debug.breakpoints import (
    FAULT,
    VIOLATION,
    BreakConditionError,
    Breakpoints,
    LineBreakpoint,
    NamedBreakpoint,
    ValueBreakpoint,
    read_condition,
)
from maze_machine.debug.chart import Chart


class Laying:
    """The breakpoints of an editor.

    Attributes:
        breakpoints: those set so far.
    """

    def __init__(self, chart: Callable[[], Chart]) -> None:
        """Args: gives the machine that is debugged."""
        self.breakpoints = Breakpoints()
        self._chart = chart
        self._numbers = 0
        self._wanted: dict[str, Mapping[str, Any]] = {}

    def again(self) -> None:
        """Set them in another run: its machine may have changed."""
        for name, given in list(self._wanted.items()):
            if name == "named":
                self.set_function_breakpoints(given)
            else:
                self.set_breakpoints(given)

    def set_breakpoints(self, given: Mapping[str, Any]) -> Mapping[str, object]:
        """Lay those of one file."""
        source = given.get("source")
        path = str(source.get("path", "")) if isinstance(source, dict) else ""
        if not path:
            raise BreakConditionError("a breakpoint needs a file")
        self._wanted[f"file {path}"] = given
        shown: list[Mapping[str, object]] = []
        laid: list[LineBreakpoint] = []
        for one in _listed(given, "breakpoints"):
            self._numbers += 1
            line = one.get("line")
            try:
                spot = self._chart().spot(path, line if isinstance(line, int) else 0)
                if spot is None:
                    raise BreakConditionError("no state and no transition of the machine is in this file")
                condition = read_condition(str(one["condition"]), self._chart()) if one.get("condition") else None
            except BreakConditionError as error:
                shown.append({"id": self._numbers, "verified": False, "message": str(error), "line": line})
                continue
            hits, message = str(one.get("hitCondition") or ""), str(one.get("logMessage") or "")
            laid.append(LineBreakpoint(self._numbers, spot, condition, hits, message))
            shown.append({"id": self._numbers, "verified": True, "line": spot.line, "source": {"path": path}})
        self.breakpoints.lines[path] = laid
        return {"breakpoints": shown}

    def set_function_breakpoints(self, given: Mapping[str, Any]) -> Mapping[str, object]:
        """Set those of states and conditions."""
        self._wanted["named"] = given
        chart = self._chart()
        self.breakpoints.named = []
        shown: list[Mapping[str, object]] = []
        for one in _listed(given, "breakpoints"):
            self._numbers += 1
            name = str(one.get("name", "")).strip()
            try:
                condition = read_condition(name, chart)
            except BreakConditionError as error:
                shown.append({"id": self._numbers, "verified": False, "message": str(error)})
                continue
            self.breakpoints.named.append(NamedBreakpoint(self._numbers, chart.state(name), condition))
            shown.append({"id": self._numbers, "verified": True})
        return {"breakpoints": shown}

    def data_breakpoint_info(self, given: Mapping[str, Any]) -> Mapping[str, object]:
        """Whether a value can be watched."""
        name = str(given.get("name", ""))
        if not self._chart().type_text(name):
            return {"dataId": None, "description": f"`{name}` is neither a variable nor a signal"}
        return {"dataId": name, "description": name, "accessTypes": ["write"], "canPersist": True}

    def set_data_breakpoints(self, given: Mapping[str, Any]) -> Mapping[str, object]:
        """Set those of variables and signals."""
        self.breakpoints.values = []
        shown: list[Mapping[str, object]] = []
        for one in _listed(given, "breakpoints"):
            self._numbers += 1
            name = str(one.get("dataId", ""))
            known = bool(self._chart().type_text(name))
            if known:
                self.breakpoints.values.append(ValueBreakpoint(self._numbers, name))
            shown.append({"id": self._numbers, "verified": known})
        return {"breakpoints": shown}

    def set_exception_breakpoints(self, given: Mapping[str, Any]) -> None:
        """Choose whether faults and violations stop the run."""
        filters = given.get("filters")
        asked = filters if isinstance(filters, list) else []
        self.breakpoints.faults, self.breakpoints.violations = FAULT in asked, VIOLATION in asked

    def breakpoint_locations(self, given: Mapping[str, Any]) -> Mapping[str, object]:
        """The lines of a stretch where a run can be stopped."""
        source, first = given.get("source"), given.get("line")
        path = str(source.get("path", "")) if isinstance(source, dict) else ""
        first = first if isinstance(first, int) else 1
        last = given.get("endLine")
        spots = self._chart().spots(path, first, last if isinstance(last, int) else first)
        return {"breakpoints": [{"line": one.line} for one in spots]}


def _listed(given: Mapping[str, Any], name: str) -> Sequence[Mapping[str, Any]]:
    found = given.get(name)
    return [one for one in found if isinstance(one, dict)] if isinstance(found, list) else []
