"""The shipped machines as files: without faults, and telling whose they are and what they can."""

import re

import pytest

from hsm.dsl import check_file
from hsm.model.diagnostics import Severity
from maze_machine.catalogue.library import robot_library
from maze_machine.catalogue.machines import shipped_machines

MACHINES = shipped_machines()


def test_all_machines_ship():
    assert set(MACHINES) >= {
        "corridor_2015",
        "corridor_2017",
        "door",
        "explorer",
        "pledge",
        "pledge_smooth",
        "random_mouse",
        "right_hand",
        "right_hand_loop",
        "tremaux",
        "watch",
    }


@pytest.mark.parametrize("name", MACHINES)
def test_a_shipped_machine_has_neither_errors_nor_warnings(name):
    found = check_file(MACHINES[name], robot_library()).diagnostics
    assert [str(one) for one in found if one.severity > Severity.NOTE] == []


@pytest.mark.parametrize("name", MACHINES)
def test_a_shipped_machine_begins_with_what_it_is(name):
    text = MACHINES[name].read_text(encoding="utf-8")
    head = text[: text.index(f"\nmachine {name}")]
    assert all(line.startswith("#") for line in head.splitlines())
    assert len(head.split()) > 20
    assert max(len(line) for line in text.splitlines() if not line.startswith("property")) <= 120


@pytest.mark.parametrize("name", sorted(set(MACHINES) - {"door", "watch"}))
def test_every_machine_that_drives_is_watched_and_opens_the_doors_of_a_maze(name):
    text = MACHINES[name].read_text(encoding="utf-8")
    assert re.search(r"state \w+ = watch\(", text)
    assert "\nparallel " in text
    assert name.startswith("corridor") or re.search(r"state \w+ = door\(", text)
