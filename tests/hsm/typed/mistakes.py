"""Mistakes that a type checker finds; each of these lines is one."""

import hsm
from tests.hsm.typed.lamp import TEXT, Light, Room, library

machine = hsm.loads(TEXT, library)
run = machine.start(facts="no room")  # wrong facts at the start
run.step(0.1, facts=3)  # wrong facts in a step
run.step("now")  # a time that is not a number
wrong: list[str] = [effect for _, effect in run.act(Room(dark=True, distance=1.0))]  # effects of another type
hsm.Machine[Room, Light].start(machine, time="late")  # a start at no time


@library.signal("wrong")  # a signal of other facts
def wrong_signal(facts: int) -> bool:
    return facts > 0


@library.activity("idle")
class Idle:  # an activity that does nothing
    pass
