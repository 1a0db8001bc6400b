"""The main job: a machine drives a simulated robot out of a maze, in one process and in two."""

import json
import signal

import pytest

from maze_machine.catalogue.machines import shipped_machines

LIMIT = 60.0


def test_with_no_option_the_robot_leaves_the_challenge_maze(finish, tmp_path):
    status, out, err = finish("run", "pledge")
    assert (status, err) == (0, "")
    assert out.startswith("pledge in final of 2015, seed 0: out of the maze after ")
    for told in ("time", "path length", "smallest distance to a wall", "doors opened", "picture"):
        assert f"\n  {told} " in out
    pictures = list((tmp_path / "runs").iterdir())
    assert [str(one.relative_to(tmp_path)) in out for one in pictures] == [True]
    assert pictures[0].read_bytes().startswith(b"\x89PNG")


def test_the_result_is_there_for_programs(finish, tmp_path):
    status, out, _ = finish("run", "pledge", "--seed", "1", "--json", "--picture", "run.svg")
    result = json.loads(out)
    assert status == 0
    assert result["solved"] is True
    assert result["verdict"]["seed"] == 1
    assert result["verdict"]["contacts"] == []
    assert result["verdict"]["doors_opened"] == ["front"]
    assert result["verdict"]["clearance"] > 0.1
    assert 0 < result["longest_tick"] < 60
    assert result["files"] == {"picture": "run.svg"}
    assert (tmp_path / "run.svg").exists()


def test_a_run_that_does_not_leave_the_maze_fails(finish, tmp_path):
    status, out, _ = finish("run", "pledge", "--time-limit", "3", "--no-picture")
    assert status == 1
    assert "failed: still inside (the time limit of 3 s was reached)" in out
    assert list(tmp_path.iterdir()) == []


def test_a_copied_and_changed_machine_runs(finish, tmp_path):
    for name, path in shipped_machines().items():
        (tmp_path / f"{name}.maze-machine").write_text(path.read_text())
    mine = tmp_path / "my.maze-machine"
    changed = (
        shipped_machines()["pledge"].read_text().replace("machine pledge", "machine my").replace("0.5 m/s", "0.3 m/s")
    )
    mine.write_text(changed)
    status, out, _ = finish("run", mine, "--no-picture")
    assert status == 0
    assert out.startswith("my in final of 2015")


def test_two_processes_give_the_same_trace_as_one_byte_for_byte(simulator, finish, tmp_path):
    process, endpoint = simulator("final_2015", "--once")
    status, out, err = finish(
        "run", "pledge", "--connect", endpoint, "--seed", "7", "--trace", "two.jsonl", "--no-picture"
    )
    assert (status, err) == (0, "")
    assert process.wait(LIMIT) == 0
    assert "seed 7: escaped" in process.stdout.read()
    alone, told, _ = finish("run", "pledge", "--seed", "7", "--trace", "one.jsonl", "--no-picture")
    assert alone == 0
    assert told.splitlines()[:5] == out.splitlines()[:5]
    one, two = (tmp_path / "one.jsonl").read_bytes(), (tmp_path / "two.jsonl").read_bytes()
    assert one.count(b"\n") > 500
    assert one == two


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_run_that_is_interrupted_lets_go_of_the_robot_first(simulator, driving, finish, number, status):
    _, endpoint = simulator("final_2015")
    run = driving("pledge", "--connect", endpoint)
    run.send_signal(number)
    _, err = run.communicate(timeout=LIMIT)
    assert run.returncode == status
    assert len(err.splitlines()) == 1
    # The simulator takes the next controller at once: the lease was given back.
    ended, out, err = finish("run", "pledge", "--connect", endpoint, "--time-limit", "1", "--no-picture")
    assert (ended, err) == (1, "")
    assert "time limit" in out


def test_a_run_alone_can_be_interrupted(driving):
    run = driving("pledge")
    run.send_signal(signal.SIGINT)
    out, err = run.communicate(timeout=LIMIT)
    assert (run.returncode, out, err) == (130, "", "maze-machine: interrupted\n")
