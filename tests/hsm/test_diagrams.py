"""Machines drawn."""

import os
import re
import signal as signal_module
from html import unescape
from random import Random

import pytest

from hsm import build, load, loads
from hsm.interchange import drawing
from hsm.interchange.diagrams import THEMES, DiagramError, Look, edge_id, render
from hsm.interchange.dot import DotGraph
from hsm.interchange.folding import down_to, excerpt, open_around, own_states
from maze_machine.catalogue.library import robot_names
from maze_machine.catalogue.machines import find_machine, shipped_machines
from tests.hsm.charts import (
    add,
    after,
    compare,
    doing,
    final,
    history,
    model,
    noting,
    number,
    on,
    parallel,
    signal,
    state,
    when,
)


@pytest.fixture
def machine():
    return build(
        model(
            parallel(
                "p",
                state("b", history("h", "b1", deep=True), state("b1", activity=doing(7)), state("b2"), on("go", "h")),
                state("c", state("c1", when(compare(signal("x"), "<", number(0.5)), "c2")), state("c2")),
                on("count", actions=[add("n")]),
            ),
            state("x", after(2.5, "end"), entry=[noting(4)]),
            final("end"),
            on("stop", "x"),
            variables={"n": 0},
        )
    )


@pytest.mark.parametrize("form", ["dot", "svg"])
def test_everything_is_in_the_picture(machine, form):
    pytest.importorskip("pygraphviz")
    text = (
        render(machine, form, Look(fills={"x": "#ffcccc", "b": "#ccffcc"}))
        .decode()
        .replace("&lt;", "<")
        .replace("&#45;", "-")
    )
    for words in ("b1", "do work", "H*", "on go", "when x < 0.5", "after 2.5 s", "entry / note(4)", "on stop", "end"):
        assert words in text
    assert "on count / n += 1" in text or form == "dot"
    assert "#ffcccc" in text
    assert "#ccffcc" in text


def test_mermaid(machine):
    text = render(machine, "mmd").decode()
    assert text.startswith("---\nm\n---\nstateDiagram-v2\n")
    for words in ('state "b1\\ndo work(number = 7)" as s1_s2_s4', "when x #lt; 0.5", "after 2.5 s", "[*] --> s1"):
        assert words in text
    assert text.count("{\n") == text.count("}\n")


def test_png(machine):
    pytest.importorskip("pygraphviz")
    assert render(machine, "png").startswith(b"\x89PNG")


def test_another_form_is_refused(machine):
    with pytest.raises(DiagramError, match="svg, png, dot, mmd"):
        render(machine, "gif")


def test_a_folded_state_hides_what_lies_in_it_and_keeps_what_leads_out(machine):
    shown = excerpt(machine.model, down_to(machine.model, 1))
    assert [one.name for one in shown.model.states[1:]] == ["p", "x", "end"]
    assert shown.folded == {1: machine.model.states[1].last - 1}
    kept = [machine.model.transitions[index] for index in shown.transitions]
    assert [machine.model.states[one.source].name for one in kept] == ["m", "p", "x"]
    for place, index in enumerate(shown.transitions):
        drawn, whole = shown.model.transitions[place], machine.model.transitions[index]
        assert (drawn.trigger, drawn.guard) == (whole.trigger, whole.guard)


def test_nothing_folded_is_the_machine_itself(machine):
    shown = excerpt(machine.model)
    assert shown.model == machine.model
    assert (shown.states, shown.folded) == (tuple(range(len(machine.model.states))), {})


def test_one_state_alone(machine):
    shown = excerpt(machine.model, within="c" if "c" in machine.indices else "p.c")
    assert [one.own_name for one in shown.model.states[1:]] == ["c", "c1", "c2"]
    assert len(shown.transitions) == 1
    with pytest.raises(LookupError):
        excerpt(machine.model, within="nowhere")


def test_every_state_can_be_drawn_alone(machine):
    for one in machine.model.states[1:]:
        shown = excerpt(machine.model, within=one.name)
        assert shown.model.states[0].children == (1,)
        assert shown.model.states[0].last == len(shown.model.states) - 1
        assert render(machine, "dot", Look(within=one.name))


def test_around_some_states_only_what_leads_to_them_is_open(machine):
    names = {one.own_name: one.name for one in machine.model.states}
    shown = excerpt(machine.model, open_around(machine.model, [names["b"]]))
    assert [one.own_name for one in shown.model.states[1:]] == ["p", "b", "h", "b1", "b2", "c", "x", "end"]


@pytest.mark.parametrize("theme", THEMES)
def test_every_text_of_a_theme_can_be_read(theme):
    look = THEMES[theme]
    grounds = (look.state, look.compound, look.parallel, look.paper)
    for ink in (*look.inks, look.text):
        assert all(contrast(ink, ground) >= 4.5 for ground in grounds), ink
    assert contrast(look.text, look.note) >= 4.5


def contrast(one, other):
    """The contrast of two colours by WCAG 2."""

    def luminance(colour):
        code = "#ffffff" if colour == "white" else colour
        parts = [int(code[at : at + 2], 16) / 255 for at in (1, 3, 5)]
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    light, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def test_states_and_transitions_are_groups_that_a_page_can_find(machine):
    pytest.importorskip("pygraphviz")
    text = render(machine, "svg", Look(transparent=True, theme="dark")).decode()
    for one in machine.model.states[1:]:
        assert text.count(f'id="state_{one.index}"') == 1
    drawn = {word for found in re.findall(r'class="edge ([^"]*)"', text) for word in found.split()}
    assert drawn == {edge_id(one.index) for one in machine.model.transitions if one.targets}
    assert 'fill="white"' not in text


def test_without_guards(machine):
    pytest.importorskip("pygraphviz")
    guarded = build(model(state("a", on("go", "b", guard=compare(signal("x"), "<", number(0.5)))), state("b")))
    assert "0.5" in render(guarded, "dot").decode()
    assert "0.5" not in render(guarded, "dot", Look(guards=False)).decode()


# Where the texts are.


def boxes_of(svg):
    """The borders of compound states, the innermost states, the lines of the edges' texts: left, top, right, bottom."""
    found = {"cluster": [], "node": [], "edge": []}
    for kind, body in re.findall(r'<g id="[^"]*" class="(\w+)[^"]*">(.*?)</g>', svg, re.DOTALL):
        if kind == "edge":
            for x, y, points, text in re.findall(
                r'<text.*? x="([-\d.]+)" y="([-\d.]+)".*? font-size="([\d.]+)".*?>(.*?)</text>', body
            ):
                written, left, size = unescape(text).strip("\xa0 "), float(x), float(points)
                found[kind].append((left, float(y) - 0.7 * size, left + 0.5 * size * len(written), float(y), written))
        elif shape := re.search(r'<(?:path|polygon)[^>]* (?:d|points)="([^"]*)"', body):
            numbers = [float(one) for one in re.findall(r"-?\d+\.?\d*", shape[1])]
            found[kind].append((min(numbers[::2]), min(numbers[1::2]), max(numbers[::2]), max(numbers[1::2])))
    return found


def crossing(svg):
    """The texts that cross a border, or cover a state or another text."""
    boxes = boxes_of(svg)

    def touch(one, other):
        return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]

    def inside(one, other):
        return other[0] <= one[0] and one[2] <= other[2] and other[1] <= one[1] and one[3] <= other[3]

    found = []
    for count, one in enumerate(boxes["edge"]):
        over = [box for box in boxes["cluster"] if touch(one, box) and not inside(one, box)]
        over += [box for box in (*boxes["node"], *boxes["edge"][:count]) if touch(one, box)]
        found += [one[4]] * bool(over)
    return found


@pytest.mark.parametrize("name", sorted(shipped_machines()))
def test_the_texts_of_transitions_cross_no_border(name):
    pytest.importorskip("pygraphviz")
    drawn = load(find_machine(name), robot_names())
    looks = [Look(), Look(opened=own_states)]
    looks += [
        Look(guards=False, brief=True, opened=open_around(drawn.model, [one])) for one in ("", "watch", "run.solve")
    ]
    for look in looks:
        assert crossing(render(drawn, "svg", look).decode()) == []


TRIGGERS = (
    "on go", "on come_back_soon", "on go, halt", "when distance.front < 0.5 m", "after 3 s",
    "when space.left and not space.right and distance.left > 0.4 m",
)  # fmt: skip


def crowded(seed):
    """A machine with many transitions of many lengths between nested states."""
    draw, lines = Random(seed), ["machine crowded", "event go", "event come_back_soon", "event halt"]
    groups = {
        f"s{group}": [f"s{group}_{'long_name_' * draw.randint(0, 2)}{one}" for one in range(draw.randint(1, 5))]
        for group in range(draw.randint(1, 4))
    }
    names = [name for inner in groups.values() for name in inner]
    for group, inner in groups.items():
        lines.append(f"state {group}")
        nested, indent = draw.random() < 0.4 and len(inner) > 2, "    "
        for one, name in enumerate(inner):
            if nested and one == 1:
                lines.append(f"    state deep_{group}")
                indent = "        "
            lines.append(f"{indent}state {name}")
            ways = draw.sample(TRIGGERS, draw.randint(1, 3))
            lines += [f"{indent}    {trigger} -> {draw.choice([*names, *groups])}" for trigger in ways]
    return loads("\n".join(lines) + "\n", robot_names(), "crowded.maze-machine")


@pytest.mark.parametrize("seed", [40, 44, 46, 80])
def test_the_texts_of_any_machine_cross_no_border_and_no_other_text(seed):
    pytest.importorskip("pygraphviz")
    assert crossing(render(crowded(seed), "svg", Look()).decode()) == []


def test_as_graphviz_leaves_them_they_cross():
    graphviz = pytest.importorskip("pygraphviz")
    drawn = load(find_machine("pledge"), robot_names())
    graph = graphviz.AGraph(render(drawn, "dot", Look()).decode())
    assert crossing(graph.draw(format="svg", prog="dot").decode())


# Graphviz may end the process that it runs in.


def restless(count):
    """A machine with many transitions, over which Graphviz has ended the process."""
    draw = Random(1)
    names = [f"s{group}_{one}" for group in range(count) for one in range(8)]
    lines = ["machine restless", "event go"]
    for group in range(count):
        lines.append(f"state s{group}")
        for one in range(8):
            lines += [f"    state s{group}_{one}", *(f"        on go -> {draw.choice(names)}" for _ in range(3))]
    return loads("\n".join(lines) + "\n", robot_names(), "restless.maze-machine")


@pytest.mark.parametrize("name", ["pledge", "explorer"])
def test_graphviz_reads_its_text_as_it_writes_it_itself(name):
    pygraphviz = pytest.importorskip("pygraphviz")
    machine = load(find_machine(name), robot_names())
    text = render(machine, "dot", Look(opened=open_around(machine.model, [machine.model.states[1].name]))).decode()
    graph = pygraphviz.AGraph(text)
    assert len(graph.edges()) == text.count(" -> ")
    again = pygraphviz.AGraph(graph.to_string())
    assert again.nodes() == graph.nodes()
    assert [dict(one.attr) for one in again.edges()] == [dict(one.attr) for one in graph.edges()]


def test_any_text_is_a_label():
    pygraphviz = pytest.importorskip("pygraphviz")
    texts = ['say "go"', "a -> b; }", "<b>", "[x=1]", "ä\\lß\\l", "", "//", "'"]
    graph = DotGraph(rankdir="TB")
    for index, text in enumerate(texts):
        graph.add_node(f"s{index}", label=text)
    read = pygraphviz.AGraph(graph.to_string())
    assert [read.get_node(f"s{index}").attr["label"] for index in range(len(texts))] == texts


def test_a_graph_that_ends_graphviz_is_drawn_otherwise():
    pytest.importorskip("pygraphviz")
    svg = render(restless(4), "svg").decode()
    assert all(f">s{group}_{one}</text>" in svg for group in range(4) for one in range(8))


def test_the_process_is_started_again_where_it_has_ended(machine):
    pytest.importorskip("pygraphviz")
    first = render(machine, "svg")
    process = drawing._DRAWER._process
    process.kill()
    process.wait()
    assert render(machine, "svg") == first
    assert drawing._DRAWER._process is not process


def test_a_picture_that_takes_too_long_is_given_up(machine, monkeypatch):
    pytest.importorskip("pygraphviz")
    first = render(machine, "svg")
    monkeypatch.setattr(drawing, "LONGEST", 0.2)
    monkeypatch.setattr(drawing, "ATTEMPTS", ({},))
    os.kill(drawing._DRAWER._process.pid, signal_module.SIGSTOP)
    with pytest.raises(
        DiagramError, match="Graphviz ends without a picture, or takes longer than 0 s; show less of it"
    ):
        render(machine, "svg")
    monkeypatch.undo()
    assert render(machine, "svg") == first


def test_what_graphviz_cannot_read_is_said():
    pytest.importorskip("pygraphviz")
    with pytest.raises(drawing.DrawingError):
        drawing.drawn("digraph {", "svg")
