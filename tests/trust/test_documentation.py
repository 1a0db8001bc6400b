"""What the how-to page shows works."""

import re
from pathlib import Path

from hsm.dsl import parse_model
from hsm.testing.generation.generating import generate
from hsm.testing.proofs.proving import check
from hsm.testing.scenarios.driver import Driver
from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.running import run_suite
from maze_machine.catalogue.library import robot_library

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "testing.md").read_text(encoding="utf-8")


def blocks(kind):
    return re.findall(rf"```{kind}\n(.*?)```", PAGE, re.DOTALL)


def test_the_example():
    library = robot_library()
    (machine,), (suite,) = blocks("maze-machine"), blocks("maze-test")
    model = parse_model(machine, library, "ring.maze-machine")
    assert all(result.passed for result in run_suite(parse_suite(suite, model, library), model))
    assert all(verdict.proved for verdict in check(model))
    assert not generate(model).unreached
    driver = Driver(model, signals={"door.near": True})
    driver.step(reports={"ring": "refused"})
    assert driver.outcome == "stuck"
