"""Campaigns: complete, resumable, and the same whoever does the work."""

import json
import multiprocessing
import os
import resource
import signal
import socket
import sys
import time
from pathlib import Path

import pytest

from maze_machine.campaign.cluster import on_cluster
from maze_machine.campaign.jobs import Job, Setup, jobs_of, run_job
from maze_machine.campaign.results import Results
from maze_machine.campaign.summary import failures
from maze_machine.campaign.workers import on_cores
from maze_machine.errors import FileError
from maze_machine.simulated.choices import MazeWords
from transport.files import locked

SETUP = Setup(time_limit=4.0)
WAY = 4.55
"""The shortest way through the maze `corridor`, m."""
LIMIT = 60.0
DASK = sys.executable, "-m", "dask"


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
    for record in records:
        assert (record["shortest"], record["bound"]) == pytest.approx((WAY, WAY / 0.5))
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
    with pytest.raises(FileError, match=r"mine.maze before it was changed"):
        Results(file, SETUP, jobs)
    file.write_text("something else\n")
    with pytest.raises(FileError, match="no results"):
        Results(file, SETUP, jobs)


def test_a_maze_that_cannot_be_solved_is_a_result_and_no_failure_of_the_campaign(no_exit):
    record = run_job(SETUP, Job("pledge", str(no_exit), 0))
    assert record["solved"] is False
    assert str(no_exit) in record["refused"]
    assert failures([record]) == [f"1 x maze refused, such as {record['refused']}"]


def test_a_goal_without_a_place_has_no_shortest_way(no_exit):
    record = run_job(Setup(time_limit=0.5, maze=MazeWords(goal="none")), Job("pledge", str(no_exit), 0))
    assert "shortest" not in record
    assert "bound" not in record


def test_what_is_chosen_of_the_mazes_is_part_of_the_setup(no_exit, tmp_path):
    closed = Setup(time_limit=2.0, maze=MazeWords(goal="none"))
    record = run_job(closed, Job("pledge", str(no_exit), 0))
    assert record["solved"] is True
    jobs = [Job("pledge", str(no_exit), 0)]
    Results(tmp_path / "r.jsonl", closed, jobs)
    with pytest.raises(FileError, match="another setup"):
        Results(tmp_path / "r.jsonl", Setup(time_limit=2.0), jobs)


def test_a_map_whose_image_has_changed_is_another_maze(tmp_path):
    rooms = Path(__file__).parents[1] / "sim" / "mazes"
    for suffix in (".yaml", ".pgm"):
        (tmp_path / f"rooms{suffix}").write_bytes((rooms / f"rooms{suffix}").read_bytes())
    jobs = jobs_of(["pledge"], [str(tmp_path)], 1)
    assert [job.maze for job in jobs] == [str(tmp_path / "rooms.yaml")], "a description stands for its image"
    Results(tmp_path / "r.jsonl", SETUP, jobs)
    image = tmp_path / "rooms.pgm"
    image.write_bytes(image.read_bytes()[:-1] + b"\0")
    with pytest.raises(FileError, match=r"rooms\.yaml before it was changed"):
        Results(tmp_path / "r.jsonl", SETUP, jobs)


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


class Deadly(str):
    """A machine's name that kills every worker that receives it."""

    def __reduce__(self):
        in_worker = "__import__('multiprocessing').parent_process()"
        return eval, (f"{in_worker} and __import__('os').abort() or {str(self)!r}",)

    def __deepcopy__(self, _):
        return str(self)


def test_a_job_that_always_kills_its_process_is_a_result_and_the_others_are_done():
    good = jobs_of(["right_hand"], ["corridor"], 2)
    jobs = [good[0], Job(Deadly("deadly"), "corridor", 0), good[1]]
    with on_cores(Setup(time_limit=1.0), jobs, 1) as done:
        records = {(record["machine"], record["seed"]): record for record in done}
    assert records[("deadly", 0)] == {
        "machine": "deadly",
        "maze": "corridor",
        "seed": 0,
        "solved": False,
        "outcome": "crashed",
        "reason": "the process was killed by SIGABRT",
    }
    assert [records[("right_hand", seed)]["outcome"] for seed in (0, 1)] == ["still inside", "still inside"]
    assert failures(records.values())[-1].startswith("1 x deadly: crashed, such as corridor with seed 0")


def test_a_fault_of_the_program_is_a_result_too(monkeypatch):
    def fails(*_):
        raise ZeroDivisionError("somewhere")

    monkeypatch.setattr("maze_machine.campaign.jobs.drive", fails)
    record = run_job(SETUP, Job("pledge", "corridor", 0))
    assert (record["outcome"], record["reason"]) == ("crashed", "ZeroDivisionError: somewhere")


def children_of(pid):
    return [int(one) for one in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def workers_of(sweep):
    deadline = time.monotonic() + LIMIT
    while True:
        assert time.monotonic() < deadline
        assert sweep.poll() is None, sweep.stderr.read()
        servers = [pid for pid in children_of(sweep.pid) if b"forkserver" in Path(f"/proc/{pid}/cmdline").read_bytes()]
        found = [worker for server in servers for worker in children_of(server)]
        if found:
            return found
        time.sleep(0.01)


def test_a_worker_that_is_killed_costs_no_result(start, tmp_path):
    file = tmp_path / "r.jsonl"
    arguments = ["sweep", "--machines", "right_hand", "--mazes", "corridor", "--seeds", 6, "--time-limit", 3]
    sweep = start(*arguments, "--workers", 1, "--out", file)
    deadline = time.monotonic() + LIMIT
    while not file.exists() or file.read_text().count("\n") < 2:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    for worker in workers_of(sweep):
        os.kill(worker, signal.SIGKILL)
    _, err = sweep.communicate(timeout=LIMIT)
    assert (sweep.returncode, err) == (1, "")
    records = [json.loads(line) for line in file.read_text().splitlines()[1:]]
    assert [record["seed"] for record in records] == list(range(6))
    assert {record["outcome"] for record in records} == {"still inside"}


def test_workers_end_with_a_parent_that_is_killed(start, tmp_path):
    sweep = start(
        "sweep", "--machines", "pledge", "--mazes", "corridor", "--seeds", 500, "--workers", 2, "--out", tmp_path / "r"
    )
    workers = workers_of(sweep)
    sweep.kill()
    deadline = time.monotonic() + LIMIT
    for worker in workers:
        while Path(f"/proc/{worker}").exists() and "Z" not in Path(f"/proc/{worker}/stat").read_text().split()[2]:
            assert time.monotonic() < deadline
            time.sleep(0.01)


def test_a_second_sweep_into_one_file_is_refused_with_the_name_of_the_first(finish, tmp_path):
    file = tmp_path / "r.jsonl"
    arguments = ["sweep", "--machines", "right_hand", "--mazes", "corridor", "--time-limit", 1, "--out", file]
    link = tmp_path / "link.jsonl"
    link.symlink_to(file)
    with locked(file, "host, process 7"):
        for name in (file, link):
            status, _, err = finish(*arguments[:-1], name)
            assert status == 3
            assert "is being written by host, process 7" in err
            assert len(err.splitlines()) == 1
        assert not file.exists()
    assert finish(*arguments)[0] == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.jsonl", "r.jsonl"]


GOOD = {"machine": "pledge", "maze": "corridor", "seed": 0, "solved": False, "outcome": "fault", "reason": "x"}


@pytest.mark.parametrize(
    "line",
    [
        "[]",
        "{}",
        "nothing",
        "[" * 100_000,
        json.dumps({**GOOD, "machine": 1}),
        json.dumps({**GOOD, "seed": -1}),
        json.dumps({**GOOD, "solved": True}),
        json.dumps({**GOOD, "reason": None}),
        json.dumps({**GOOD, "clearance": "near"}),
    ],
    ids=range(9),
)
def test_a_damaged_results_file_is_refused_and_left_alone(tmp_path, line):
    file = tmp_path / "results.jsonl"
    jobs = jobs_of(["pledge"], ["corridor"], 1)
    results = Results(file, SETUP, jobs)
    results.add(GOOD)
    assert Results(file, SETUP, jobs).records == [GOOD]
    for text in (file.read_text() + line + "\n", line + "\n" + json.dumps(GOOD) + "\n", "\0" * 100):
        file.write_text(text)
        with pytest.raises(FileError, match="holds no results of a campaign, or damaged ones"):
            Results(file, SETUP, jobs)
        assert file.read_text() == text
        Results(file.with_name("new.jsonl"), SETUP, jobs)
        file.with_name("new.jsonl").replace(file)
        Results(file, SETUP, jobs).add(GOOD)


def test_a_full_disk_costs_the_result_that_did_not_fit_and_none_before(tmp_path):
    file = tmp_path / "results.jsonl"
    jobs = jobs_of(["pledge"], ["corridor"], 3)
    results = Results(file, SETUP, jobs)
    results.add(GOOD)
    before = file.read_bytes()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 20, hard))
    try:
        with pytest.raises(OSError, match=r"File too large|No space left") as caught:
            results.add({**GOOD, "seed": 1})
        with pytest.raises(OSError, match="File too large"):
            results.write()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert caught.value.filename == str(file)
    assert file.read_bytes() == before
    assert Results(file, SETUP, jobs).records == [GOOD]


@pytest.fixture
def cluster(start):
    """Start a scheduler, which listens then, and workers of dask, and their address."""
    pytest.importorskip("distributed")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"

    def scheduler():
        process = start("scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard", program=DASK)
        deadline = time.monotonic() + LIMIT
        with socket.socket() as probe:
            while probe.connect_ex(("127.0.0.1", port)):
                assert time.monotonic() < deadline
                assert process.poll() is None, process.stderr.read()
                time.sleep(0.02)
        return process

    def worker():
        return start("worker", address, "--host", "127.0.0.1", "--nthreads", 1, "--no-dashboard", program=DASK)

    return address, scheduler, worker


def test_a_cluster_gives_the_same_results(finish, cluster, tmp_path):
    address, scheduler, worker = cluster
    scheduler()
    worker()
    worker()
    arguments = ["sweep", "--machines", "pledge", "--mazes", "corridor", "--seeds", 3]
    status, out, err = finish(*arguments, "--scheduler", address, "--out", "cluster.jsonl")
    assert (status, err) == (0, ""), out
    assert finish(*arguments, "--workers", 1, "--out", "here.jsonl")[0] == 0
    assert (tmp_path / "cluster.jsonl").read_bytes() == (tmp_path / "here.jsonl").read_bytes()


def test_a_scheduler_and_a_worker_that_are_killed_cost_no_result(start, finish, cluster, tmp_path):
    address, scheduler, worker = cluster
    first = scheduler()
    workers = [worker(), worker()]
    file = tmp_path / "cluster.jsonl"
    arguments = ["sweep", "--machines", "right_hand", "--mazes", "corridor", "--seeds", 30, "--time-limit", 4]
    sweep = start(*arguments, "--scheduler", address, "--out", file)

    def lines():
        return file.read_text().count("\n") if file.exists() else 0

    def wait_for(end):
        """Wait as long as there is progress: a busy computer takes any time for all of it."""
        before, deadline = lines(), time.monotonic() + LIMIT
        while not end():
            assert time.monotonic() < deadline
            time.sleep(0.01)
            if lines() > before:
                before, deadline = lines(), time.monotonic() + LIMIT

    wait_for(lambda: lines() >= 3 or sweep.poll() is not None)
    assert sweep.poll() is None, sweep.stderr.read()
    os.killpg(workers[0].pid, signal.SIGKILL)
    first.kill()
    first.wait()
    scheduler()
    worker()
    wait_for(lambda: sweep.poll() is not None)
    _, err = sweep.communicate(timeout=LIMIT)
    assert (sweep.returncode, err) == (1, "")
    assert finish(*arguments, "--workers", 2, "--out", "here.jsonl")[0] == 1
    assert file.read_bytes() == (tmp_path / "here.jsonl").read_bytes()


def test_a_job_that_kills_every_worker_of_a_cluster_is_a_result(cluster):
    address, scheduler, worker = cluster
    scheduler()
    worker()
    good = jobs_of(["right_hand"], ["corridor"], 1)
    with on_cluster(Setup(time_limit=1.0), [*good, Job(Deadly("deadly"), "corridor", 0)], address) as done:
        records = {record["machine"]: record for record in done}
    assert records["right_hand"]["outcome"] == "still inside"
    assert records["deadly"]["outcome"] == "crashed"


def test_columns_that_cannot_be_written_do_not_end_in_advice_about_room(finish, tmp_path):
    pytest.importorskip("pyarrow")
    arguments = ["sweep", "--machines", "pledge", "--mazes", "corridor", "--time-limit", 0.2, "--out", "r.jsonl"]
    status, _, err = finish(*arguments, "--columns", tmp_path)
    assert (status, err.count("\n")) == (3, 1)
    assert "Is a directory; start the sweep again, and it continues here" in err


def test_a_result_that_is_lost_on_its_way_is_computed_again(cluster, monkeypatch):
    address, scheduler, worker = cluster
    scheduler()
    worker()
    fetch, cuts = sys.modules["distributed.client"].retry_operation, [OSError("the scheduler was lost")]

    async def cut_once(*args, **kwargs):
        if cuts:
            raise cuts.pop()
        return await fetch(*args, **kwargs)

    monkeypatch.setattr("distributed.client.retry_operation", cut_once)
    jobs = jobs_of(["right_hand"], ["corridor"], 2)
    with on_cluster(Setup(time_limit=1.0), jobs, address) as done:
        assert [record["outcome"] for record in done] == ["still inside"] * 2
    assert not cuts


def test_no_scheduler_at_the_address(finish):
    pytest.importorskip("distributed")
    status, _, err = finish(
        "sweep", "--machines", "pledge", "--mazes", "corridor", "--scheduler", "tcp://127.0.0.1:9", "--out", "r.jsonl"
    )
    assert status == 4
    assert "no scheduler at tcp://127.0.0.1:9" in err
    assert "Traceback" not in err
