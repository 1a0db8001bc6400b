"""Coverage: what counts, how it merges, how it is reported."""

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from hsm.engine.coverage import Coverage
from hsm.interchange.diagrams import DiagramError
from hsm.testing.coverage.data import Measurements, measured_files
from hsm.testing.coverage.heat import fills_of, heat_map
from hsm.testing.coverage.html import html_pages
from hsm.testing.coverage.items import ItemKind, points
from hsm.testing.coverage.lcov import cobertura, lcov
from hsm.testing.coverage.table import coverage_table, missed_lines, ranges
from hsm.testing.scenarios.driver import Driver
from hsm.testing.scenarios.running import run_suite

TEXT = """
state a
    do rotate(90 deg)
    when space.left and space.right -> b
    on done                         -> b
state b
    after 2 s                       -> a
"""


def missed(machine, driver, kind):
    found = points(machine.model, driver.supervisor.coverage)
    return [one.text for one in found if one.kind is kind and not one.covered]


def test_states_transitions_outcomes_and_time_outs(machine_of):
    machine = machine_of(TEXT)
    driver = Driver(machine)
    assert missed(machine, driver, ItemKind.STATE) == ["b never entered"]
    driver.step(reports={"rotate": "done"})
    assert missed(machine, driver, ItemKind.STATE) == []
    assert missed(machine, driver, ItemKind.OUTCOME) == ["rotate in a never reported blocked"]
    assert missed(machine, driver, ItemKind.TIME_OUT) == ["b: after 2 s -> a never timed out"]
    driver.wait(2)
    assert missed(machine, driver, ItemKind.TIME_OUT) == []


def test_guards_conditions_and_mcdc(machine_of):
    machine = machine_of(TEXT)
    driver = Driver(machine)
    assert len(missed(machine, driver, ItemKind.GUARD)) == 1  # false was seen
    driver.step({"space.left": True})
    assert missed(machine, driver, ItemKind.CONDITION) == [
        "a: when space.left and space.right -> b: `space.right` never true"
    ]
    assert len(missed(machine, driver, ItemKind.MCDC)) == 2
    driver.step({"space.right": True})
    assert missed(machine, driver, ItemKind.GUARD) == []
    assert missed(machine, driver, ItemKind.CONDITION) == []
    assert missed(machine, driver, ItemKind.MCDC) == []


def test_mcdc_asks_more_than_each_condition_both_ways(machine_of):
    machine = machine_of("state a\n    when space.left or space.right -> b\nstate b\n    when space.front -> a\n")
    driver = Driver(machine)  # false, false
    driver.step({"space.left": True})  # true, -
    assert missed(machine, driver, ItemKind.MCDC) == [
        "a: when space.left or space.right -> b: `space.right` never decided independently"
    ]


@pytest.fixture
def measurements(walker):
    measured = Measurements()
    for suite in walker.suites:
        for result in run_suite(suite, walker.machine):
            measured.add(walker.machine.model, result.coverage)
    return measured


def test_data_files_of_several_processes_merge(measurements, walker, tmp_path):
    measurements.save(tmp_path, "one")
    measurements.save(tmp_path, "two")
    merged = Measurements()
    assert merged.load(tmp_path, [walker.machine.model]) == []
    (one,), (both,) = measurements.machines.values(), merged.machines.values()
    assert both.coverage.states == {state: 2 * count for state, count in one.coverage.states.items()}
    assert both.coverage.guards == one.coverage.guards
    assert [Path(file).name for file in measured_files(tmp_path)] == ["walker.maze-machine"]


def test_data_of_a_machine_that_has_changed_do_not_count(measurements, walker, tmp_path, machine_of):
    measurements.save(tmp_path)
    text = (tmp_path / next(iter(tmp_path.glob("*.json")))).read_text()
    (next(iter(tmp_path.glob("*.json")))).write_text(text.replace(json.loads(text)["machines"][0]["fingerprint"], "0"))
    merged = Measurements()
    assert len(merged.load(tmp_path, [walker.machine.model])) == 1
    assert not merged.machines


def test_the_table_counts_and_names_the_lines_that_were_missed(measurements):
    head, rule, row = coverage_table(list(measurements.machines.values()))
    assert head.split()[:3] == ["Machine", "States", "Trans"]
    assert set(rule) == {"-"}
    assert "14/14" in row
    assert row.endswith(", ".join(row.split("%", 1)[1].strip().split(", ")))
    (machine,) = measurements.machines.values()
    lines = {int(line.split(":")[1]) for line in missed_lines(machine)}
    assert lines
    text = machine.model.files and Path(machine.model.files[0]).read_text().splitlines()
    assert all(text[line - 1].strip().startswith(("on", "when", "after", "do", "initial")) for line in lines)


def test_ranges_join_neighbours():
    assert ranges([3, 5, 6, 7, 9]) == ["3", "5-7", "9"]


def test_lcov_and_cobertura_agree_with_the_points(measurements):
    machines = list(measurements.machines.values())
    records = lcov(machines).splitlines()
    assert records[0] == "TN:"
    assert records[-1] == "end_of_record"
    entered = [int(line.split(":")[1].split(",")[0]) for line in records if line.startswith("FNDA")]
    assert len(entered) == sum(point.kind is ItemKind.STATE for point in machines[0].points)
    assert f"BRF:{sum(line.startswith('BRDA') for line in records)}" in records
    root = ElementTree.fromstring(cobertura(machines))
    assert root.tag == "coverage"
    assert 0 < float(root.get("branch-rate")) < 1
    lines = {int(line.get("number")): int(line.get("hits")) for line in root.iter("line")}
    assert lines == {int(one[3:].split(",")[0]): int(one.split(",")[1]) for one in records if one.startswith("DA:")}


def test_the_html_report_shows_source_counts_and_reasons(measurements):
    pages = html_pages(list(measurements.machines.values()))
    assert "walker.html" in pages["index.html"]
    page = pages["walker.html"]
    assert "property quiet" in page
    assert "never" in page
    assert page.count("<svg") == 1
    (machine,) = measurements.machines.values()
    fills = fills_of(machine)
    assert all(f'fill="{colour}"' in page for colour in fills.values())
    assert len(set(fills.values())) > 1
    assert set(fills) <= {state.name for state in machine.model.states if not state.children}


def test_the_heat_map_is_boxes_where_no_diagram_can_be_drawn(measurements, monkeypatch):
    def missing(*_):
        raise DiagramError("no Graphviz")

    monkeypatch.setattr("hsm.testing.coverage.heat.render", missing)
    (machine,) = measurements.machines.values()
    page = heat_map(machine)
    assert "<svg" not in page
    assert page.count('class="state') == page.count("</div>") - 1
    assert all(f"background: {colour}" in page for colour in fills_of(machine).values())


def test_nothing_is_all_covered_and_merges_with_anything():
    empty = Coverage()
    assert empty.merge(empty) == Coverage(states={}, transitions={}, guards={}, outcomes={}, history={})
