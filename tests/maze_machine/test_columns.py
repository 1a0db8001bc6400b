"""The results of a campaign as columns: the same results, in the same order, with the same summary."""

import json

import duckdb
import pandas
import pytest
from typer.testing import CliRunner

from maze_machine.campaign.columns import GROUP, columns_in, summary_of_columns
from maze_machine.campaign.summary import summary
from maze_machine.cli import app
from maze_machine.errors import FileError

HEAD = {"setup": {}, "files": {}}
RECORDS = [
    {"machine": f"m{seed % 3}", "maze": "hall.maze", "seed": seed, "solved": seed % 4 != 1}
    | {"outcome": "escaped" if seed % 4 != 1 else "stood still", "reason": "it says why", "time": 7.5 * seed}
    | {"path_length": 0.1 * seed, "clearance": 1 / (seed + 1), "doors_opened": [], "contacts": ["wall"] * (seed % 2)}
    for seed in range(50)
]
REFUSED = {"machine": "m0", "maze": "no.maze", "seed": 0, "solved": False, "refused": "there is no start"}
FAULTY = {"machine": "m1", "maze": "hall.maze", "seed": 99, "solved": False, "outcome": "fault", "reason": "it fails"}


@pytest.fixture
def both(tmp_path):
    """The same results as lines and as columns."""
    records = [*RECORDS, REFUSED, FAULTY]
    lines, columns = tmp_path / "runs.jsonl", tmp_path / "runs.parquet"
    lines.write_text("".join(json.dumps(one) + "\n" for one in (HEAD, *records)))
    with columns_in(columns) as write:
        write(records[:20])
        write(records[20:])
    return records, lines, columns


def shown(file):
    done = CliRunner().invoke(app, ["sweep", "show", str(file), "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.output)


def test_the_summary_is_that_of_the_lines(both):
    records, lines, columns = both
    of_lines, of_columns = shown(lines), shown(columns)
    for one, other in zip(of_lines["machines"], of_columns["machines"], strict=True):
        assert one == pytest.approx(other)
    assert sorted(one.partition(",")[0] for one in of_lines["failures"]) == sorted(of_columns["failures"])
    assert summary_of_columns(columns)[0][0].machine == summary(records)[0].machine


def test_pandas_and_duckdb_read_them(both):
    records, _, columns = both
    frame = pandas.read_parquet(columns)
    assert frame["seed"].tolist() == [one["seed"] for one in records]
    assert frame["time"].dropna().tolist() == [one["time"] for one in RECORDS]
    query = f"select count(*), min(clearance) from '{columns}' where solved and len(contacts) = 0"
    clear = [one for one in RECORDS if one["solved"] and not one["contacts"]]
    assert duckdb.sql(query).fetchall() == [(len(clear), min(one["clearance"] for one in clear))]


def test_more_results_than_are_kept_in_memory_are_all_there(tmp_path):
    with columns_in(tmp_path / "many.parquet") as write:
        write({**RECORDS[0], "seed": seed} for seed in range(GROUP + 10))
    assert [row.runs for row in summary_of_columns(tmp_path / "many.parquet")[0]] == [GROUP + 10]


def test_a_sweep_writes_and_resumes_them(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    runs = ["--machines", "right_hand", "--mazes", "corridor", "--time-limit", "1", "--out", "runs.jsonl"]
    for seeds in ("1", "3"):
        CliRunner().invoke(app, ["sweep", *runs, "--seeds", seeds, "--columns", "runs.parquet"])
        lines = (tmp_path / "runs.jsonl").read_text().splitlines()[1:]
        frame = pandas.read_parquet("runs.parquet")
        assert frame["path_length"].tolist() == [json.loads(line)["path_length"] for line in lines]
        assert len(frame) == int(seeds)


def test_only_earlier_results_are_replaced(tmp_path):
    text, table = tmp_path / "thesis.tex", tmp_path / "other.parquet"
    text.write_text("years of work")
    pandas.DataFrame({"seed": [1], "name": ["other"]}).to_parquet(table)
    for file in (text, table):
        before = file.read_bytes()
        with pytest.raises(FileError, match="does not contain the results of a campaign"), columns_in(file):
            pass
        assert file.read_bytes() == before


@pytest.mark.parametrize("content", [b"", b"{}\n", b"PAR1 and nothing else", b"PAR1" + bytes(100) + b"PAR1"])
def test_a_file_without_results_is_refused_in_one_line(tmp_path, content):
    file = tmp_path / "odd"
    file.write_bytes(content)
    done = CliRunner().invoke(app, ["sweep", "show", str(file)])
    assert done.exit_code == 3
    assert "does not contain the results of a campaign" in done.output


def test_what_breaks_off_leaves_no_half_file(tmp_path):
    with pytest.raises((TypeError, ValueError), match="late"), columns_in(tmp_path / "runs.parquet") as write:
        write([*RECORDS, {**FAULTY, "time": "late"}])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("given", [["--out", "one", "--columns", "one"], ["--out", "two", "--columns", "a.maze"]])
def test_columns_do_not_replace_what_the_sweep_reads_or_writes(tmp_path, monkeypatch, given):
    monkeypatch.chdir(tmp_path)
    for name in ("one", "a.maze"):
        (tmp_path / name).write_text("kept")
    done = CliRunner().invoke(app, ["sweep", "--machines", "pledge", "--mazes", "a.maze", *given])
    assert done.exit_code == 2, done.output
    assert "would overwrite" in done.stderr or "are the same file" in done.stderr
    assert [(tmp_path / name).read_text() for name in ("one", "a.maze")] == ["kept", "kept"]
