from pathlib import Path
from textwrap import dedent

import pytest

from hsm.dsl import parse_model
from hsm.engine.machine import Machine
from hsm.model.registry import Library
from hsm.testing.scenarios.tested_machine import TestedMachine, load_tested_machine
from tests.trust.library import make_library

MACHINES = Path(__file__).parent / "machines"


@pytest.fixture(scope="session")
def library() -> Library:
    return make_library()


@pytest.fixture(scope="session")
def walker(library) -> TestedMachine:
    return load_tested_machine(MACHINES / "walker.maze-machine", library)


@pytest.fixture
def machine_of(library):
    """A machine from its text; lines may be indented."""
    return lambda text: Machine(parse_model(f"machine m\n{dedent(text)}", library, "m.maze-machine"))
