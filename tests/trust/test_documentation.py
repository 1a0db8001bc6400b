"""What the how-to page shows works."""

import re
from pathlib import Path

from hsm.dsl import parse_model
from hsm.testing.generation.generating import generate
from hsm.testing.proofs.proving import check
from hsm.testing.requirements.matrix import Standing, matrix
from hsm.testing.scenarios.driver import Driver
from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.running import run_suite
from maze_machine.catalogue.library import robot_library

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "testing.md").read_text(encoding="utf-8")


def blocks(kind):
    return re.findall(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL)


def test_the_example():
    library = robot_library()
    (machine,), (first, second) = blocks("maze-machine"), blocks("maze-test")
    model = parse_model(machine, library, "ring.maze-machine")
    suites = [parse_suite(text, model, library) for text in (first, second)]
    results = [result for suite in suites for result in run_suite(suite, model)]
    verdicts = check(model)
    assert all(result.passed for result in results)
    assert all(verdict.proved for verdict in verdicts)
    standing = [(row.requirement.name, row.standing) for row in matrix(model, suites, results, verdicts).rows]
    assert standing == [("R1", Standing.MET), ("R2", Standing.UNCOVERED), ("R3", Standing.MET)]
    assert not generate(model).unreached
    driver = Driver(model, signals={"door.near": True})
    driver.step(reports={"ring": "refused"})
    assert driver.outcome == "stuck"
