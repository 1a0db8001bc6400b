"""Properties watched while a scripted machine is driven."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hsm.engine.evaluation import UNSET
from hsm.engine.monitoring import Memory, begin, look
from hsm.model.expressions import Expression
from hsm.model.properties import Property
from hsm.testing.scenarios.driver import Driver


def property_watch(properties: Sequence[Property]) -> Callable[[Driver], list[str]]:
    """A function to call after each step of one run; it returns the names of the violated properties."""
    memories: list[Memory] = [begin(one, 0.0) for one in properties]

    def watch(driver: Driver) -> list[str]:
        def holds(condition: Expression) -> bool | None:
            value = driver.value(condition)
            return None if value is UNSET else bool(value)

        violated, entered = [], driver.last.entered
        for index, one in enumerate(properties):
            memories[index], wrong = look(one, memories[index], driver.time, holds, entered)
            if wrong:
                violated.append(one.name)
        return violated

    return watch


def watches(properties: Sequence[Property]) -> tuple[Callable[[Driver], str | None], ...]:
    """The same as watches of a scenario: the first violation makes it fail."""
    texts = {one.name: one.text for one in properties}
    look_at = property_watch(properties)

    def watch(driver: Driver) -> str | None:
        return next((f"property {name} is violated: {texts[name]}" for name in look_at(driver)), None)

    return (watch,) if properties else ()
