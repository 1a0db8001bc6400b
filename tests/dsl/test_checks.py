"""Flow, outcomes, conflicts, names: what is found, and that one mistake is reported once."""

import pytest

from hsm.dsl import check_text


def found(library, body, head="machine m\n"):
    checked = check_text(head + body, library)
    return [(one.code, one.place.line) for one in checked.diagnostics]


def test_one_misspelt_target_is_one_finding(library):
    body = "state start\n    do drive()\n    on blocked -> turn_lft\n"
    body += "state turn_left\n    do rotate(1 rad)\n    on done -> e\nfinal e\n"
    assert found(library, body) == [("E0201", 4)]


def test_an_unreadable_line_silences_only_what_hangs_on_it(library):
    body = (
        "param speedy : speed = 1 m/s\n"
        "state start\n    do drive(speedy\n    on blocked -> other\n"
        "state other x\n    do rotat(1 rad)\n    on done -> e\n"
        "final e\n"
    )
    assert found(library, body) == [("E0104", 4), ("E0101", 6), ("E0204", 7)]


def test_every_fault_of_a_bad_file_in_one_run(library):
    body = (
        "import nowhere\n"
        "param p : sped = 1\n"
        "var v : int = true\n"
        "state a\n"
        "    do driv()\n"
        "    on bogus -> b\n"
        "    when space.frnt -> b\n"
        "    after 5 m -> b\n"
        "    on $\n"
        "    on bumped -> missing_state / v = 1 m, nothing()\n"
        "state b\n"
        "    on bumped -> a\n"
        "state a\n"
        "    on bumped -> b\n"
    )
    assert [code for code, _ in found(library, body)] == [
        "E0208",
        "E0206",
        "E0301",
        "E0204",
        "E0202",
        "E0301",
        "E0101",
        "E0201",
        "E0301",
        "E0205",
        "E0209",
    ]


@pytest.mark.parametrize(("line", "codes"), [("property p : always n >= 0", []), ("", [("W0603", 3)])])
def test_a_variable_that_a_property_alone_reads_is_used(library, line, codes):
    body = f"{line}\nvar n : int = 0\nstate a\n    after 1 s -> b / n += 1\nstate b\n    after 1 s -> a\n"
    assert found(library, body) == codes


def test_a_region_is_left_by_its_sibling(library):
    body = (
        "parallel p\n"
        "    state one\n        do ring()\n        on done, refused / beep()\n"
        "    state two\n        on bumped -> e\n"
        "final e\n"
    )
    assert found(library, body) == []


def test_a_compound_state_that_is_left_leaves_no_dead_end_inside(library):
    body = "state c\n    on bumped -> e\n    state x\n        do drive()\n        on blocked / beep()\nfinal e\n"
    assert found(library, body) == []


def test_an_internal_transition_is_no_way_out(library):
    assert found(library, "state a\n    on bumped / beep()\n") == [("W0502", 2)]


def test_only_the_outermost_unreachable_state_is_told(library):
    body = (
        "initial a\nstate c\n    state x\n        on bumped -> a\n    state y\n        on bumped -> x\n"
        "state a\n    on bumped -> e\nfinal e\n"
    )
    assert found(library, body) == [("W0501", 3)]


def test_an_outer_state_may_handle_an_outcome(library):
    body = "state c\n    on refused, done -> e\n    state x\n        do ring()\nfinal e\n"
    assert found(library, body) == []


def test_the_end_of_a_compound_state_is_to_be_handled(library):
    body = "state c\n    on bumped -> e\n    state x\n        on bumped -> over\n    final over\nfinal e\n"
    assert found(library, body) == [("W0504", 2)]
    handled = body.replace("on bumped -> e", "on over -> e", 1)
    assert found(library, handled) == []


def test_a_state_and_one_inside_it_may_not_hold_the_same(library):
    body = "state c\n    do drive()\n    on blocked -> e\n"
    body += "    state x\n        do rotate(1 rad)\n        on done -> e\nfinal e\n"
    assert found(library, body) == [("E0411", 6)]


def test_a_conflict_within_instances_is_told_at_the_instance(library, tmp_path):
    (tmp_path / "door.maze-machine").write_text(
        "machine door\nstate r\n    do ring()\n    on done, refused -> over\nfinal over\n"
    )
    body = (
        "import door\n"
        "parallel p\n    on done -> e\n"
        "    state one\n        on bumped -> e\n        state first = door()\n            on over / beep()\n"
        "    state two\n        on bumped -> e\n        state second = door()\n            on over / beep()\n"
        "final e\n"
    )
    checked = check_text("machine m\n" + body, library, str(tmp_path / "m.maze-machine"))
    assert [(one.code, one.place.line) for one in checked.diagnostics if one.code[0] == "E"] == [("E0411", 11)]


@pytest.mark.parametrize(
    "line",
    ["    on bumped -> e  # accept W0502", "    on bumped / beep()  # accept W0502"],
)
def test_an_acceptance_of_nothing_is_told(library, line):
    body = f"state a\n{line}\nfinal e\n"
    assert ("W0605", 3) in found(library, body)


@pytest.mark.parametrize(
    "text",
    [
        "# accept W0502: waits for ever, as is meant\nstate a\n    on bumped / beep()\n",
        "state a  # accept W0502\n    on bumped / beep()\n",
        "state a\n    on bumped -> b\n# accept W0502\n# for ever\nstate b\n    on bumped / beep()\n",
    ],
)
def test_a_finding_can_be_accepted(library, text):
    assert found(library, text) == []


def test_an_error_cannot_be_accepted(library):
    assert ("E0201", 3) in found(library, "state a  # accept E0201\n    on bumped -> b\n")


def test_a_ring_of_imports_over_two_files(library, tmp_path):
    (tmp_path / "one.maze-machine").write_text("machine one\nimport two\nstate a = two()\n    on done -> e\nfinal e\n")
    (tmp_path / "two.maze-machine").write_text("machine two\nimport one\nstate a = one()\n    on done -> e\nfinal e\n")
    path = tmp_path / "one.maze-machine"
    checked = check_text(path.read_text(), library, str(path))
    assert [one.code for one in checked.diagnostics] == ["E0410"]
    assert "one -> two -> one" in checked.diagnostics[0].message


def test_a_name_that_is_misspelt_everywhere_is_one_finding(library):
    body = "var n : int = 0\nstate a\n    on bumped if m > 0 -> b\n    on bumped / m += 1\n"
    body += "state b\n    do wait(times = m)\n    on done -> c\n    on bumped -> c\nfinal d\n"
    checked = check_text("machine m1\n" + body, library)
    assert [(one.code, one.place.line, [two.place.line for two in one.related]) for one in checked.diagnostics] == [
        ("E0202", 4, [5, 7]),
        ("E0201", 8, [9]),
    ]


MISTAKES = [
    ("state a:\n    on bumped -> b\nfinal b\n", "no colon"),
    ("var n : int = 0\nstate a\n    after 1 s/n += 1\n", "a space before the slash"),
    ("var n : int = 0\nstate a\n    after 2 s/n = 1\n", "a space before the slash"),
    ("state a {\n    on bumped -> b\n}\nfinal b\n", "no braces"),
    ("state a\n    do ring\n    on done, refused -> b\nfinal b\n", "`do ring()`"),
    ("state a\n    ring()\n    on bumped -> b\nfinal b\n", "after `do`"),
    ("state a\n    when steps = 3 -> b\nfinal b\n", "`==`"),
    ("state a\n    when steps <> 3 -> b\nfinal b\n", "`!=`"),
    ("state a\n    when space.left is true -> b\nfinal b\n", "`==`"),
    ("state a\n    when space.left && space.right -> b\nfinal b\n", "`and`"),
    ("state a\n    when 1 < steps < 3 -> b\nfinal b\n", "join two comparisons"),
    ("property small : steps <= 1\nfinal a\n", "a claim begins with `always`"),
    ("assume small : steps <= 1\nfinal a\n", "a claim begins with `always`"),
    ("state a\n    when ahead / 2 > 1 m -> b\nfinal b\n", "parentheses"),
    ("state a\n    on bumped and space.left -> b\nfinal b\n", "after `if`"),
    ("state a\n    on bumped goto b\nfinal b\n", "after `->`"),
    ("state a\n    on bumped --> b\nfinal b\n", "`->`"),
    ("state a\n    on space.left -> b\nfinal b\n", "`when space.left`"),
    ("state a\n    do wait()\n    when done -> b\nfinal b\n", "`on done`"),
    ("state a\n    do beep()\n    on bumped -> b\nfinal b\n", "is an action"),
    ("state a\n    on bumped -> b / ring()\nfinal b\n", "is an activity"),
    ("state a\n    after 5 -> b\nfinal b\n", "`s` or `ms`"),
    ("state a\n    after 5 seconds -> b\nfinal b\n", "`s`"),
    ("state a\n    on bumped -> b;\nfinal b\n", "one statement"),
    ("// first\nstate a\n    on bumped -> b // second\nfinal b\n", "`#`"),
    ("state a\n\ton bumped -> b\n\ton fault -> b\nfinal b\n", "four spaces"),
    ("state a\n    on bumped -> b\nfinal state b\n", "already declares"),
    ("state turn-left\n    on bumped -> b\nfinal b\n", "underscore"),
    ("state a\n    when space.left -> b\n    elif space.right -> b\nfinal b\n", "a second transition"),
    ("state a\n    entry beep()\n    on bumped -> b\nfinal b\n", "after a slash"),
    ("var n = 0\nstate a\n    on bumped if n > 0 -> b\nfinal b\n", "give its type"),
    ("var n : float = 0.0\nstate a\n    on bumped if n > 0 -> b\nfinal b\n", "`number`"),
    ("var n : bool = True\nstate a\n    on bumped if n -> b\nfinal b\n", "`true`"),
    ("var n : int = 0\nstate a\n    on bumped if n > 1 -> b\n    on fault / n++\nfinal b\n", "`+= 1`"),
    ("state a\n    on bumped -> b\nstate b\n    on bumped -> history\n", "name the state"),
    ("state a\n    wait 3 s -> b\nfinal b\n", "`after 3 s -> ...`"),
    ("state a\n    on timeout(3) -> b\nfinal b\n", "`after 3 s -> ...`"),
    ("state a\n    bumped -> b\nfinal b\n", "`on bumped` for an event"),
    ("state a\n    on bumped -> state b\nfinal b\n", "alone: `-> b`"),
    ("state a\n    on bumped: -> b\nfinal b\n", "leave out the colon"),
    ("state a\n    on bumped or fault -> b\nfinal b\n", "separate events with a comma"),
    ("state a\n    pass\n    on bumped -> b\nfinal b\n", "leave this one out"),
    ("state a\n    on bumped -> b\nend\nfinal b\n", "the indentation ends a block"),
    ("state a\n    on bumped -> b\nfinal b c\n", "one word: `b_c`"),
    ("initial state a\nstate a\n    on bumped -> b\nfinal b\n", "alone: `initial a`"),
    ("state a\n    do follow_wall(side: left)\n    on bumped -> b\nfinal b\n", "with `=`"),
    ('state a\n    do follow_wall(side = "left")\n    on bumped -> b\nfinal b\n', "remove the quotes"),
]


@pytest.mark.parametrize(("body", "words"), MISTAKES)
def test_a_beginners_mistake_is_one_finding_with_a_way_out(library, body, words):
    (only,) = check_text("machine m\n" + body, library).diagnostics
    assert words in only.suggestion


def test_suggestions_stop_in_a_file_full_of_unknown_names(library):
    body = "".join(f"state s{number}\n    on bumped -> t{number}{number}\n" for number in range(300))
    checked = check_text("machine m\n" + body, library)
    unknown = [one for one in checked.diagnostics if one.code == "E0201"]
    assert len(unknown) == 300
    assert sum("did you mean" in one.suggestion for one in unknown) <= 50


def test_an_event_that_is_raised_for_nobody(library):
    body = "state a\n    on bumped -> e / raise goo\n    on bumped if true -> a\nfinal e\n"
    assert ("W0604", 3) in found(library, body)
    assert "W0604" not in dict(found(library, "event goo\n" + body))
    assert "W0604" not in dict(found(library, body + "on goo -> e\n"))
