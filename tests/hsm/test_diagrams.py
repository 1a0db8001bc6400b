"""Machines drawn."""

import pytest

from hsm import build
from hsm.interchange.diagrams import DiagramError, render
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
    text = render(machine, form, {"x": "#ffcccc", "b": "#ccffcc"}).decode().replace("&lt;", "<").replace("&#45;", "-")
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
