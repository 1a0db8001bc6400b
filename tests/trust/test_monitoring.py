"""The monitor passes over what cannot have changed; it finds what looking at every property in every step finds."""

import pytest

from hsm.engine.monitoring import PACE, Monitor, Violation, begin, holding, look
from tests.trust.random_machines import drawn_machine
from tests.trust.random_runs import RandomRuns


class TwiceWatched(Monitor):
    """A monitor that is compared, step by step, with one that looks at everything."""

    steps = 0
    found = 0

    def __init__(self, supervisor):
        super().__init__(supervisor)
        self.watched = supervisor
        self.stated = [*supervisor.machine.model.assumptions, *supervisor.machine.model.properties]
        self.kept = [begin(one, supervisor.time) for one in self.stated]
        self.before = set()

    def look(self, facts: object, step) -> tuple[Violation, ...]:
        violations = super().look(facts, step)
        now = set()
        for index, one in enumerate(self.stated):
            holds = holding(self.watched, facts)
            self.kept[index], violated = look(one, self.kept[index], self.watched.time, holds, step.entered)
            if violated:
                now.add(one.name)
        assert [one.property.name for one in violations if one.property is not PACE] == [
            one.name for one in self.stated if one.name in now - self.before
        ]
        self.before = now
        TwiceWatched.steps += 1
        TwiceWatched.found += len(violations)
        return violations


@pytest.mark.parametrize("first", [0, 1_000_000], ids=["plain", "talking"])
def test_the_monitor_finds_what_looking_at_everything_finds(first):
    TwiceWatched.steps = TwiceWatched.found = 0
    for seed in range(first, first + 12):
        RandomRuns(drawn_machine(seed), seed, TwiceWatched).violated(40)
    assert TwiceWatched.steps > 1000
    assert TwiceWatched.found > 30
