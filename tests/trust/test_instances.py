"""Properties of imported machines: held inside what imports them, in each of their runs from entry to exit."""

from pathlib import Path

import pytest

from hsm.dsl import load_model
from hsm.engine.machine import Machine
from hsm.engine.monitoring import Monitor
from hsm.testing.proofs.proving import check
from hsm.testing.scenarios.driver import Driver
from hsm.testing.scenarios.reading import parse_suite
from hsm.testing.scenarios.running import run_suite
from hsm.testing.scenarios.script import Script, scripted_machine
from hsm.testing.scenarios.watching import property_watch
from hsm.testing.scenarios.writing import Writer
from maze_machine.catalogue.library import robot_library
from maze_machine.catalogue.machines import shipped_machines

BELL = """machine bell

param timeout : time = 4 s

property answered : after in(waiting), in(opened) or in(shut) within 5 s
property patient  : always eventually not in(waiting) within 5 s
property rung     : after in(ringing), doing(ring) before in(waiting)

initial ringing
state ringing
    do ring()
    on accepted, refused -> waiting
state waiting
    do stop()
    when door.open       -> opened
    after timeout        -> shut
final opened
final shut
"""

HOUSE = """machine house

import bell

initial driving
state driving
    do drive()
    when door.near and not door.tried -> front
    when exit.crossed                 -> outside
state front = bell({timeout})
    on opened                         -> driving
    on shut                           -> {shut}
    when space.left and not door.near -> driving
state back = bell()
    on opened, shut                   -> driving
final outside
"""


@pytest.fixture
def house(tmp_path, library):
    (tmp_path / "bell.maze-machine").write_text(BELL, encoding="utf-8")

    def load(timeout="", shut="back") -> Machine:
        (tmp_path / "house.maze-machine").write_text(HOUSE.format(timeout=timeout, shut=shut), encoding="utf-8")
        return Machine(load_model(tmp_path / "house.maze-machine", library))

    return load


def test_their_names_say_which_instance_they_are_about_and_their_places_where_they_are_stated(house):
    stated = house().model.properties
    assert [one.name for one in stated] == [
        f"{instance}.{name}" for instance in ("front", "back") for name in ("answered", "patient", "rung")
    ]
    assert {one.scope for one in stated} == {"front", "back"}
    assert {Path(one.place.file).name for one in stated} == {"bell.maze-machine"}


def test_what_holds_of_a_machine_holds_of_its_instances_too(house):
    verdicts = check(house())
    assert [one.name for one in verdicts if not one.proved] == []
    assert len(verdicts) == 7


def test_an_instance_that_is_told_to_wait_too_long_violates_its_property_with_a_run_that_reads_as_a_scenario(
    house, library
):
    machine = house("timeout = 6 s")
    verdicts = {one.name: one for one in check(machine)}
    assert [name for name, one in verdicts.items() if one.violated] == ["front.answered", "front.patient"]
    example = verdicts["front.answered"].counterexample
    text = Writer(machine.model).suite([example])
    assert "scenario counterexample to front.answered" in text
    assert "given door.near" in text
    assert "expect waiting" not in text  # there are two states of that name
    (result,) = run_suite(parse_suite(text, machine.model, library), machine)
    assert result.failure is None


def test_leaving_an_instance_ends_what_it_owes(house):
    driver = Driver(house("timeout = 20 s"), signals={"door.near": True})
    watch = property_watch(driver.machine.model.properties)
    watch(driver)
    driver.step(reports={"ring": "accepted"})
    assert driver.configuration == {"front", "front.waiting"}
    for _ in range(30):
        driver.step()
        assert watch(driver) == []
    driver.step({"space.left": True, "door.near": False})
    assert driver.configuration == {"driving"}
    for _ in range(60):
        driver.step()
        assert watch(driver) == []


def test_an_instance_that_is_entered_anew_begins_anew_also_within_one_step(house):
    driver = Driver(house("timeout = 4 s", shut="driving"), signals={"door.near": True})
    watch = property_watch(driver.machine.model.properties)
    for _ in range(4):  # each time it ends by its time-out and is entered again at once
        watch(driver)
        driver.step(reports={"ring": "accepted"})
        for _ in range(40):
            assert watch(driver) == []
            driver.step()
        assert driver.configuration == {"front", "front.ringing"}


def test_they_are_watched_while_a_machine_runs(house):
    machine = scripted_machine(house("timeout = 20 s"))
    near = Script({"door.near": True})
    run = machine.start(facts=near)
    monitor = Monitor(run)
    found = []
    for tick in range(70):
        step = run.step(tick * 0.1, facts=near)
        run.act(Script(reports={"front.ringing": "accepted"} if tick == 0 else {}))
        found += monitor.look(near, step)
    assert [(one.property.name, round(one.time, 1)) for one in found] == [
        ("front.patient", 5.0),
        ("front.answered", 5.1),
    ]
    assert "bell.maze-machine:5" in str(found[1])
    assert "property front.answered is violated at 5.1 s in front, front.waiting" in str(found[1])


@pytest.mark.parametrize(
    "name", [one for one in shipped_machines() if not one.startswith(("corridor", "door", "watch"))]
)
def test_the_shipped_machines_are_held_to_what_their_parts_state(name):
    model = load_model(shipped_machines()[name], robot_library())
    parts = {one.name for one in model.properties if one.scope is not None}
    assert {"open_door.rung", "open_door.patient", "watch.gone"} <= parts
