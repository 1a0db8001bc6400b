"""The pytest plugin, run in a pytest of its own."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

MACHINES = Path(__file__).parents[2] / "machines"

TESTS = """
def test_driven(drive_machine):
    driver = drive_machine("door.maze-machine")
    driver.step(reports={"rotate": "done"})
    driver.step(reports={"ring": "refused"})
    assert driver.outcome == "stayed_shut"


def test_loaded(load_machine):
    assert load_machine("door.maze-machine").name == "door"


def test_in_a_maze(run_in_maze):
    ending = run_in_maze("right_hand", "corridor", time_limit=1)
    assert ending.ticks >= 10
    there = run_in_maze("right_hand", "corridor", time_limit=9, start="0.5 0.5 90", goal="0.5 1.2 0.2")
    assert there.report["solved"] and there.duration < 5
"""


@pytest.fixture
def project(tmp_path):
    shutil.copy(MACHINES / "door.maze-machine", tmp_path)
    shutil.copy(MACHINES / "door.maze-test", tmp_path)
    (tmp_path / "test_driven.py").write_text(TESTS)
    return tmp_path


def run(project, *options):
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-q", *options]
    return subprocess.run(command, cwd=project, capture_output=True, text=True, timeout=120, check=False)


def test_scenarios_properties_fixtures_and_reports(project):
    options = ("--machine-coverage", "--machine-coverage-html=report", "--machine-coverage-lcov=lcov.info")
    done = run(project, "-n", "2", "-vv", *options, "--machine-coverage-cobertura=cobertura.xml")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "door.maze-test::too early for facing: after square -> ringing" in done.stdout
    assert "door.maze-test::property patient" in done.stdout
    row = next(line for line in done.stdout.splitlines() if line.startswith("door.maze-machine"))
    assert row.split()[1:4] == ["5/5", "8/8", "4/4"]
    assert row.endswith("100%")
    assert (project / "report" / "door.html").is_file()
    assert "SF:" in (project / "lcov.info").read_text()
    assert "<coverage" in (project / "cobertura.xml").read_text()


def test_too_little_coverage_fails(project):
    done = run(project, "-k", "driven", "--machine-coverage-fail-under=90")
    assert done.returncode == 1
    assert "is under 90%" in done.stdout


def test_data_of_two_processes_add_up(project):
    run(project, "-k", "loaded or 1:", "--machine-coverage")
    done = run(project, "-k", "not 1:", "--machine-coverage", "--machine-coverage-append")
    row = next(line for line in done.stdout.splitlines() if line.startswith("door.maze-machine"))
    assert row.endswith("100%")


def test_failures_tell_the_step_and_a_violation_shows_a_run(project):
    text = (project / "door.maze-machine").read_text()
    (project / "door.maze-machine").write_text(text.replace("when door.open ", "when not door.open "))
    done = run(project)
    assert done.returncode == 1
    assert "door.maze-test:" in done.stdout
    assert "door.open` was" in done.stdout
    (project / "door.maze-machine").write_text(
        text.replace("on accepted", "on refused").replace(
            "property rung", "property bad : never in(waiting)\nproperty rung"
        )
    )
    assert "property bad" in run(project).stdout


def test_a_file_that_cannot_be_read_is_an_error_with_its_place(project):
    (project / "door.maze-test").write_text("test door\nscenario s\n    expect nowhere\n")
    done = run(project)
    assert done.returncode != 0
    assert "door.maze-test:3:12" in done.stdout
