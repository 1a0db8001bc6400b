"""Ten machines that are not robots in mazes, each with what must hold of it and two mistakes to be found."""

from __future__ import annotations

from dataclasses import dataclass

from hsm.dsl import parse_model
from hsm.engine.machine import Machine
from hsm.model.registry import Library
from hsm.model.types import Length, Speed
from tests.trust.library import Skill


@dataclass(frozen=True)
class Mistake:
    """One mistake.

    Attributes:
        machine: name of the machine.
        what: in words.
        before: the text that is changed.
        after: what it is changed to.
        broken: the property that is violated.
    """

    machine: str
    what: str
    before: str
    after: str
    broken: str


def foreign_library() -> Library:
    """What the machines may name."""
    library = Library("foreign")

    def signal(name: str, kind: type) -> None:
        def ask(facts: object) -> object:
            raise AssertionError("nothing is asked of the outside")

        ask.__annotations__["return"] = kind
        library.signal(name)(ask)

    for name in ("door.closed", "above", "below", "at.floor", "obstacle", "code.right", "car.waiting", "dirty",
                 "bin.full", "train.near", "brake", "cup.there", "tank.full", "tank.empty", "lid.open"):  # fmt: skip
        signal(name, bool)
    signal("speed", Speed)
    signal("level", Length)
    signal("charge", float)
    signal("engine.rpm", float)
    for name in ("up", "down", "wait", "heat", "lock", "unlock", "green", "yellow", "red", "suck", "drive", "dock",
                 "brew", "grind", "pump", "drain", "hold", "lower", "lift", "flash", "shift", "coast"):  # fmt: skip
        library.activity(name, outcomes=("done", "failed"))(type(name.title(), (Skill,), {}))
    return library


MACHINES = {
    "elevator": """
machine elevator
event call
var floor : int = 0
property shut   : never (doing(up) or doing(down)) and in(open)
property range  : always floor >= 0 and floor <= 3
property served : after in(closing), in(idle) or in(moving) or in(open) within 6 s
initial idle
state idle
    do wait()
    when above and floor < 3 -> closing
    when below and floor > 0 -> closing
    on call                  -> open
state closing
    do hold()
    when obstacle            -> open
    when door.closed         -> moving
    after 5 s                -> open
state moving
    initial choose
    state choose
        when above and floor < 3 -> rising
        when below and floor > 0 -> falling
        after 1 s                -> open
    state rising
        do up()
        on done   -> open / floor += 1
        on failed -> idle
    state falling
        do down()
        on done   -> open / floor -= 1
        on failed -> idle
state open
    do wait()
    after 3 s                -> idle
""",
    "microwave": """
machine microwave
event start, stop, add
var minutes : int = 0
property safe  : never doing(heat) and in(opened)
property ends  : always eventually not doing(heat) within 61 s
property few   : always minutes <= 5
initial idle
state idle
    when lid.open                      -> opened
    on add if minutes < 5 / minutes += 1
    on start if minutes > 0            -> cooking
state cooking
    do heat()
    when lid.open                      -> opened
    on stop                            -> rest    / minutes = 0
    after 60 s                         -> rest    / minutes = 0
state rest
    after 0.5 s                        -> idle
state opened
    when not lid.open                  -> idle
""",
    "lock": """
machine lock
event key
var tries : int = 0
property closed : after in(locked), code.right before in(unlocked)
property thrice : always tries <= 3
property again  : after in(unlocked), in(locked) within 10.2 s
initial locked
state locked
    do lock()
    on key -> checked
state checked
    when code.right      -> unlocked / tries = 0
    when tries < 2       -> locked   / tries += 1
    when true            -> blocked  / tries += 1
state unlocked
    do unlock()
    after 10 s           -> locked
state blocked
    do lock()
    after 60 s           -> locked / tries = 0
""",
    "traffic_light": """
machine traffic_light
property one_way : never in(main_green) and in(side_green)
property cleared : after in(main_green), in(main_yellow) before in(side_green)
property waits   : always eventually in(main_green) within 21 s
initial main_green
state main_green
    do green()
    after 10 s if car.waiting -> main_yellow
state main_yellow
    do yellow()
    after 3 s                 -> side_green
state side_green
    do red()
    after 8 s                 -> side_yellow
    when not car.waiting      -> side_yellow
state side_yellow
    do yellow()
    after 3 s                 -> main_green
""",
    "gear_box": """
machine gear_box
event up, down
var gear : int = 1
property gears   : always gear >= 1 and gear <= 5
property coasts  : never in(shifting) and doing(drive)
property settles : always eventually not in(shifting) within 2.3 s
initial engaged
state engaged
    do drive()
    on up if gear < 5   -> shifting / gear += 1
    on down if gear > 1 -> shifting / gear -= 1
state shifting
    do shift()
    on done, failed     -> settled
    after 2 s           -> settled
state settled
    do drive()
    after 0.3 s         -> engaged
""",
    "vacuum": """
machine vacuum
event home
param low : number = 0.2
property quiet    : never doing(suck) and in(returning)
property charged  : after in(docked), charge > 0.9 before in(cleaning)
property returns  : after in(returning), not in(returning) within 91 s
initial docked
state docked
    do dock()
    after 1 s if charge > 0.9 -> full
state full
    do wait()
    when dirty        -> cleaning
state cleaning
    do suck()
    when charge < low or bin.full -> returning
    on home                       -> returning
    on failed                     -> stuck
state returning
    do drive()
    on done      -> docked
    on failed    -> stuck
    after 90 s   -> stuck
state stuck
    do wait()
    after 5 s    -> returning
""",
    "coffee": """
machine coffee
event press
var served : int = 0
property cup    : never doing(brew) and not in(brewing)
property ground : after in(ready), in(grinding) before in(brewing)
property ends   : after in(brewing), not in(brewing) within 39.2 s
property counts : always served <= 8
initial ready
state ready
    do wait()
    on press if cup.there and served < 8 -> grinding
    on press if served >= 8              -> emptying
state grinding
    do grind()
    on done   -> filled
    on failed -> ready
    after 20 s -> ready
state filled
    when cup.there     -> brewing
    when not cup.there -> ready
state brewing
    do brew()
    on done, failed -> ready / served += 1
    after 39 s      -> ready / served += 1
state emptying
    do drain()
    on done   -> ready / served = 0
    after 30 s -> ready
""",
    "pump": """
machine pump
var high : length = 2 m
property dry     : never doing(pump) and in(empty)
property limit   : always high <= 2 m
property stops   : always eventually not in(filling) within 120.5 s
property drained : after in(spilling), not in(spilling) within 1.2 s
initial empty
state empty
    do hold()
    when not tank.full and not tank.empty -> filling
state filling
    do pump()
    when tank.full            -> full
    when level > high         -> spilling
    after 120 s               -> full
state full
    do hold()
    when tank.empty           -> empty
    when level > high         -> spilling
state spilling
    do hold()
    after 1 s                 -> emptying
state emptying
    do drain()
    when level < 1 m and level >= 0 m -> full / high = level
    after 30 s                -> empty
""",
    "cruise": """
machine cruise
event on_button, off_button, plus
var wanted : speed = 20 m/s
property braked : never in(holding) and brake
property fast   : always wanted <= 36 m/s
property slow   : after in(suspended), in(holding) or in(off) before doing(drive)
initial off
state off
    on on_button if speed > 10 m/s and speed < 35 m/s -> holding / wanted = speed
state holding
    do drive()
    when brake                             -> suspended
    on off_button                          -> off
    on plus if wanted < 35 m/s / wanted += 1 m/s
state suspended
    do coast()
    on off_button                          -> off
    on on_button if not brake              -> holding
""",
    "crossing": """
machine crossing
property shut   : never in(passing) and in(open)
property warned : after in(open), in(warning) before in(lowering)
property closes : after in(near) and in(warning), in(closed) or in(broken) within 16.5 s
initial both
parallel both
    state gate
        initial open
        state open
            do flash()
            when in(near) -> warning
        state warning
            do flash()
            after 5 s     -> lowering
        state lowering
            do lower()
            on done       -> closed
            on failed     -> broken
            after 11 s    -> broken
        state closed
            do hold()
            when in(gone) -> opening
        state opening
            do lift()
            on done       -> open
            on failed     -> broken
        state broken
            do flash()
    state track
        initial gone
        state gone
            when train.near                   -> near
        state near
            when in(closed) and not train.near -> passing
        state passing
            after 20 s if not train.near      -> gone
""",
}

MISTAKES = (
    Mistake("elevator", "one floor too many", "when above and floor < 3 -> rising",
            "when above and floor <= 3 -> rising", "range"),
    Mistake("elevator", "patience of the door", "after 5 s                -> open", "after 50 s               -> open",
            "served"),
    Mistake("microwave", "heating with an open door", "state opened\n", "state opened\n    do heat()\n", "safe"),
    Mistake("microwave", "minutes instead of seconds", "after 60 s  ", "after 60 min", "ends"),
    Mistake("lock", "a try too many", "when tries < 2 ", "when tries < 4 ", "thrice"),
    Mistake("lock", "unlocked at once", "on key -> checked", "on key -> unlocked", "closed"),
    Mistake("traffic_light", "no yellow", "after 10 s if car.waiting -> main_yellow",
            "after 10 s if car.waiting -> side_green", "cleared"),
    Mistake("traffic_light", "a light that stays", "after 8 s                 -> side_yellow\n",
            "after 8 s if car.waiting and not car.waiting -> side_yellow\n", "waits"),
    Mistake("gear_box", "a sixth gear", "on up if gear < 5 ", "on up if gear <= 5", "gears"),
    Mistake("gear_box", "a shift without end", "    after 2 s           -> settled\n", "", "settles"),
    Mistake("vacuum", "no wait for the charge", "if charge > 0.9 -> full", "if charge > 0.09 -> full",
            "charged"),
    Mistake("vacuum", "lost on the way", "    after 90 s   -> stuck\n", "", "returns"),
    Mistake("coffee", "not ground", "on press if served >= 8              -> emptying",
            "on press                             -> brewing", "ground"),
    Mistake("coffee", "never emptied", "and served < 8 -> grinding", "-> grinding", "counts"),
    Mistake("pump", "any level is remembered", "when level < 1 m and level >= 0 m -> full", "when level > 1 m -> full",
            "limit"),
    Mistake("pump", "slow to drain", "after 1 s                 -> emptying", "after 1 min               -> emptying",
            "drained"),
    Mistake("cruise", "faster without end", "if wanted < 35 m/s / wanted", "/ wanted", "fast"),
    Mistake("cruise", "any speed is taken", "on on_button if speed > 10 m/s and speed < 35 m/s",
            "on on_button if speed > 10 m/s", "fast"),
    Mistake("crossing", "opened too early", "when in(gone) -> opening", "when true -> opening", "shut"),
    Mistake("crossing", "a gate that waits", "after 11 s    -> broken", "after 11 min  -> broken", "closes"),
)  # fmt: skip


def foreign_machine(name: str, mistake: Mistake | None = None) -> Machine:
    """One of the machines, with or without a mistake."""
    text = MACHINES[name]
    if mistake is not None:
        assert text.count(mistake.before) >= 1, mistake.what
        text = text.replace(mistake.before, mistake.after, 1)
    return Machine(parse_model(text, foreign_library(), f"{name}.maze-machine"))
