"""Coupled regions are decided a few at a time, and never called proved where the whole machine violates."""

from pathlib import Path

import pytest

from hsm.dsl import load_model
from hsm.testing.proofs import proving
from hsm.testing.proofs.proving import check, examine
from hsm.testing.proofs.verdicts import NO_FAULT
from tests.trust.coupled import COUPLINGS, coupled_text, drawn_text
from tests.trust.library import make_library
from tests.trust.regions import replayed


def loaded(folder: Path, text: str):
    path = folder / "m.maze-machine"
    path.write_text(text)
    return load_model(path, make_library())


@pytest.mark.parametrize("kind", COUPLINGS)
def test_six_coupled_regions_are_proved(tmp_path, kind):
    model = loaded(tmp_path, coupled_text(kind, 6))
    found = examine(model)
    assert all(one.proved for one in found.verdicts)
    assert sum(one.states for one in found.verdicts if one.name == NO_FAULT) == 24
    assert found.possible is not None
    assert found.possible.states == {one.index for one in model.states}


def test_a_violation_is_shown_on_the_whole_machine(tmp_path):
    text = coupled_text("lock", 6).replace("property soon", "property one : never in(d0) and in(d1)\nproperty soon")
    model = loaded(tmp_path, text)
    (verdict,) = check(model, only={"one"})  # both hear `go` in one step, while neither has set the flag
    assert verdict.violated
    assert replayed(model, verdict)


REGIONS = "".join(
    f"    state r{one}\n        initial x{one}\n        state x{one}\n"
    f"            when door.near and {asked} -> y{one}{does}\n"
    f"        state y{one}\n            {leaves} -> x{one}\n"
    for one, asked, does, leaves in (
        (0, "not in(y1)", "", "when not door.near and in(y1)"),
        (1, "n < 3", " / n = n + 1", "on go"),
        (2, "in(y1)", " / raise go", "after 1 s"),
        (3, "not in(y2)", " / n = 0", "when in(x0)"),
    )
)


@pytest.mark.parametrize(
    "claim",
    [
        "never in(y0) and in(y1)",
        "always n < 3",
        "never in(y2) and in(x1)",
        "after in(y1), in(y3) before in(y2)",
        "after in(y0), in(x0) within 5 s",
        "never in(y0) and in(y1) and in(y2) and in(y3)",
    ],
)
def test_a_false_claim_about_regions_that_ask_and_tell_each_other_is_not_proved(tmp_path, claim):
    text = f"machine m\n\nevent go\nvar n : int = 0\nproperty p : {claim}\n\nparallel all\n{REGIONS}"
    (verdict,) = check(loaded(tmp_path, text), only={"p"}, seconds=2)
    assert not verdict.proved


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("raise e1", "raise e0"),  # each answers the other within the step
        ("flag = true", "flag = false"),
    ],
)
def test_an_endless_sequence_across_regions_is_found(tmp_path, first, second):
    trigger = ("on e0", "on e1") if "raise" in first else ("when not flag", "when flag")
    lines = ["machine m", "", "event e0", "event e1", "var flag : bool = false", "", "parallel all"]
    for one, (heard, does) in enumerate(zip(trigger, (first, second), strict=True)):
        lines += [f"    state r{one}", f"        initial x{one}", f"        state x{one}"]
        lines += [
            f"            {heard} -> y{one} / {does}",
            f"        state y{one}",
            f"            {heard} -> x{one} / {does}",
        ]
    for one in (2, 3):
        lines += [f"    state r{one}", f"        initial x{one}", f"        state x{one}"]
        lines += [
            f"            when in(x0) and flag -> y{one}",
            f"        state y{one}",
            f"            after 1 s -> x{one}",
        ]
    (verdict,) = check(loaded(tmp_path, "\n".join(lines) + "\n"), only={NO_FAULT})
    assert not verdict.proved


@pytest.mark.parametrize("seed", [2, 3])
def test_verdicts_agree_with_those_of_the_whole(seed, tmp_path, monkeypatch):
    model = loaded(tmp_path, drawn_text(seed))
    found = check(model, seconds=1)
    monkeypatch.setattr(proving, "applies", lambda _model, _kept: False)
    for one, whole in zip(found, check(model, seconds=1), strict=True):
        assert not (one.proved and whole.violated)
        assert not (one.violated and whole.proved)
