"""Runs that the debugger did not make up: in a maze, recorded, and elsewhere."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from hsm.interchange.reports import model_json
from maze_machine.catalogue.library import robot_names
from maze_machine.catalogue.profile import load_profile
from maze_machine.debug.breakpoints import Breakpoints, NamedBreakpoint, read_condition
from maze_machine.debug.chart import Chart
from maze_machine.debug.debugger import Debugger, Goal
from maze_machine.debug.elsewhere import RemoteRun
from maze_machine.debug.runs import RunError
from maze_machine.drive.mission import drive, prepare
from maze_machine.remote.client import RemoteMachine
from maze_machine.remote.messages import EndRun, Pause
from maze_machine.remote.opened import OpenRun
from maze_machine.remote.operated import OperatedRun
from maze_machine.report.outputs import Outputs
from maze_machine.simulated.world import SimulatedWorld, find_maze
from transport.description import RobotDescription
from transport.memory_bus import MemoryNetwork
from transport.world import LockstepRobot

LIMIT = 60.0
WALK_AT_ONCE = """machine walk

initial moving

state moving
    do drive(speed = 0.2 m/s)
    when space.left    -> turning
    on blocked         -> turning

state turning
    do rotate(90 deg)
    on done        -> moving
"""
BIN = Path(sys.executable).parent


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A short recorded run and its trace, line by line."""
    folder = tmp_path_factory.mktemp("recorded")
    mission = prepare("pledge", load_profile("pico"), time_limit=8.0)
    world = SimulatedWorld(find_maze("final_2015", robot=RobotDescription()), mission.profile.robot)
    robot, outputs = LockstepRobot(world), Outputs(folder / "run.jsonl", folder / "run.mcap")
    with outputs.watchers(mission, "pledge", world, []) as watchers:
        drive(mission, robot, robot, watchers)
    lines = (folder / "run.jsonl").read_text(encoding="utf-8").splitlines()
    return folder / "run.mcap", [json.loads(one) for one in lines[1:]]


def test_a_recording_is_gone_through_forwards_and_back(editor, recorded):
    file, lines = recorded
    editor.launch("pledge", recording=str(file))
    for line in lines[1:6]:
        editor.go("next")
        assert editor.stack()[-2::-1] == line["states"]
    assert "it is a recorded run" in editor.refused("setExpression", expression="space.left", value="true")
    editor.go("stepBack")
    assert editor.stack()[-2::-1] == lines[4]["states"]
    taking = next(one for one in lines[1:] if one["taken"])
    state = taking["states"][-1]
    assert editor.ask("setFunctionBreakpoints", breakpoints=[{"name": state}])["breakpoints"][0]["verified"]
    assert editor.go("continue")["text"] == f"{state} was entered"
    editor.go("stepBack")
    scopes = editor.scopes(2)
    assert any(name.endswith(": taken") for name in scopes)
    editor.ask("setFunctionBreakpoints", breakpoints=[])
    assert editor.go("continue")["text"] == "the run has ended"


def test_a_maze_gives_the_same_run_as_without_a_debugger(editor, recorded):
    _, lines = recorded
    editor.launch("pledge", maze="final_2015")
    for line in lines[1:10]:
        editor.go("next")
        assert editor.stack()[-2::-1] == line["states"]
    assert any(editor.scopes()["Signals"].values())
    assert "only signals can" in editor.refused("setExpression", expression="cruise", value="1 m/s")


def test_a_signal_of_the_simulated_robot_is_set_by_hand(editor, walk):
    editor.launch(walk, maze="corridor")
    assert editor.scopes()["Signals"] == {}  # in this state nobody asks for it
    walk.write_text(WALK_AT_ONCE, encoding="utf-8")
    editor.ask("restart")
    editor.event("stopped")
    editor.go("next")
    assert editor.stack() == ["moving", "machine walk"]
    editor.go("next")
    editor.set("space.left", "true")
    assert "(from the next step on)" in editor.scopes()["Signals"]["space.left"]
    editor.go("next")
    assert editor.stack() == ["turning", "machine walk"]
    for _ in range(2):
        editor.go("stepBack")
    assert "cannot be undone" in editor.refused("setExpression", expression="space.left", value="false")


@pytest.fixture
def elsewhere(walk):
    """A machine that drives a simulated robot in a thread, and a client of it; whether it can be held."""
    network = MemoryNetwork()
    threads = []

    def begin(*, pausable):
        mission = prepare(str(walk), load_profile("pico"), time_limit=60.0)
        operated = OperatedRun(mission, pausable=pausable)
        told = model_json(mission.machine.model, mission.parameters)
        opened = OpenRun(network.bus(), mission, operated, told)
        client = RemoteMachine(network.bus(), mission.profile.robot.name)
        robot = LockstepRobot(SimulatedWorld(find_maze("corridor", robot=RobotDescription()), mission.profile.robot, 0))

        opened.__enter__()
        if pausable:
            client.operate(Pause())
        # It listens before the first tick: a run that is held publishes no other.
        run = RemoteRun(Chart(mission.machine, robot_names()), client, lambda: None)
        thread = threading.Thread(target=lambda: drive(mission, robot, robot, [opened, operated], operator=operated))
        thread.start()
        threads.append((opened, client, thread))
        return run

    yield begin
    for opened, client, thread in threads:
        client.operate(EndRun())
        thread.join(LIMIT)
        opened.__exit__(None, None, None)
        assert not thread.is_alive()


def first_step(run):
    """Wait for the first tick that is heard."""
    deadline = time.monotonic() + LIMIT
    while not run.steps:
        run.advance()
        assert time.monotonic() < deadline, "no tick was heard"


def until(debugger, seconds=LIMIT):
    """Move until the debugger stands."""
    deadline = time.monotonic() + seconds
    while True:
        stop = debugger.move(50)
        if stop is not None:
            return stop
        assert time.monotonic() < deadline, "waited too long"


def test_a_simulation_elsewhere_is_held_and_goes_on_by_a_tick(elsewhere):
    run = elsewhere(pausable=True)
    debugger = Debugger(run, Breakpoints(), lambda _: None)
    first_step(run)
    first = run.steps[-1].heard["tick"]
    for number in range(1, 4):
        debugger.begin(Goal.STEP)
        assert until(debugger).reason == "step"
        assert debugger.step.heard["tick"] == first + number
    assert run.tell(debugger.at, "send go") == "sent go"
    condition = read_condition("moving", run.chart)
    debugger.breakpoints.named = [NamedBreakpoint(1, "moving", condition)]
    debugger.begin(Goal.BREAK)
    assert until(debugger).text == "moving was entered"
    reasons = {one.label: one.verdict for one in debugger.step.reasons(0)}
    assert reasons["when space.left -> turning"] == "false"
    with pytest.raises(RunError, match="runs in another process"):
        run.change(0, "turns", "2")


def test_a_run_that_stands_still_already_shows_where_it_is(elsewhere):
    run = elsewhere(pausable=True)
    first_step(run)
    late = RemoteRun(run.chart, run.machine, lambda: None)  # nothing is published while it stands still
    assert late.advance()
    assert late.steps[0].states(0) == run.steps[-1].states(0) == ("idle",)
    assert not late.advance()
    late.go(1)
    deadline = time.monotonic() + LIMIT
    while len(late.steps) < 2:
        late.advance()
        assert time.monotonic() < deadline, "no tick was heard"
    assert late.steps[1].heard["tick"] == late.steps[0].heard["tick"] + 1


def test_on_hardware_nothing_is_held(elsewhere):
    run = elsewhere(pausable=False)
    debugger = Debugger(run, Breakpoints(), lambda _: None)
    first_step(run)
    debugger.begin(Goal.BREAK)
    debugger.move(20)
    debugger.halt()
    before = run.steps[-1].heard["tick"]
    debugger.begin(Goal.STEP)
    until(debugger)
    assert debugger.step.heard["tick"] > before


def test_it_attaches_over_zenoh(editor, walk):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    running = subprocess.Popen(
        [BIN / "maze-machine", "run", walk, "--maze", "corridor", "--open", endpoint, "--speed", "1", "--no-picture"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        deadline = time.monotonic() + LIMIT
        while not editor.succeeds("attach", program=str(walk), connect=endpoint):  # it takes a while to start
            assert time.monotonic() < deadline, "waited too long"
        editor.event("initialized")
        editor.ask("configurationDone")
        assert editor.event("stopped")["reason"] == "entry"
        assert editor.stack() == ["idle", "machine walk"]
        editor.ask("setFunctionBreakpoints", breakpoints=[{"name": "moving"}])
        editor.ask("evaluate", expression="send go", context="repl")
        editor.event("stopped")
        assert editor.go("continue")["text"] == "moving was entered"
        assert editor.stack() == ["moving", "machine walk"]
    finally:
        os.killpg(running.pid, signal.SIGTERM)
        running.communicate(timeout=LIMIT)


@contextmanager
def killed(process):
    """End a process at the end of a block, also where a test has failed: leaving it would wait for ever."""
    try:
        yield
    finally:
        process.kill()


@pytest.mark.parametrize("port", [False, True], ids=["standard streams", "port"])
def test_the_command_serves_an_editor(editor_of, walk, port):
    arguments = ["--listen", "0"] if port else []
    process = subprocess.Popen(
        [BIN / "maze-machine", "dap", *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    with process, killed(process):
        if port:
            told = process.stderr.readline().decode()
            connection = socket.create_connection(("127.0.0.1", int(re.search(r":(\d+)$", told)[1])), timeout=LIMIT)
            streams = connection.makefile("rb"), connection.makefile("wb")
        else:
            connection, streams = None, (process.stdout, process.stdin)
        editor = editor_of(*streams)
        assert editor.launch(walk)["reason"] == "entry"
        assert editor.stack() == ["idle", "machine walk"]
        editor.ask("disconnect")
        editor.channel.close()
        if connection is None:
            assert process.wait(LIMIT) == 0
        else:
            connection.close()


def test_a_page_of_the_browser_is_no_editor():
    process = subprocess.Popen(
        [BIN / "maze-machine", "dap", "--listen", "0"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    with process, killed(process):
        told = process.stderr.readline().decode()
        with socket.create_connection(("127.0.0.1", int(re.search(r":(\d+)$", told)[1])), timeout=LIMIT) as connection:
            body = b'{"type": "request", "seq": 1, "command": "initialize"}'
            connection.sendall(b"POST / HTTP/1.1\r\nContent-Length: %d\r\n\r\n%b" % (len(body), body))
            answer = b"".join(iter(lambda: connection.recv(65536), b""))
    assert b"not a header of the Debug Adapter Protocol" in answer
    assert b"supports" not in answer


def test_it_listens_on_this_machine_only():
    done = subprocess.run(
        [BIN / "maze-machine", "dap", "--listen", "0.0.0.0:0"],
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
    )
    assert done.returncode == 2
    assert "on this machine only" in done.stderr
