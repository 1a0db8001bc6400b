"""The link between real processes, and what remains of it when they fail."""

from __future__ import annotations

import ast
import json
import random
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from programs import LIMIT, base, command, told, toy
from toy_world import PERIOD, are_answers, undisturbed
from typer.testing import CliRunner

from maze_machine.cli import app
from transport.settings import LinkSettings

STEPS = 250
SLACK = 2.0
"""What a computer that is busy with other tests may add, s; the limit itself is tested on a clock turned by hand."""


@pytest.fixture(autouse=True)
def nothing_left_behind() -> Iterator[None]:
    shared = Path("/dev/shm")
    before = set(shared.glob("*zenoh*")) if shared.exists() else set()
    yield
    assert (set(shared.glob("*zenoh*")) if shared.exists() else set()) <= before


def is_free(endpoint: str) -> bool:
    host, _, port = endpoint.removeprefix("tcp/").partition(":")
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        return probe.bind((host, int(port))) is None


# Lockstep: the maze-machine command itself


def test_a_run_over_the_network_writes_the_same_trace_as_in_one_process(endpoint: str, tmp_path: Path) -> None:
    common = ["--time-limit", "12", "--seed", "5", "--no-picture"]
    with command("run", "pledge", "--trace", "here.jsonl", *common, cwd=tmp_path) as here:
        here.end()
    with command("sim", "final_2015", "--listen", endpoint, "--once") as sim:
        assert sim.line() == f"pico in final of 2015 listens at {endpoint}"
        with command("run", "pledge", "--trace", "there.jsonl", "--connect", endpoint, *common, cwd=tmp_path) as there:
            there.end()
        assert sim.line().startswith("seed 5: ")
        assert sim.end() == 0
    assert (tmp_path / "here.jsonl").read_bytes() == (tmp_path / "there.jsonl").read_bytes()
    assert len((tmp_path / "here.jsonl").read_bytes().splitlines()) > 120


def test_no_simulator_at_the_address_is_one_line_and_status_4(endpoint: str) -> None:
    with command("run", "pledge", "--connect", endpoint, "--set", "link.connect=0.5", "--no-picture") as run:
        assert run.end() == 4
        assert run.errors().splitlines() == [
            f"maze-machine: nothing answers at {endpoint}: is the simulator, gate or router running there?"
        ]


def test_two_robots_of_one_name_on_one_router_are_one_line_and_status_4(endpoint: str) -> None:
    with command("router", "--listen", endpoint) as router:
        router.line()
        with toy("toy_world", endpoint, "lockstep@router") as first:
            first.line()
            with command("sim", "corridor", "--connect", endpoint, "--set", "robot.name=toy") as second:
                assert second.end() == 4
                assert second.errors().splitlines() == [
                    "maze-machine: there is a robot named 'toy' on this network already: choose another `robot.name`"
                ]
            with toy("toy_controller", endpoint, "1", "20") as controller:
                controller.until("driving")
                assert controller.line() == undisturbed(1, 20)


def test_two_attempts_over_the_network_are_those_in_one_process(endpoint: str, tmp_path: Path) -> None:
    """The robot runs straight on into a wall in the first, and has 9 s for the second."""
    lost = ["--fault", "command_lost at=5 lasts=3"]
    common = ["--attempts", "2", "--time-limit", "9", "--no-picture", "--json"]
    run = ["run", "pledge", *common, "--trace"]
    with command(*run, "here.jsonl", "--maze", "final_2015", *lost, cwd=tmp_path) as here:
        mine = json.loads(here.line())
    with command("sim", "final_2015", "--listen", endpoint, *lost) as sim:
        sim.line()
        with command(*run, "there.jsonl", "--connect", endpoint, cwd=tmp_path) as there:
            its = json.loads(there.line())
            assert there.end() == 1
        assert sim.line().startswith("seed 0: unfinished")
    assert [verdict["outcome"] for verdict in its["attempts"]] == ["touched something", "still inside"]
    assert its["attempts"] == mine["attempts"]
    for nth in ("", "-2"):
        assert (tmp_path / f"here{nth}.jsonl").read_bytes() == (tmp_path / f"there{nth}.jsonl").read_bytes()


def test_in_real_time_a_second_attempt_is_refused_with_a_way_out(endpoint: str) -> None:
    with command("sim", "corridor", "--realtime", "--listen", endpoint) as sim:
        sim.line()
        with command("run", "pledge", "--connect", endpoint, "--attempts", "2", "--no-picture") as run:
            assert run.end() == 2
            assert run.errors().splitlines() == [
                "maze-machine: in real time attempts are made one by one; put the robot back and give the command again"
            ]


@pytest.mark.parametrize(
    "arguments",
    [
        ["router", "--listen", "foo"],
        ["sim", "corridor", "--listen", "foo"],
        ["sim", "corridor", "--connect", "foo"],
        ["run", "pledge", "--connect", "foo", "--no-picture"],
        ["gate", "foo"],
        ["gate", "tcp/127.0.0.1:1", "--listen", "foo"],
    ],
    ids=" ".join,
)
def test_a_malformed_endpoint_is_one_line_and_status_2(arguments: list[str]) -> None:
    ended = CliRunner().invoke(app, arguments)
    assert ended.exit_code == 2
    assert ended.stderr.splitlines() == [
        "maze-machine: `foo` is not an endpoint: write tcp/HOST:PORT, such as tcp/127.0.0.1:7447"
    ]


def test_a_busy_port_is_one_line_and_status_4(endpoint: str) -> None:
    with command("sim", "corridor", "--listen", endpoint) as first:
        first.line()
        with command("sim", "corridor", "--listen", endpoint) as second:
            assert second.end() == 4
            assert second.errors().splitlines() == [
                f"maze-machine: {endpoint} is taken by another program: stop it, or choose another port"
            ]


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@pytest.mark.parametrize("which", [["sim", "corridor", "--realtime"], ["router"]])
def test_a_signal_ends_a_server_at_once_and_frees_its_port(
    which: list[str], number: signal.Signals, status: int, endpoint: str
) -> None:
    with command(*which, "--listen", endpoint) as server:
        server.line()
        server.send(number)
        assert server.end() == status
        assert len(server.errors().splitlines()) == 1
    assert is_free(endpoint)


@pytest.mark.parametrize("time", [[], ["--realtime"]])
def test_a_simulator_for_one_episode_ends_also_when_its_controller_was_killed(endpoint: str, time: list[str]) -> None:
    limits = ["--set", "link.step=1", "--set", "link.silence=1"]
    with command("sim", "corridor", "--listen", endpoint, "--once", *time, *limits, "--set", "robot.name=toy") as sim:
        sim.line()
        with toy("toy_controller", endpoint, "3", "1000000") as controller:
            controller.until("driving")
            controller.send(signal.SIGKILL)
            assert sim.line().startswith("seed 3: ")
            assert sim.end() == 0


# Lockstep: faults at random times


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_frozen_simulator_or_controller_resumes_and_nothing_is_lost(endpoint: str, seed: int) -> None:
    chance = random.Random(seed)
    with toy("toy_world", endpoint, "lockstep") as sim:
        sim.line()
        with toy("toy_controller", endpoint, str(seed), str(STEPS)) as controller:
            controller.until("driving")
            for _ in range(3):
                frozen = chance.choice([sim, controller])
                frozen.send(signal.SIGSTOP)
                time.sleep(chance.uniform(0.0, 0.4))  # how long the fault lasts
                frozen.send(signal.SIGCONT)
            assert controller.line() == undisturbed(seed, STEPS)


def test_a_killed_controller_makes_room_for_the_next(endpoint: str) -> None:
    with toy("toy_world", endpoint, "lockstep") as sim:
        sim.line()
        with toy("toy_controller", endpoint, "1", "100000") as dead:
            dead.until("driving")
            dead.send(signal.SIGKILL)
            dead.end()
        with toy("toy_controller", endpoint, "2", str(STEPS)) as heir:
            heir.until("driving")
            assert heir.line() == undisturbed(2, STEPS)


def test_a_killed_and_restarted_simulator_refuses_the_old_run_and_serves_a_new_one(endpoint: str) -> None:
    with toy("toy_world", endpoint, "lockstep") as sim:
        sim.line()
        with toy("toy_controller", endpoint, "1", "100000") as controller:
            controller.until("driving")
            sim.send(signal.SIGKILL)
            sim.end()
            with toy("toy_world", endpoint, "lockstep") as again:
                again.line()
                assert controller.end() == 1
                assert "restarted" in controller.errors()
                with toy("toy_controller", endpoint, "2", str(STEPS)) as heir:
                    heir.until("driving")
                    assert heir.line() == undisturbed(2, STEPS)


def test_a_router_that_was_restarted_loses_no_step(endpoint: str) -> None:
    with command("router", "--listen", endpoint) as router:
        router.line()
        with toy("toy_world", endpoint, "lockstep@router") as sim:
            sim.line()
            with toy("toy_controller", endpoint, "1", str(STEPS)) as controller:
                controller.until("driving")
                router.send(signal.SIGKILL)
                router.end()
                with command("router", "--listen", endpoint) as again:
                    again.line()
                    assert controller.line() == undisturbed(1, STEPS)


@pytest.mark.parametrize("frozen", [False, True])
def test_one_who_looks_on_and_cannot_keep_up_disturbs_no_step(endpoint: str, frozen: bool) -> None:
    with toy("toy_world", endpoint, "lockstep") as sim:
        sim.line()
        with toy("toy_watcher", endpoint) as watcher:
            watcher.until("ready")
            with toy("toy_controller", endpoint, "1", str(STEPS)) as controller:
                watcher.until("watching")
                if frozen:
                    watcher.send(signal.SIGSTOP)
                controller.until("driving")
                assert controller.line() == undisturbed(1, STEPS)


def faulty(inside: str, outside: str, seed: int) -> object:
    """A network between two endpoints that loses, doubles, delays and damages messages."""
    return toy("faulty_relay", inside, outside, str(seed))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_lost_doubled_late_and_damaged_messages_change_nothing_of_a_run(endpoint: str, other: str, seed: int) -> None:
    with toy("toy_world", other, "lockstep") as sim:
        sim.line()
        with faulty(other, endpoint, seed) as network:
            network.line()
            with toy("toy_controller", endpoint, str(seed), "150") as controller:
                controller.until("driving")
                # Each loss costs four times what an answer takes, which on a busy computer is long.
                assert controller.line(3 * LIMIT) == undisturbed(seed, 150)
            network.send(signal.SIGTERM)
            assert set(ast.literal_eval(network.line())) == {"lost", "doubled", "late", "damaged", "whole"}


@pytest.mark.parametrize("seed", [1, 2])
def test_in_real_time_a_bad_network_lets_nothing_but_valid_commands_through(
    endpoint: str, other: str, seed: int
) -> None:
    with toy("toy_world", other, "realtime") as robot:
        robot.line()
        with faulty(other, endpoint, seed) as network:
            network.line()
            with toy("toy_controller", endpoint, "1"):
                base(robot, moving=True)
                orders = [told(robot) for _ in range(40)]
    moving = [order.twist for order in orders if order.moving]
    assert len(moving) > 10
    assert are_answers(moving)


# Real time: the dead man, whatever happens to the controller


@pytest.mark.parametrize("fault", ["SIGKILL", "SIGSTOP", "SIGUSR1"])
def test_the_robot_stops_when_its_controller_is_killed_frozen_or_hung(endpoint: str, fault: str) -> None:
    bound = LinkSettings().dead_man + PERIOD + SLACK
    with toy("toy_world", endpoint, "realtime") as robot:
        robot.line()
        with toy("toy_controller", endpoint, "1") as controller:
            base(robot, moving=True)
            failed = controller.send(signal.Signals[fault])
            stood = base(robot, moving=False, after=failed)
            assert stood - failed <= bound
            if fault == "SIGKILL":
                controller.end()
                with toy("toy_controller", endpoint, "1"):
                    base(robot, moving=True, after=stood)
            else:
                # One that hangs comes back by itself; to one that runs the signal says nothing.
                controller.send(signal.SIGCONT)
                base(robot, moving=True, after=stood)


def test_the_robot_stops_when_the_router_dies_and_goes_on_when_it_is_back(endpoint: str) -> None:
    with command("router", "--listen", endpoint) as router:
        router.line()
        with toy("toy_world", endpoint, "realtime@router") as robot:
            robot.line()
            with toy("toy_controller", endpoint, "1"):
                base(robot, moving=True)
                failed = router.send(signal.SIGKILL)
                stood = base(robot, moving=False, after=failed)
                assert stood - failed <= LinkSettings().dead_man + PERIOD + SLACK
                router.end()
                with command("router", "--listen", endpoint) as again:
                    again.line()
                    back = time.monotonic()
                    assert base(robot, moving=True, after=stood) - back <= 1.0 + SLACK


def test_a_second_controller_is_told_who_drives_and_disturbs_nobody(endpoint: str) -> None:
    with toy("toy_world", endpoint, "realtime") as robot:
        robot.line()
        with toy("toy_controller", endpoint, "1") as first:
            base(robot, moving=True)
            with toy("toy_controller", endpoint, "1") as second:
                assert second.end() == 1
                assert f"process {first.process.pid}" in second.errors()
            ended = first.send(signal.SIGTERM)
            assert first.end() == 0
            base(robot, moving=False, after=ended)


def test_a_gate_stops_a_driver_that_would_drive_on_for_ever(endpoint: str, other: str) -> None:
    with toy("toy_world", other, "bare") as driver:
        driver.line()
        with command("gate", other, "--listen", endpoint, "--set", "robot.name=toy") as gate:
            assert gate.line() == f"toy behind a gate listens at {endpoint}"
            with toy("toy_controller", endpoint, "1") as controller:
                base(driver, moving=True)
                failed = controller.send(signal.SIGKILL)
                stood = base(driver, moving=False, after=failed)
                assert stood - failed <= LinkSettings().dead_man + SLACK
                controller.end()
            with toy("toy_controller", endpoint, "1"):
                base(driver, moving=True, after=stood)
                ended = gate.send(signal.SIGTERM)
                assert gate.end() == 143
                base(driver, moving=False, after=ended)


def test_a_gate_without_a_driver_says_so(endpoint: str) -> None:
    with command("gate", endpoint, "--set", "link.connect=0.3") as gate:
        assert gate.end() == 4
        assert f"nothing answers at {endpoint}" in gate.errors()


# Real time: what a controller does whose robot is gone


def test_a_frozen_robots_side_is_noticed_and_driven_on_when_it_is_back(endpoint: str) -> None:
    with toy("toy_world", endpoint, "realtime") as robot:
        robot.line()
        with toy("toy_controller", endpoint, "1") as controller:
            base(robot, moving=True)
            robot.send(signal.SIGSTOP)
            controller.until("stale")
            back = robot.send(signal.SIGCONT)
            stood = base(robot, moving=False, after=back)
            base(robot, moving=True, after=stood)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_run_whose_robot_is_gone_ends_with_one_line_and_status_4(endpoint: str, number: signal.Signals) -> None:
    with toy("toy_world", endpoint, "realtime") as robot:
        robot.line()
        limits = ["--set", "robot.name=toy", "--set", "link.silence=1", "--no-picture"]
        with command("run", "pledge", "--connect", endpoint, *limits) as run:
            base(robot, moving=True)
            robot.send(number)
            assert run.end() == 4
            *stopped, last = run.errors().splitlines()
            assert last == "maze-machine: 'toy' has sent no data for 1 s"
            assert all("the base was stopped: no scan for 0." in line for line in stopped)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_gate_that_failed_is_taken_again_when_it_is_back(endpoint: str, other: str, number: signal.Signals) -> None:
    guarded = ["gate", other, "--listen", endpoint, "--set", "robot.name=toy"]
    with toy("toy_world", other, "guarded") as driver, ExitStack() as stack:
        driver.line()
        gate = stack.enter_context(command(*guarded))
        gate.line()
        controller = stack.enter_context(toy("toy_controller", endpoint, "1"))
        base(driver, moving=True)
        failed = gate.send(number)
        stood = base(driver, moving=False, after=failed)
        controller.until("stale")
        if number == signal.SIGSTOP:
            gate.send(signal.SIGCONT)
        else:
            gate.end()
            stack.enter_context(command(*guarded)).line()
        base(driver, moving=True, after=stood)
