"""An exported machine, read back, does the same, or the export has said what changes, or the reader refuses it."""

from dataclasses import dataclass, field

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hsm import Library, MachineError, MachineFault, build
from hsm.dsl import parse_model
from hsm.interchange.scxml import differences, read_text, write_text

KINDS = ("state", "state", "parallel")
ORDER = "of what happens in one tick"


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

    def words(self):
        """What its transitions may wait for."""
        inside = [name for one in self.all() for name in one.finals]
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
    timed, raises = draw(st.booleans()), draw(st.booleans())
    text = ["machine m", "event e, f, r"]

    def transition(one):
        triggers = [f"on {word}" for word in one.words()]
        if timed:
            triggers += ["after 0.3 s", "after 0.7 s"]
        trigger = draw(st.sampled_from(triggers))
        if trigger.startswith("on") and draw(st.integers(0, 3)) == 0:
            trigger += draw(st.sampled_from([" if in({})", " if not in({})"])).format(draw(st.sampled_from(known)))
        target = draw(st.none() | st.sampled_from(targets)) if raises else draw(st.sampled_from(targets))
        arrow = f" {draw(st.sampled_from(['->', '->', '=>']))} {target}" if target else ""
        return f"{trigger}{arrow}{' / raise r' if target is None or (raises and draw(st.booleans())) else ''}"

    def write(one, indent):
        text.append(f"{indent}{one.kind} {one.name}")
        text.extend(f"{indent}    {transition(one)}" for _ in range(draw(st.integers(0, 3))))
        for child in one.children:
            write(child, f"{indent}    ")
        text.extend(f"{indent}    final {name}" for name in one.finals)

    for top in tops:
        write(top, "")
    return "\n".join([*text, "final end"])


@settings(max_examples=100, deadline=None, suppress_health_check=list(HealthCheck))
@given(machines(), st.lists(st.lists(st.sampled_from(["e", "f", "r"]), max_size=2), max_size=12))
def test_a_machine_read_back_does_the_same(text, inputs):
    try:
        model = parse_model(text, Library("none"))
    except MachineError:
        return
    found = differences(model)
    if any(not one.message.startswith(ORDER) for one in found):
        return
    try:
        back = read_text(write_text(model))
    except MachineError:
        return
    timed = bool(found)
    try:
        run = build(model).start()
    except MachineFault:
        return
    other = build(back).start()
    assert other.configuration == run.configuration
    for number, events in enumerate(inputs, 1):
        time = number / 10
        due = sum(abs(one / 1e9 - time) < 1e-6 or one / 1e9 < time for one in run._state.timers.values())
        if timed and due > 1:
            return  # in one tick, each has its own order
        given_events = [] if timed and due else events
        try:
            run.step(time, given_events)
        except MachineFault:
            return
        other.step(time, given_events)
        assert other.configuration == run.configuration, (time, given_events)
        assert other.outcome == run.outcome
