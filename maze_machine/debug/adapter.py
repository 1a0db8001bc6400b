"""The debug adapter: answers an editor's requests of the Debug Adapter Protocol.

It has one thread: requests are handled between the points of a running run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from hsm.model.diagnostics import MachineError
from hsm.testing.scenarios.session import SessionError
from maze_machine.debug.asked import Asked, read_arguments
from maze_machine.debug.breakpoints import FAULT, VIOLATION, BreakConditionError, read_condition
from maze_machine.debug.debugger import Debugger, Goal, StopReason
from maze_machine.debug.laying import Laying
from maze_machine.debug.messages import Channel, Message
from maze_machine.debug.opening import open_run
from maze_machine.debug.runs import Run, RunError
from maze_machine.debug.shown import Shown
from maze_machine.errors import explain
from maze_machine.simulated.console import HELP

CAPABILITIES = {
    "supportsConfigurationDoneRequest": True,
    "supportsFunctionBreakpoints": True,
    "supportsConditionalBreakpoints": True,
    "supportsHitConditionalBreakpoints": True,
    "supportsLogPoints": True,
    "supportsDataBreakpoints": True,
    "supportsBreakpointLocationsRequest": True,
    "supportsEvaluateForHovers": True,
    "supportsStepBack": True,
    "supportsSetVariable": True,
    "supportsSetExpression": True,
    "supportsCompletionsRequest": True,
    "supportsExceptionInfoRequest": True,
    "supportsLoadedSourcesRequest": True,
    "supportsRestartRequest": True,
    "supportsTerminateRequest": True,
    "exceptionBreakpointFilters": [
        {"filter": FAULT, "label": "Faults of the machine", "default": True},
        {"filter": VIOLATION, "label": "Properties that do not hold", "default": True},
    ],
}
THREAD = 1
_SLICE = 200
"""How many points are executed between two checks for requests."""
_LOOK = 0.02
"""The interval of checks for a tick of a remote machine, s."""


class RefusedError(Exception):
    """A request that cannot be executed; the message says why."""


class Adapter:
    """One session of an editor.

    Args:
        channel: the connection.
        library: the library of machines whose launch names none; None for that of their projects.
    """

    def __init__(self, channel: Channel, library: str | None = None) -> None:
        self._channel = channel
        self._library = library
        self._asked: Asked | None = None
        self._debugger: Debugger | None = None
        self._laying = laying = Laying(lambda: self._here().run.chart)
        self._stop = StopReason("entry")
        self._shown: Shown | None = None
        self._configured = False
        self._done = False
        self._finished = False
        self._handlers: dict[str, Callable[[Mapping[str, Any]], Mapping[str, object] | None]] = {
            "initialize": self._initialize,
            "launch": self._launch,
            "attach": self._launch,
            "configurationDone": self._configuration_done,
            "setBreakpoints": laying.set_breakpoints,
            "setFunctionBreakpoints": laying.set_function_breakpoints,
            "setDataBreakpoints": laying.set_data_breakpoints,
            "setExceptionBreakpoints": laying.set_exception_breakpoints,
            "dataBreakpointInfo": laying.data_breakpoint_info,
            "breakpointLocations": laying.breakpoint_locations,
            "threads": self._threads,
            "stackTrace": self._stack_trace,
            "scopes": self._scopes,
            "variables": self._variables,
            "setVariable": self._set_variable,
            "setExpression": self._set_expression,
            "evaluate": self._evaluate,
            "completions": self._completions,
            "exceptionInfo": self._exception_info,
            "loadedSources": self._loaded_sources,
            "continue": self._continue,
            "next": lambda _: self._go(Goal.STEP),
            "stepIn": lambda _: self._go(Goal.POINT),
            "stepOut": lambda _: self._go(Goal.LEAVE),
            "stepBack": lambda _: self._go(Goal.POINT, back=True),
            "reverseContinue": lambda _: self._go(Goal.BREAK, back=True),
            "pause": self._pause,
            "restart": self._restart,
            "terminate": self._terminate,
            "disconnect": self._disconnect,
        }

    def serve(self) -> None:
        """Answer requests until the editor leaves."""
        try:
            while not self._done and not self._channel.ended:
                moving = self._debugger is not None and self._debugger.moving
                message = self._channel.next(block=not moving)
                if message is not None:
                    self._answer(message)
                self._move()
        finally:
            if self._debugger is not None:
                self._debugger.run.close()

    def _answer(self, request: Message) -> None:
        command, given = request.get("command"), request.get("arguments")
        handler = self._handlers.get(command) if isinstance(command, str) else None
        if request.get("type") != "request" or handler is None:
            self._channel.refuse(request, f"the request `{command!s:.100}` is not supported")
            return
        try:
            body = handler(given if isinstance(given, dict) else {})
        except (RefusedError, RunError, BreakConditionError, SessionError) as error:
            self._channel.refuse(request, str(error))
        except Exception as error:
            known = explain(error)
            if known is None:
                raise
            self._channel.refuse(request, _unreadable(error) if isinstance(error, MachineError) else known[1])
        else:
            self._channel.answer(request, body)
            self._after(str(command))

    def _after(self, command: str) -> None:
        """What follows an answer."""
        if command == "initialize":
            return
        if command in ("launch", "attach"):
            self._channel.event("initialized")
        if command == "configurationDone" or (command in ("launch", "attach") and self._configured):
            self._begin()
        if command == "restart":
            self._begin()

    def _move(self) -> None:
        debugger = self._debugger
        if debugger is None or not debugger.moving:
            return
        before = (debugger.at, debugger.point)
        stop = debugger.move(_SLICE)
        if stop is not None:
            self._stand(stop)
        elif debugger.moving and before == (debugger.at, debugger.point):
            # No remote tick has arrived yet: wait for one, or for a request, whichever is first.
            self._channel.wait(_LOOK)

    # Beginning and ending.

    def _initialize(self, _given: Mapping[str, Any]) -> Mapping[str, object]:
        return CAPABILITIES

    def _launch(self, given: Mapping[str, Any]) -> None:
        if self._asked is not None:
            raise RefusedError("a run is being debugged already")
        asked = read_arguments(given, self._library)
        self._take(open_run(asked))
        self._asked = asked

    def _take(self, run: Run) -> None:
        """Debug a run with the breakpoints of the editor."""
        self._debugger = Debugger(run, self._laying.breakpoints, self._say)
        self._shown = Shown(run.chart)
        self._finished = False
        wait = 0
        while not run.steps and not run.over:
            if not run.advance():
                self._channel.wait(_LOOK)
                wait += 1
                if wait * _LOOK > _PATIENCE:
                    raise RefusedError("no tick has arrived from the machine")
        if not run.steps:
            raise RefusedError(f"the run has no steps: {run.over}")

    def _configuration_done(self, _given: Mapping[str, Any]) -> None:
        self._configured = True

    def _begin(self) -> None:
        debugger = self._debugger
        if debugger is None or self._asked is None:
            return
        self._channel.event("process", name=debugger.run.chart.machine.name, startMethod="launch", isLocalProcess=True)
        self._channel.event("thread", reason="started", threadId=THREAD)
        if debugger.run.fixed:
            lacks = {"supportsSetVariable": False, "supportsSetExpression": False}
            self._channel.event("capabilities", capabilities=lacks)
        if self._asked.stop:
            debugger.to_entry()
            debugger.run.hold()
            self._stand(StopReason("entry", "the beginning"))
        else:
            debugger.begin(Goal.BREAK)

    def _restart(self, given: Mapping[str, Any]) -> None:
        again = given.get("arguments")
        asked = read_arguments(again, self._library) if isinstance(again, dict) and again else self._asked
        if asked is None:
            raise RefusedError("nothing is being debugged")
        run = open_run(asked)
        self._here().run.close()
        self._asked = asked
        self._take(run)
        self._laying.again()

    def _terminate(self, _given: Mapping[str, Any]) -> None:
        self._finish()

    def _disconnect(self, _given: Mapping[str, Any]) -> None:
        self._done = True

    def _finish(self) -> None:
        if not self._finished:
            self._finished = True
            if self._debugger is not None:
                self._debugger.halt()
            self._channel.event("exited", exitCode=0)
            self._channel.event("terminated")

    # What is seen.

    def _threads(self, _given: Mapping[str, Any]) -> Mapping[str, object]:
        name = "no machine" if self._debugger is None else f"machine {self._debugger.run.chart.machine.name}"
        return {"threads": [{"id": THREAD, "name": name}]}

    def _stack_trace(self, given: Mapping[str, Any]) -> Mapping[str, object]:
        frames = self._view().frames()
        first, levels = given.get("startFrame"), given.get("levels")
        begin = first if isinstance(first, int) else 0
        end = begin + levels if isinstance(levels, int) and levels > 0 else None
        return {"stackFrames": frames[begin:end], "totalFrames": len(frames)}

    def _scopes(self, given: Mapping[str, Any]) -> Mapping[str, object]:
        return {"scopes": self._view().scopes(_number(given, "frameId"))}

    def _variables(self, given: Mapping[str, Any]) -> Mapping[str, object]:
        found = self._view().variables(_number(given, "variablesReference"))
        if found is None:
            raise RefusedError("this was shown before the run continued")
        first, count = given.get("start"), given.get("count")
        begin = first if isinstance(first, int) else 0
        end = begin + count if isinstance(count, int) and count > 0 else None
        return {"variables": found[begin:end]}

    def _set_variable(self, given: Mapping[str, Any]) -> Mapping[str, object]:
        return self._changed(str(given.get("name", "")), str(given.get("value", "")))

    def _set_expression(self, given: Mapping[str, Any]) -> Mapping[str, object]:
        return self._changed(str(given.get("expression", "")).strip(), str(given.get("value", "")))

    def _changed(self, name: str, value: str) -> Mapping[str, object]:
        debugger = self._standing()
        if not debugger.run.chart.type_text(name):
            raise RefusedError(f"`{name}` is neither a variable nor a signal")
        debugger.run.change(debugger.at, name, value)
        debugger.to_newest()
        shown, kind = self._view().value(name) or (value, "")
        return {"value": shown, "type": kind}

    def _evaluate(self, given: Mapping[str, Any]) -> Mapping[str, object]:
        text = str(given.get("expression", "")).strip()
        debugger = self._standing()
        found = self._view().value(text)
        if found is not None:
            return {"result": found[0], "type": found[1], "variablesReference": 0}
        chart = debugger.run.chart
        if given.get("context") == "repl":
            return {"result": self._told(debugger, text), "variablesReference": 0}
        try:
            holds = read_condition(text, chart).holds(debugger.step, debugger.point)
        except BreakConditionError as error:
            raise RefusedError(str(error)) from None
        return {"result": "true" if holds else "false", "type": "bool", "variablesReference": 0}

    def _told(self, debugger: Debugger, line: str) -> str:
        """The answer to a line in the console: a command, or a condition."""
        if line.partition(" ")[0] == "help":
            return HELP
        try:
            return "true" if read_condition(line, debugger.run.chart).holds(debugger.step, debugger.point) else "false"
        except BreakConditionError:
            pass
        answer = debugger.run.tell(debugger.at, line)
        debugger.to_newest()
        self._channel.event("invalidated", areas=["all"])
        self._stand(StopReason("step", line))
        return answer

    def _completions(self, given: Mapping[str, Any]) -> Mapping[str, object]:
        text, column = str(given.get("text", "")), _number(given, "column")
        typed = text[: max(column - 1, 0)].rpartition(" ")[2]
        chart = self._here().run.chart
        words = ["when", "after", "given", "expect", "set", "tick", "why", "back", "lines", "save", "help", "send"]
        known = [*words, *chart.signals, *chart.machine.indices, *(one.name for one in chart.model.variables)]
        found = [one for one in dict.fromkeys(known) if one.startswith(typed) and one]
        return {
            "targets": [{"label": one, "start": max(column - 1 - len(typed), 0), "length": len(typed)} for one in found]
        }

    def _exception_info(self, _given: Mapping[str, Any]) -> Mapping[str, object]:
        return {"exceptionId": "machine", "description": self._stop.text, "breakMode": "always"}

    def _loaded_sources(self, _given: Mapping[str, Any]) -> Mapping[str, object]:
        return {"sources": [{"path": one} for one in self._here().run.chart.model.files]}

    # Moving.

    def _go(self, goal: Goal, *, back: bool = False) -> None:
        debugger = self._standing()
        if debugger.newest and debugger.run.over and not back:
            self._finish()
            return
        self._view().forget()
        debugger.begin(goal, back=back)

    def _continue(self, _given: Mapping[str, Any]) -> Mapping[str, object]:
        self._go(Goal.BREAK)
        return {"allThreadsContinued": True}

    def _pause(self, _given: Mapping[str, Any]) -> None:
        debugger = self._here()
        if debugger.moving:
            debugger.halt()
            self._stand(StopReason("pause", "paused"))

    def _stand(self, stop: StopReason) -> None:
        """Report that the run is paused, and why."""
        self._stop = stop
        debugger = self._here()
        self._view().at(debugger)
        body: dict[str, object] = {"reason": stop.reason, "threadId": THREAD, "allThreadsStopped": True}
        if stop.text:
            body |= {"description": stop.text, "text": stop.text}
        if stop.numbers:
            body["hitBreakpointIds"] = list(stop.numbers)
        self._channel.event("stopped", **body)

    def _say(self, text: str) -> None:
        self._channel.event("output", category="console", output=f"{text}\n")

    def _here(self) -> Debugger:
        if self._debugger is None:
            raise RefusedError("nothing is being debugged")
        return self._debugger

    def _standing(self) -> Debugger:
        debugger = self._here()
        if debugger.moving:
            raise RefusedError("the run is not paused; pause it first")
        return debugger

    def _view(self) -> Shown:
        if self._shown is None:
            raise RefusedError("nothing is being debugged")
        return self._shown


_PATIENCE = 10.0
"""The timeout for the first tick of a remote machine, s."""


def _number(given: Mapping[str, Any], name: str) -> int:
    found = given.get(name)
    return found if isinstance(found, int) else 0


def _unreadable(error: MachineError) -> str:
    """The first errors of a machine, in short: the editor shows them at their places."""
    errors = [one for one in error.diagnostics if one.severity.name == "ERROR"]
    shown = "; ".join(f"{one.place}: {one.message}" for one in errors[:3])
    return f"the machine cannot be used: {shown}{' ...' if len(errors) > 3 else ''}"
