"""Machines written as SCXML, and charts translated into the language."""

import json
from pathlib import Path

import pytest

from hsm import Library, MachineError, build
from hsm.dsl import parse_model
from hsm.interchange.scxml import read_file, read_text, write_text
from hsm.interchange.scxml.translation import to_machine_text
from tests.hsm.charts import add, after, call, compare, doing, final, model, number, on, put, signal, state, when

FOREIGN = Path(__file__).parents[2].parent / "shared" / "data" / "scxml"
CHARTS = sorted(FOREIGN.rglob("*.scxml")) if FOREIGN.is_dir() else []
CHARTS += sorted((Path(__file__).parent / "scxml").glob("*.scxml"))


def structure(one):
    """All of a model but its places and the machine's name."""
    states = [(s.name, s.kind, s.parent, s.initial, s.transitions, len(s.entry), len(s.exit)) for s in one.states[1:]]
    return states, [(t.source, t.targets, t.trigger, t.kind, t.guard is None) for t in one.transitions]


@pytest.mark.parametrize("path", CHARTS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_a_chart_that_is_written_is_read_back(path):
    read = read_file(path)
    back = read_text(write_text(read))
    assert structure(back) == structure(read)
    run, other = build(read).start(), build(back).start()
    assert other.configuration == run.configuration
    for event in json.loads(path.with_suffix(".json").read_text())["events"]:
        time = run.time + event.get("after", 0) / 1000 + 0.001
        assert (
            other.step(time, [event["event"]["name"]]).configuration
            == run.step(time, [event["event"]["name"]]).configuration
        )


@pytest.mark.parametrize("path", CHARTS, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_a_translated_chart_does_the_same(path):
    read = read_file(path)
    try:
        text = to_machine_text(read)
    except MachineError as error:
        pytest.skip(error.diagnostics[0].message)
    model = parse_model(text, Library("none"))
    run, other = build(read).start(), build(model).start()
    assert other.configuration == run.configuration
    for time, line in enumerate(json.loads(path.with_suffix(".json").read_text())["events"]):
        name = line["event"]["name"]
        if name.replace(".", "_") not in model.events:
            continue  # only events that the chart names have a counterpart
        run.step(float(time), [name])
        other.step(float(time), [name.replace(".", "_")])
        assert other.configuration == run.configuration


def test_a_machine_of_this_language_as_scxml():
    text = write_text(
        model(
            state(
                "a",
                state("b", after(2.5, "f"), when(compare(signal("x"), "<", number(0.5)), "f", actions=[put("n", 3)])),
                final("f"),
                on("done", "c", actions=[call("note", 4), add("n")]),
                activity=doing(7),
            ),
            state("c"),
            variables={"n": 0},
        )
    )
    for words in (
        '<data id="n" expr="0" />',
        '<send event="after.b.0" id="after.b.0" delay="2.5s" />',
        '<cancel sendid="after.b.0" />',
        'cond="x &lt; 0.5"',
        '<transition event="done" target="c" type="internal">',
        '<transition event="done.state.a" target="c" type="internal">',
        '<assign location="n" expr="n + 1" />',
        '<maze:call text="note(4)" />',
        'src="work(number = 7)"',
    ):
        assert words in text


def test_outcomes_are_told_apart_by_the_final_state_that_is_reached():
    text = write_text(
        model(
            state("a", state("b"), final("well"), final("ill"), on("well", "c"), on("ill", "d"), on("e", "b")),
            state("c"),
            state("d"),
        )
    )
    for final_state, target in (("well", "c"), ("ill", "d")):
        assert f'<transition event="done.state.a" cond="In(\'{final_state}\')" target="{target}"' in text
    assert text.count("done.state") == 2


def test_names_of_a_chart_are_no_outcomes():
    chart = '<scxml><state id="a"><transition event="f" target="b"/><final id="f"/></state><final id="b"/></scxml>'
    assert "done.state" not in write_text(read_text(chart))


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ('<state id="a"><transition event="*" target="a"/></state>', "the event `*`"),
        ('<state id="a"><onentry><send event="e" delay="1s"/></onentry></state>', "sent"),
        ('<state id="a" initial="c"><state id="b"><state id="c"/></state></state>', "initial state of `a`"),
        ('<final id="a"><onentry><raise event="e"/></onentry></final>', "final state `a`"),
    ],
)
def test_what_the_language_does_not_have_is_refused(body, reason):
    with pytest.raises(MachineError) as raised:
        to_machine_text(read_text(f"<scxml>{body}</scxml>"))
    (finding,) = raised.value.diagnostics
    assert reason in finding.message
    assert finding.code == "E0922"


def test_a_chart_of_any_depth_is_written_and_read_back():
    deep = "".join(f'<state id="s{one}">' for one in range(10_000)) + "</state>" * 10_000
    read = read_text(f"<scxml>{deep}</scxml>")
    text = write_text(read)
    assert len(text) < 10_000_000
    assert structure(read_text(text)) == structure(read)
    with pytest.raises(MachineError, match="nested more than 1000 deep"):
        to_machine_text(read)
