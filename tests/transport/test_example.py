"""The robot of one's own in examples/: the session protocol as somebody else would write it."""

from __future__ import annotations

import json
from pathlib import Path

from programs import command, program

from transport.messages import STOP
from transport.session import Ask, Granted, Open, SessionState, read_answer, read_question, written

FILE = Path(__file__).parents[2] / "examples" / "robot.py"


def test_a_machine_drives_it_out_of_its_corridor(endpoint: str) -> None:
    with program(str(FILE), endpoint) as robot:
        assert robot.line() == f"pico listens at {endpoint}"
        with command("run", "right_hand", "--connect", endpoint, "--no-picture") as run:
            assert run.line().startswith("right_hand: the machine ended in `outside` after 8.")
            assert run.end() == 0


def test_it_needs_no_code_of_this_project() -> None:
    text = FILE.read_text(encoding="utf-8")
    assert "from transport" not in text
    assert "import numpy" not in text
    assert len([line for line in text.splitlines() if line.strip()]) <= 100


def test_fields_that_are_not_known_are_ignored() -> None:
    for part, read in (
        (Open(request="a", controller="me"), read_question),
        (Ask(secret="00"), read_question),
        (SessionState(held=True), read_answer),
        (Granted(epoch=1, secret="00", robot="pico", mode="lockstep", period=0.1), read_answer),
    ):
        fields = json.loads(written(part).rpartition(b"\n")[0]) | {"maker": {"name": "somebody"}, "speed": STOP.speed}

        class Longer(type(part)):  # what a later version, or somebody else, may send
            maker: dict[str, str]
            speed: float

        assert read(written(Longer.model_validate(fields))) == part
