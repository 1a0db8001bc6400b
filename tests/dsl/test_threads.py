"""Machines are loaded and run from several threads at once."""

import gc
import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

import pytest

from hsm import build
from hsm.dsl import check_text
from hsm.dsl.format.formatter import format_text
from hsm.model.diagnostics import MachineError
from tests.dsl.library import make_library

LIBRARY = make_library()
GOOD = """machine good

state first
    do follow_wall(left)
    when space.left -> second

state second
    do follow_wall(left)
    when not space.left -> first
"""
UNCLOSED = GOOD.replace("follow_wall(left)", "rotate(", 1)
MISFIT = GOOD.replace("    when space.left", "  when space.left")
UNREADABLE = "machine bad\n" + "state (\n" * 40
TEXTS = (GOOD, UNCLOSED, MISFIT, UNREADABLE)


@pytest.fixture(autouse=True)
def threads_that_take_turns_often():
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(interval)


def together(work, count):
    """What some calls come to that begin at the same time, each in a thread of its own."""
    barrier = Barrier(count)

    def begin(number):
        barrier.wait(timeout=60)
        return work(number)

    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(begin, range(count)))


def test_texts_checked_at_once_give_what_they_give_alone():
    alone = [check_text(text, LIBRARY).diagnostics for text in TEXTS]
    assert [bool(found) for found in alone] == [False, True, True, True]
    found = together(lambda number: [check_text(TEXTS[number % 4], LIBRARY).diagnostics for _ in range(12)], 4)
    for number, diagnostics in enumerate(found):
        assert diagnostics == [alone[number % 4]] * 12


def test_a_text_is_formatted_while_others_are_checked():
    def work(number):
        if number % 2:
            with pytest.raises(MachineError):
                format_text(UNCLOSED)
            return None
        return [format_text(GOOD) for _ in range(12)]

    assert together(work, 4)[0] == [GOOD] * 12


def test_runs_in_several_threads_share_one_machine():
    states = "".join(f"state s{n}\n    when space.left and n == {n} -> s{n + 1} / n += 1\n" for n in range(40))
    text = f"machine long\n\nvar n : int = 0\n\n{states}\nfinal s40\n"
    checked = check_text(text, LIBRARY)
    assert checked.model is not None, checked.diagnostics
    machine = build(checked.model)
    facts = {"space.left": True}

    def run(_):
        supervisor = machine.start(facts=facts)
        steps = [supervisor.step(tick * 0.1, facts=facts) for tick in range(3)]
        return supervisor.outcome, [step.exited for step in steps]

    found = together(run, 8)
    assert found[0][0] == "s40"
    assert found == [found[0]] * 8


def test_loading_leaves_the_garbage_collector_on():
    class Asking(dict):
        def get(self, key, default=None):
            assert gc.isenabled()
            return super().get(key, default)

    library = make_library()
    library.signals = Asking(library.signals)
    assert check_text(GOOD, library).model is not None
