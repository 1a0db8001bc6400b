"""Drives the machine on the toy."""

from toy import Toy
from vacuum_robot import LIBRARY

import hsm

toy = Toy()
run = hsm.load("dock.maze-machine", LIBRARY).start(facts=toy.sense())
for tick in range(1, 1000):
    facts = toy.sense()
    step = run.step(tick / 10, ["button"] if tick == 1 else [], facts)
    toy.move([effect for _, effect in run.act(facts)])
    if step:
        print(f"{tick / 10:5.1f} s  {toy.place:4.2f} m  charge {toy.charge:4.2f}  {', '.join(sorted(step.entered))}")
    if tick > 1 and "waiting" in run.configuration:
        break
