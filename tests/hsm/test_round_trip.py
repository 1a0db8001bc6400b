"""An exported machine, read back, does the same, or the export has said what changes, or the reader refuses it."""

from dataclasses import dataclass, field

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsm import Library, MachineError, MachineFault, build
from hsm.dsl import parse_model
from hsm.engine.occurrences import checked_events
from hsm.interchange.scxml import differences, read_text, write_text
from hsm.interchange.scxml.ecmascript import EcmaScript

KINDS = ("state", "state", "parallel")
ORDER = "the inputs of one tick"
DATA = [
    "event lift(height : length, up : bool, pace : Pace, number : int)",
    "enum Pace = slow, quick",
    "param near : length = 0.5 m",
    "param is : length = 2 * near",
    "var n : int = 0",
    "var part : number = 0.5",
    "var high : length = near",
    "var pace : Pace = slow",
    "var new : bool = false",
    "define busy = n > 1 and (pace == quick or not new)",
    "expose n, pace",
]
CONDITIONS = [
    "n > 1", "n * 2 - 1 <= 3", "busy", "not busy", "new == (n == 2)", "pace == quick", "pace != slow and n >= 0",
    "high < near", "(high / near) > 1.5", "abs(high - is) < 1 m", "min(high, near, 0.3 m) == 0.3 m",
    "(n if new else -n) < 0",
    "(pace if new else quick) == slow", "max(part, -part) == part", "not (new and n == 0) or -(n - 1) > -2",
    "(n - (1 - n)) == 1", "1 - (part - 0.5) * 2 > 0.1",
]  # fmt: skip
CARRIED = [
    "lift.up",
    "lift.height > near",
    "not lift.up and lift.number == n",
    "lift.pace == pace",
    "lift.number < 2 * n",
]
ACTIONS = [
    "n += 1", "n = -n", "n *= 2", "part -= 0.1", "high = near + 0.1 m", "high *= 2", "pace = quick", "new = not new",
    "n = 0",    "pace = (slow if new else quick)", "part = n / 3", "high = high + (1 m if busy else -1 m)", "raise r",
    "raise lift(high, new, pace, n + 1)", "raise lift(1 m, number = n, up = true, pace = slow) after 0.25 s",
    "raise r after 0.35 s", "cancel r", "cancel lift",
]  # fmt: skip
TAKEN = ["n = lift.number", "high = lift.height + near", "new = lift.up", "pace = (lift.pace if lift.up else slow)",
         "raise lift(lift.height, not lift.up, quick, lift.number - 1) after 0.1 s"]  # fmt: skip
FORESEEN = [
    "defer e",
    "defer lift if n > 1",
    "on e / send lift(1 m, true, slow, 3)",
    "when n > 2 / n = 0",
    "on * / n = 1",
]
"""Lines that mean something else in SCXML."""
EVENTS = ["e", "f", "r", "lift(0.5 m, true, slow, 2)", "lift(1 m, false, quick, -1)"]


@dataclass
class Drawn:
    """A state of a random machine."""

    name: str
    kind: str
    children: list["Drawn"] = field(default_factory=list)
    finals: list[str] = field(default_factory=list)

    def all(self):
        yield self
        for child in self.children:
            yield from child.all()

    def completes(self):
        if self.kind == "parallel":
            return all(child.completes() for child in self.children)
        return bool(self.finals)

    def words(self, *, finals):
        """What its transitions may wait for, with or without the names of its final states."""
        inside = [name for one in self.all() for name in one.finals] if finals else []
        return ["e", "e, f", "f", "r", *inside, *inside, *["done"] * 2 * self.completes()]


@st.composite
def machines(draw):
    """The text of a machine with all kinds of states, completions, histories, raised events and time-outs."""
    names = iter(range(1000))

    def tree(depth, kind):
        one = Drawn(f"s{next(names)}", kind)
        for _ in range(draw(st.integers(2, 3)) if kind == "parallel" else draw(st.integers(0, 3 if depth < 3 else 0))):
            inner = "state" if kind == "parallel" or depth >= 2 else draw(st.sampled_from(KINDS))
            one.children.append(tree(depth + 1, inner))
        if one.children and kind == "state":
            one.finals = [f"{one.name}f{number}" for number in range(draw(st.integers(0, 2)))]
        return one

    tops = [tree(0, draw(st.sampled_from(KINDS))) for _ in range(draw(st.integers(1, 3)))]
    states = [one for top in tops for one in top.all()]
    known = [name for one in states for name in (one.name, *one.finals)]
    compound = [one.name for one in states if one.children]
    targets = [*known, "end", *(f"{one}.history" for one in compound), *(f"{one}.deep_history" for one in compound)]
    timed, raises, data = draw(st.booleans()), draw(st.booleans()), draw(st.booleans())
    foreseen = draw(st.integers(0, 5)) == 0
    text = ["machine m", "event e, f, r", *(DATA if data else ())]

    def actions(carried):
        kinds = [*ACTIONS, *TAKEN * 2] if carried else ACTIONS
        return f" / {', '.join(draw(st.lists(st.sampled_from(kinds), min_size=1, max_size=3)))}"

    def transition(one):
        triggers = [f"on {word}" for word in one.words(finals=not data or foreseen)]
        if timed:
            triggers += ["after 0.3 s", "after 0.7 s"]
        if data:
            triggers += ["on lift", "on lift", "on lift, e"]
        if data and timed and draw(st.integers(0, 3)) == 0:
            return f"every 0.4 s{actions(carried=False)}"
        if data and foreseen and draw(st.integers(0, 3)) == 0:
            return draw(st.sampled_from(FORESEEN))
        trigger = draw(st.sampled_from(triggers))
        if data and trigger.startswith("on") and draw(st.booleans()):
            guards = [*CONDITIONS, *CARRIED * 4] if trigger == "on lift" else CONDITIONS
            trigger += f" if {draw(st.sampled_from(guards))}"
        elif trigger.startswith("on") and draw(st.integers(0, 3)) == 0:
            trigger += draw(st.sampled_from([" if in({})", " if not in({})"])).format(draw(st.sampled_from(known)))
        target = draw(st.none() | st.sampled_from(targets)) if raises else draw(st.sampled_from(targets))
        arrow = f" {draw(st.sampled_from(['->', '->', '=>']))} {target}" if target else ""
        if data and (target is None or draw(st.booleans())):
            return f"{trigger}{arrow}{actions(carried=trigger.startswith('on lift') and 'on lift,' not in trigger)}"
        return f"{trigger}{arrow}{' / raise r' if target is None or (raises and draw(st.booleans())) else ''}"

    def write(one, indent):
        text.append(f"{indent}{one.kind} {one.name}")
        text.extend(f"{indent}    {transition(one)}" for _ in range(draw(st.integers(0, 3))))
        if data:
            text.extend(
                f"{indent}    {word}{actions(carried=False)}" for word in ("entry", "exit") if draw(st.booleans())
            )
        for child in one.children:
            write(child, f"{indent}    ")
        text.extend(f"{indent}    final {name}" for name in one.finals)

    for top in tops:
        write(top, "")
    return "\n".join([*text, "final end"])


@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(machines(), st.lists(st.lists(st.sampled_from(EVENTS), max_size=2), max_size=12))
def test_a_machine_read_back_does_the_same(text, inputs):
    try:
        model = parse_model(text, Library("none"))
    except MachineError:
        return
    found = differences(model)
    if any(not one.message.startswith(ORDER) for one in found):
        return
    back = read_text(write_text(model))
    timed = bool(found)
    try:
        run = build(model).start()
    except MachineFault:
        return
    other = build(back).start()
    assert other.configuration == run.configuration
    for number, events in enumerate(inputs, 1):
        time = number / 10
        sooner = (1e9 * time) + 1e3
        due = sum(one < sooner for one in run._state.timers.values())
        if timed and due + sum(one < sooner for one, _ in run._state.sent) > 1:
            return  # in one tick, each has its own order
        known = [one for one in events if one.partition("(")[0] in model.events]
        given_events = checked_events(model, [] if timed and due else known)
        try:
            run.step(time, given_events)
        except MachineFault:
            return
        other.step(time, given_events)
        assert other.configuration == run.configuration, (time, given_events)
        assert other.outcome == run.outcome
        if run.outcome is None:
            assert values(other, model) == {one.name: run.variables[one.name] for one in model.variables}


def values(other, model):
    """The values of a machine's variables in the run of its chart."""
    names = EcmaScript.of(model).names
    return {one.name: other._state.store.values[names[one.name]] for one in model.variables}


@settings(max_examples=25, deadline=None)
@given(
    st.integers(-3, 5), st.sampled_from([-1.0, 0.0, 0.3, 0.5, 2.0]), st.sampled_from(["slow", "quick"]), st.booleans()
)
def test_every_expression_means_the_same_in_a_chart(number, length, pace, new):
    asked = [*(one.replace("lift.", "put.") for one in CARRIED), *CONDITIONS]
    text = "\n".join(
        [
            "machine m",
            "event put(number : int, height : length, pace : Pace, up : bool)",
            *DATA[1:-1],
            *(f"var c{index} : bool = false" for index in range(len(asked))),
            "state a",
            "    on put / n = put.number, high = put.height, part = put.height / 1 m, pace = put.pace, new = put.up, "
            + ", ".join(f"c{index} = {one}" for index, one in enumerate(asked)),
        ]
    )
    model = parse_model(text, Library("none"))
    run, other = build(model).start(), build(read_text(write_text(model))).start()
    events = checked_events(model, [f"put({number}, {length} m, {pace}, {str(new).lower()})"])
    run.step(0.1, events)
    other.step(0.1, events)
    assert values(other, model) == {one.name: run.variables[one.name] for one in model.variables}
