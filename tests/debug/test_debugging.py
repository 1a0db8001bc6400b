"""A machine debugged without a robot, by a client of the protocol."""

import json

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

COMMANDS = [
    *(
        "setBreakpoints",
        "setFunctionBreakpoints",
        "setDataBreakpoints",
        "setExceptionBreakpoints",
        "dataBreakpointInfo",
    ),
    *(
        "breakpointLocations",
        "threads",
        "stackTrace",
        "scopes",
        "variables",
        "setVariable",
        "setExpression",
        "evaluate",
    ),
    *("completions", "exceptionInfo", "loadedSources", "next", "stepIn", "stepOut", "stepBack", "reverseContinue"),
    *("continue", "pause", "launch", "attach", "configurationDone", "restart", "readMemory", ""),
]
NAMES = [
    *("source", "path", "breakpoints", "line", "name", "condition", "hitCondition", "logMessage", "filters", "dataId"),
    *("frameId", "variablesReference", "start", "count", "startFrame", "levels", "expression", "value", "context"),
    *("text", "column", "threadId", "endLine", "arguments", "parameters", "seed", "stopOnEntry"),
]


def test_it_begins_in_the_initial_state(editor, walk):
    stopped = editor.launch(walk)
    assert stopped["reason"] == "entry"
    assert editor.stack() == ["idle", "machine walk"]
    frame = editor.ask("stackTrace", threadId=1)["stackFrames"][0]
    assert (frame["source"]["path"], frame["line"]) == (str(walk), 11)
    scopes = editor.scopes()
    assert scopes["Variables"] == {"pause": "1 s", "turns": "0"}
    assert scopes["Signals"] == {"space.left": "false"}
    assert scopes["Activity"] == {"do": "stop"}


def test_a_step_is_a_microstep_or_a_tick_and_back(editor, walk):
    editor.launch(walk)
    editor.ask("evaluate", expression="when event go", context="repl")
    editor.event("stopped")
    assert editor.stack() == ["moving", "machine walk"]
    editor.set("space.left", "true")
    assert editor.go("stepIn")["reason"] == "step"
    # Chosen, and not taken yet.
    assert editor.stack() == ["when space.left -> turning", "moving", "machine walk"]
    assert editor.scopes(2)["Variables"]["turns"] == "0"
    editor.go("stepIn")
    assert editor.stack() == ["turning", "machine walk"]
    assert editor.scopes()["Variables"]["turns"] == "1"
    editor.go("stepBack")
    assert editor.stack()[0] == "when space.left -> turning"
    editor.go("next")
    assert editor.stack() == ["turning", "machine walk"]
    assert editor.go("reverseContinue")["reason"] == "entry"
    assert editor.stack() == ["idle", "machine walk"]


def test_reasons_are_scopes(editor, walk):
    editor.launch(walk)
    editor.ask("evaluate", expression="when event go", context="repl")
    editor.go("next")
    scopes = editor.scopes()
    assert scopes["when space.left -> turning: false"] == {
        "why": "`space.left` was false",
        "space.left": "false",
    }


def test_what_is_being_done_is_compared_with_its_arguments(editor, walk):
    slow, fast, turn = "doing drive(speed = 0.2 m/s)", "doing drive(speed = 0.3 m/s)", "doing rotate(angle = 90 deg)"
    editor.launch(walk, named=[slow, fast, turn, "doing rotate(angle = -90 deg)"])
    assert all(one["verified"] for one in editor.laid)
    editor.ask("evaluate", expression="when event go", context="repl")
    editor.event("stopped")
    editor.set("space.left", "true")
    stopped = editor.go("reverseContinue")
    stopped = editor.go("continue")
    assert stopped["text"] == f"`{slow}` holds"
    assert editor.go("continue")["text"] == f"`{turn}` holds"


def test_it_breaks_on_states_transitions_and_conditions(editor, walk):
    editor.launch(walk, lines=[15, {"line": 17, "condition": "turns == 0"}], named=["turns == 1"])
    assert [one["verified"] for one in editor.laid] == [True]
    editor.ask("evaluate", expression="set turns = 0", context="repl")
    editor.event("stopped")
    editor.set("space.left", "true")
    stopped = editor.go("continue")
    assert stopped["reason"] == "pause"
    assert "until a signal" in stopped["text"]
    editor.ask("evaluate", expression="back 2", context="repl")
    editor.event("stopped")
    editor.ask("evaluate", expression="when event go", context="repl")
    editor.event("stopped")
    editor.go("reverseContinue")
    assert editor.go("continue")["text"] == "line 15"
    editor.set("space.left", "true")
    stopped = editor.go("continue")
    assert (stopped["reason"], stopped["text"]) == ("breakpoint", "line 17")
    assert editor.stack()[0] == "when space.left -> turning"
    stopped = editor.go("continue")
    assert (stopped["reason"], stopped["text"]) == ("function breakpoint", "`turns == 1` holds")
    assert json.dumps(stopped["hitBreakpointIds"]) == json.dumps([editor.laid[0]["id"]])


def test_a_state_by_its_name_and_a_value_that_changes(editor, walk):
    editor.launch(walk, named=["moving", "nowhere"])
    assert [one["verified"] for one in editor.laid] == [True, False]
    info = editor.ask("dataBreakpointInfo", name="turns")
    assert editor.ask("setDataBreakpoints", breakpoints=[{"dataId": info["dataId"]}])["breakpoints"][0]["verified"]
    editor.ask("evaluate", expression="when event go", context="repl")
    editor.event("stopped")
    editor.go("reverseContinue")
    assert editor.go("continue")["text"] == "moving was entered"
    editor.set("space.left", "true")
    stopped = editor.go("continue")
    assert (stopped["reason"], stopped["text"]) == ("data breakpoint", "`turns` has changed")


def test_a_property_that_does_not_hold_stops_it(editor, walk):
    editor.launch(walk)
    editor.ask("setExceptionBreakpoints", filters=["violation"])
    editor.set("turns", "3")
    stopped = editor.go("continue")
    assert (stopped["reason"], stopped["text"]) == ("exception", "property few is violated")
    assert editor.ask("exceptionInfo", threadId=1)["description"] == "property few is violated"


def test_what_is_set_in_the_past_changes_what_follows(editor, walk):
    editor.launch(walk)
    editor.ask("evaluate", expression="when event go", context="repl")
    editor.event("stopped")
    for _ in range(3):
        editor.go("next")
    for _ in range(3):
        editor.go("stepBack")
    assert editor.stack() == ["moving", "machine walk"]
    editor.set("space.left", "true")
    editor.go("next")
    assert editor.stack() == ["turning", "machine walk"]
    # The whole of it is a scenario, in which the three ticks that were taken back are not.
    lines = editor.ask("evaluate", expression="lines", context="repl")["result"]
    assert lines.splitlines()[0] == "when event go"
    assert lines.splitlines()[-1] == "when space.left"


def test_a_log_point_says_and_does_not_stop(editor, walk):
    editor.launch(walk, lines=[{"line": 17, "logMessage": "turns was {turns}"}])
    editor.ask("evaluate", expression="when event go", context="repl")
    editor.event("stopped")
    editor.set("space.left", "true")
    editor.go("next")
    assert [body["output"] for name, body in editor.said if name == "output"] == ["turns was 0\n"]


def test_every_third_time(editor, walk):
    editor.launch(walk, lines=[{"line": 15, "hitCondition": "% 2"}])
    for _ in range(2):
        editor.ask("evaluate", expression="when event go", context="repl")
        editor.event("stopped")
        editor.ask("evaluate", expression="when drive reports blocked", context="repl")
        editor.event("stopped")
    editor.go("reverseContinue")
    while editor.ask("evaluate", expression="moving", context="watch")["result"] == "false":
        assert editor.go("continue")["reason"] == "breakpoint"


def test_a_tick_after_tick_run_can_be_paused(editor, tmp_path):
    path = tmp_path / "blink.maze-machine"
    path.write_text(
        "machine blink\n\ninitial on_\n\nstate on_\n    after 1 s -> off\n\nstate off\n    after 1 s -> on_\n",
        encoding="utf-8",
    )
    editor.launch(path)
    editor.ask("continue", threadId=1)
    assert "is not paused; pause it first" in editor.refused("stepIn", threadId=1)
    editor.ask("pause", threadId=1)
    assert editor.event("stopped")["reason"] == "pause"


def test_the_end_of_a_machine_is_seen_and_left(editor, tmp_path):
    path = tmp_path / "short.maze-machine"
    path.write_text(
        "machine short\n\ninitial begin\n\nstate begin\n    after 1 s -> finished\n\nfinal finished\n", encoding="utf-8"
    )
    editor.launch(path)
    assert editor.go("continue")["text"] == "the machine ended in finished"
    assert editor.go("stepBack")["reason"] == "step"
    editor.go("continue")
    editor.ask("continue", threadId=1)
    editor.event("exited")
    editor.event("terminated")


def test_it_restarts_with_its_breakpoints(editor, walk):
    editor.launch(walk, lines=[15])
    editor.ask("evaluate", expression="when event go", context="repl")
    editor.event("stopped")
    editor.ask("restart")
    assert editor.event("stopped")["reason"] == "entry"
    assert editor.stack() == ["idle", "machine walk"]
    editor.ask("evaluate", expression="when event go", context="repl")
    editor.event("stopped")
    editor.go("reverseContinue")
    assert editor.go("continue")["text"] == "line 15"


def test_what_is_wrong_is_refused_with_a_reason(editor, walk, tmp_path):
    assert "nothing is being debugged" in editor.refused("stackTrace", threadId=1)
    assert "nothing to debug" in editor.refused("launch")
    assert "no machine" in editor.refused("launch", program="nowhere_at_all")
    assert "exclude each other" in editor.refused(
        "launch", program=str(walk), maze="final_2015", connect="tcp/127.0.0.1:1"
    )
    broken = tmp_path / "broken.maze-machine"
    broken.write_text("machine broken\n\ninitial x\n", encoding="utf-8")
    assert "cannot be used" in editor.refused("launch", program=str(broken))
    editor.launch(walk)
    assert "is not supported" in editor.refused("readMemory", memoryReference="x", count=1)
    assert "neither a variable" in editor.refused("setExpression", expression="nothing", value="1")
    assert editor.refused("setExpression", expression="space.left", value="7")
    assert editor.refused("evaluate", expression="when event nothing", context="repl")
    assert editor.refused("evaluate", expression="turns +", context="watch")
    assert editor.stack() == ["idle", "machine walk"]


def test_names_are_completed_in_the_console(editor, walk):
    editor.launch(walk)
    found = editor.ask("completions", text="when sp", column=8)["targets"]
    assert {"label": "space.left", "start": 5, "length": 2} in found


ANYTHING = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-3, 10**6)
    | st.sampled_from(["", "turns", "space.left", "moving", "1", "when", "é"]),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(NAMES), inner, max_size=4),
    max_leaves=8,
)
ARGUMENTS = st.dictionaries(st.sampled_from(NAMES), ANYTHING, max_size=5)


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(command=st.sampled_from(COMMANDS), arguments=ARGUMENTS)
def test_whatever_is_asked_is_answered(editor, walk, command, arguments):
    if not hasattr(editor, "laid"):
        editor.launch(walk, lines=[15])
    response = editor.channel.send_request(command, arguments)
    response.wait_for_response(raise_if_failed=False)
    editor.ask("pause", threadId=1)
    assert editor.ask("threads")["threads"]
