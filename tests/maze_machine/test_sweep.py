"""Campaigns: complete, resumable, and the same whoever does the work."""

import json
import multiprocessing
import os
import signal
import socket
import time

import pytest

from maze_machine.campaign.jobs import Job, Results, Setup, jobs_of, run_job
from maze_machine.campaign.summary import failures
from maze_machine.campaign.workers import on_cores
from maze_machine.errors import FileError

SETUP = Setup(time_limit=4.0)
LIMIT = 60.0


@pytest.fixture
def no_exit(tmp_path):
    file = tmp_path / "mazes" / "box.maze"
    file.parent.mkdir()
    file.write_text("start 1 1 0\nwall 0 0  2 0  2 2  0 2  0 0\n")
    return file


def test_the_jobs_are_all_combinations_in_order(tmp_path):
    for name in ("b.maze", "a.num", "notes.md"):
        (tmp_path / name).write_text("")
    jobs = jobs_of(["pledge"], ["corridor", str(tmp_path)], 2)
    mazes = ["corridor", str(tmp_path / "a.num"), str(tmp_path / "b.maze")]
    assert jobs == [Job("pledge", maze, seed) for maze in mazes for seed in (0, 1)]


def test_names_that_stand_for_nothing_are_told_before_anything_runs(tmp_path):
    for machines, mazes in ((["plegde"], ["corridor"]), (["pledge"], ["nowhere"]), (["pledge"], [str(tmp_path)])):
        with pytest.raises(FileError):
            jobs_of(machines, mazes, 1)


def test_the_results_do_not_depend_on_the_number_of_workers(tmp_path):
    jobs = jobs_of(["pledge"], ["corridor"], 2)
    texts = set()
    for workers in (1, 2):
        results = Results(tmp_path / f"{workers}.jsonl", SETUP, jobs)
        with on_cores(SETUP, results.open_jobs, workers) as done:
            for record in done:
                results.add(record)
        results.write()
        texts.add((tmp_path / f"{workers}.jsonl").read_bytes())
    assert len(texts) == 1
    assert len(texts.pop().splitlines()) == 1 + len(jobs)


def test_an_interrupted_campaign_is_taken_up_where_it_was(tmp_path):
    file = tmp_path / "results.jsonl"
    jobs = jobs_of(["pledge"], ["corridor"], 3)
    records = [run_job(SETUP, job) for job in jobs]
    results = Results(file, SETUP, jobs)
    results.add(records[2])
    results.add(records[0])
    file.write_text(file.read_text() + json.dumps(records[1])[:40])  # the power went off while this was written
    again = Results(file, SETUP, jobs)
    assert again.open_jobs == [jobs[1]]
    again.add(records[1])
    again.write()
    assert again.records == records
    assert Results(file, SETUP, jobs[:1]).records == records[:1]
    assert len(file.read_text().splitlines()) == 4, "results of jobs that are not asked for now are kept"


def test_results_of_another_setup_or_of_a_changed_maze_are_not_mixed(tmp_path):
    maze = tmp_path / "mine.maze"
    maze.write_text("start 1 1 0\nwall 0 0 3 0\n")
    file = tmp_path / "results.jsonl"
    jobs = jobs_of(["pledge"], [str(maze)], 1)
    Results(file, SETUP, jobs)
    with pytest.raises(FileError, match="another setup"):
        Results(file, Setup(), jobs)
    maze.write_text("start 1 1 0\nwall 0 0 4 0\n")
    with pytest.raises(FileError, match=r"mine.maze as it was before a change"):
        Results(file, SETUP, jobs)
    file.write_text("something else\n")
    with pytest.raises(FileError, match="no results"):
        Results(file, SETUP, jobs)


def test_a_maze_that_cannot_be_solved_is_a_result_and_no_failure_of_the_campaign(no_exit):
    record = run_job(SETUP, Job("pledge", str(no_exit), 0))
    assert record["solved"] is False
    assert str(no_exit) in record["refused"]
    assert failures([record]) == [f"1 x maze refused, such as {record['refused']}"]


def test_from_the_command_line(finish, tmp_path):
    arguments = [
        "sweep",
        "--machines",
        "pledge",
        "--mazes",
        "corridor",
        "--seeds",
        2,
        "--workers",
        1,
        "--out",
        "r.jsonl",
    ]
    status, out, err = finish(*arguments)
    assert (status, err) == (0, "")
    assert "100.0%" in out
    before = (tmp_path / "r.jsonl").read_bytes()
    assert finish(*arguments) == (0, out, "")
    assert (tmp_path / "r.jsonl").read_bytes() == before


def test_machines_and_mazes_may_be_named_one_by_one_and_the_result_read_by_a_program(finish, tmp_path, no_exit):
    names = ["--machines", "pledge", "--machines", "right_hand", "--mazes", "corridor", "--mazes", str(no_exit)]
    status, out, _ = finish("sweep", *names, "--time-limit", "1", "--out", tmp_path / "results.jsonl", "--json")
    assert status == 1
    told = json.loads(out)
    assert [(row["machine"], row["runs"], row["solved"]) for row in told["machines"]] == [
        ("pledge", 1, 0),
        ("right_hand", 1, 0),
    ]
    assert told["machines"][0]["time"] is None
    assert told["machines"][0]["clearance"] > 0
    assert "2 x maze refused" in told["failures"][0]


def test_ctrl_c_keeps_what_is_done_and_leaves_no_process(start, tmp_path):
    file = tmp_path / "r.jsonl"
    sweep = start("sweep", "--machines", "pledge", "--mazes", "corridor", "--seeds", 500, "--workers", 1, "--out", file)
    deadline = time.monotonic() + LIMIT
    while not file.exists() or file.read_text().count("\n") < 2:
        assert time.monotonic() < deadline
        assert sweep.poll() is None
        time.sleep(0.01)
    sweep.send_signal(signal.SIGINT)
    _, err = sweep.communicate(timeout=LIMIT)  # ends only when no child holds the pipes any more
    assert (sweep.returncode, err) == (130, "maze-machine: interrupted\n")
    assert file.read_text().count("\n") >= 2


def test_who_stops_taking_results_leaves_no_process():
    with on_cores(SETUP, jobs_of(["pledge"], ["corridor"], 500), 2) as done:
        assert next(done)["machine"] == "pledge"
        workers = [process.pid for process in multiprocessing.active_children()]
        assert len(workers) == 2
    for worker in workers:
        with pytest.raises(ProcessLookupError):
            os.kill(worker, 0)


def test_a_cluster_gives_the_same_results(finish, start, tmp_path):
    pytest.importorskip("distributed")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    start("scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard", program="dask")
    for _ in range(2):
        start("worker", address, "--host", "127.0.0.1", "--nthreads", 1, "--no-dashboard", program="dask")
    arguments = ["sweep", "--machines", "pledge", "--mazes", "corridor", "--seeds", 3]
    assert finish(*arguments, "--scheduler", address, "--out", "cluster.jsonl")[0] == 0
    assert finish(*arguments, "--workers", 1, "--out", "here.jsonl")[0] == 0
    assert (tmp_path / "cluster.jsonl").read_bytes() == (tmp_path / "here.jsonl").read_bytes()


def test_no_scheduler_at_the_address(finish):
    pytest.importorskip("distributed")
    status, _, err = finish(
        "sweep", "--machines", "pledge", "--mazes", "corridor", "--scheduler", "tcp://127.0.0.1:9", "--out", "r.jsonl"
    )
    assert status == 4
    assert "no scheduler at tcp://127.0.0.1:9" in err
    assert "Traceback" not in err
