"""What the checker proves about conditions."""

import pytest

from hsm.dsl import check_text

HEAD = "machine m\n\nparam near : length = 0.3 m\nparam far : length = 1 m\nvar n : int = 0\nvar k : int = 0\n\n"


def codes_and_messages(library, table, prefix=("W05", "N07")):
    rows = "".join(f"    {row}\n" for row in table)
    rows += "    on blocked -> e / n += 1, k += 1\n"
    text = f"{HEAD}state s\n    do drive(0.5 m/s)\n{rows}\nfinal e\nfinal f\nfinal g\n"
    checked = check_text(text, library)
    assert checked.model is not None, checked.diagnostics
    return [(one.code, one.message) for one in checked.diagnostics if one.code.startswith(prefix)]


def gaps(library, *table):
    found = codes_and_messages(library, table, ("N0702",))
    return [message.partition(" fires when ")[2] for _, message in found]


def codes(library, *table):
    return [code for code, _ in codes_and_messages(library, table, ("W0503", "W0506", "N0701"))]


def test_the_table_of_2017_has_no_line_for_front_and_left_blocked_and_right_free(library):
    found = gaps(
        library,
        "when not space.front and space.left -> e",
        "when not space.front and not space.left and not space.right -> f",
    )
    assert found == ["space.front", "not space.front and not space.left and space.right"]


def test_what_is_meant_to_stay_is_no_gap(library):
    table = ("when not space.front and space.left -> e", "when not (space.front or space.left or space.right) -> f")
    assert gaps(library, *table, "stay when space.front") == ["not space.front and not space.left and space.right"]
    assert gaps(library, *table, "stay when space.front or space.right") == []
    assert gaps(library, *table, "stay") == []


def test_conditions_about_different_things_make_no_table(library):
    assert gaps(library, "when exit.crossed -> e", "when door.near -> f") == []


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        (("when ahead < 1 m -> e", "when ahead > 2 m -> f"), ["ahead >= 1 m and ahead <= 2 m"]),
        (("when ahead < 1 m -> e", "when ahead >= 1 m -> f"), []),
        (("when ahead < 1 m -> e", "when ahead > 1 m -> f"), ["ahead == 1 m"]),
        (("when n > 1 -> e", "when n < 1 -> f"), ["n == 1"]),
        (("when n > 0 -> e", "when n < 1 -> f"), []),
        (("when 2 * n > 1 -> e", "when n < 1 -> f"), []),
        (("when ahead < near -> e", "when ahead > far -> f"), ["ahead >= 0.3 m and ahead <= 1 m"]),
        (("when n + k > 3 -> e", "when k + n <= 3 -> f"), []),
        (("when n - k > 3 -> e", "when k - n > -3 -> f"), ["k - n == -3"]),
        (("when abs(heading) < 5 deg -> e", "when abs(heading) >= 5 deg -> f"), []),
        (
            ("when junction.kind == corner -> e", "when junction.kind == crossing or junction.kind == corridor -> f"),
            ["junction.kind == dead_end"],
        ),
    ],
)
def test_gaps_of_numbers_and_enumerations(library, table, expected):
    assert gaps(library, *table) == expected


@pytest.mark.parametrize(
    ("table", "expected"),
    [
        (("when ahead < 1 m -> e", "when ahead < 0.5 m -> f"), ["W0503"]),
        (("when ahead < 0.5 m -> e", "when ahead < 1 m -> f"), []),
        (("when ahead < 1 m -> e", "when ahead > 0.5 m -> f"), ["N0701"]),
        (("when space.left -> e", "when space.right -> f"), []),
        (("when ahead < 0.5 m -> e", "when ahead > 1 m -> f"), []),
        (("when ahead < 1 m -> e", "when ahead >= 1 m -> f", "when space.left -> g"), ["W0503"]),
        (("when ahead < near -> e", "when ahead > far -> f"), []),
        (("when n > 3 -> e", "when n == 3 -> f", "when n < 3 -> g"), []),
        (("when n > 3 and k > 2 -> e", "when n + k > 8 -> f"), ["N0701"]),
        (("when n > 3 and k > 2 -> e", "when n + k < 5 -> f"), []),
        (("when n > 3 and n < 4 -> e",), ["W0506"]),
        (("when n > 3 and n < 5 -> e",), []),
        (("when junction.kind == corner and junction.kind == crossing -> e",), ["W0506"]),
        (("when space.left and not space.left -> e",), ["W0506"]),
        (("when space.left != space.right -> e", "when space.left and space.right -> f"), []),
        (("when not (ahead < 1 m) -> e", "when ahead > 1 m -> f"), ["W0503"]),
        (("when space.left -> e", "when space.left if space.right -> f"), ["W0503"]),
        (("when space.left if space.right -> e", "when space.left -> f"), []),
        (("when space.left or space.front -> e", "when space.left or space.right -> f"), ["N0701"]),
        (("when space.left -> e", "when space.left and space.right -> e"), ["W0503"]),
        (("after 5 s -> e", "after 8 s -> f"), ["W0503"]),
        (("after 8 s -> e", "after 5 s -> f"), []),
        (("after 5 s if space.left -> e", "after 8 s -> f"), []),
        (("on bumped -> e", "on bumped -> f"), ["W0503"]),
        (("on bumped if n > 0 -> e", "on bumped if n < 2 -> f"), ["N0701"]),
        (("on bumped if n > 0 -> e", "on bumped -> f"), []),
        (("on bumped if n > 0 -> e", "on bumped if n <= 0 -> f", "on bumped -> g"), ["W0503"]),
    ],
)
def test_overlaps_and_hidden_transitions(library, table, expected):
    assert codes(library, *table) == expected


def test_an_overlap_names_a_case_and_the_first_transition(library):
    (found,) = (
        one
        for one in check_text(
            HEAD + "state s\n    when ahead > 1 m -> e\n    when ahead < 2 m -> f\nfinal e\nfinal f\n", library
        ).diagnostics
        if one.code == "N0701"
    )
    assert "ahead > 1 m and ahead < 2 m" in found.message
    assert [related.place.line for related in found.related] == [9]


def test_a_table_too_large_is_left_alone(library):
    table = [f"when n == {number} -> e / k = {number}" for number in range(60)]
    assert codes(library, *table) == []


class TestLoops:
    def spins(self, library, *states):
        text = HEAD + "".join(states) + "final e\n"
        return [one for one in check_text(text, library).diagnostics if one.code == "W0505"]

    def test_two_conditions_that_can_both_hold(self, library):
        (found,) = self.spins(
            library, "state a\n    when space.left -> b\n", "state b\n    when space.right -> a\n    on bumped -> e\n"
        )
        assert found.place.line == 9
        assert "space.left and space.right" in found.message

    def test_conditions_that_exclude_one_another(self, library):
        assert not self.spins(
            library,
            "state a\n    when space.left -> b\n",
            "state b\n    when not space.left -> a\n    on bumped -> e\n",
        )

    def test_an_action_that_changes_the_condition(self, library):
        assert not self.spins(
            library, "state a\n    when n < 3 -> b / n += 1\n", "state b\n    when n < 9 -> a\n    on bumped -> e\n"
        )

    def test_a_transition_into_its_own_state(self, library):
        assert self.spins(library, "state a\n    when space.left -> a\n    on bumped -> e\n")

    def test_an_inner_transition_that_comes_first_breaks_the_loop(self, library):
        assert not self.spins(
            library,
            "state outer\n    when space.left -> a\n\n    state a\n        when space.left -> e\n",
        )
