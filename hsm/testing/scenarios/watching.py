"""Properties watched while a scripted machine is driven."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from hsm.engine.evaluation import UNSET
from hsm.engine.monitoring import Memory, begin, look
from hsm.model.expressions import Expression
from hsm.model.properties import Property
from hsm.testing.scenarios.driver import Driver


def property_watch(
    properties: Sequence[Property], assumptions: Sequence[Property] = ()
) -> Callable[[Driver], list[str]]:
    """A function to call after each step of one run; it returns the names of the violated properties.

    Args:
        properties: what is watched.
        assumptions: from the first step on in which one of them is broken, nothing is returned.
    """
    memories: list[Memory] = [begin(one, 0.0) for one in properties]
    broken = property_watch(assumptions) if assumptions else None
    ended = False

    def watch(driver: Driver) -> list[str]:
        def holds(condition: Expression) -> bool | None:
            value = driver.value(condition)
            return None if value is UNSET else bool(value)

        nonlocal ended
        violated, entered = [], driver.last.entered
        ended = ended or (broken is not None and bool(broken(driver)))
        for index, one in enumerate(properties):
            memories[index], wrong = look(one, memories[index], driver.time, holds, entered)
            if wrong:
                violated.append(one.name)
        return [] if ended else violated

    return watch


def watches(
    properties: Sequence[Property], assumptions: Sequence[Property] = ()
) -> tuple[Callable[[Driver], str | None], ...]:
    """The same as watches of a scenario: the first violation makes it fail."""
    texts = {one.name: one.text for one in properties}
    look_at, look_around = property_watch(properties), property_watch(assumptions)
    broken: dict[str, None] = {}

    def watch(driver: Driver) -> str | None:
        broken.update(dict.fromkeys(look_around(driver)))
        after = f" (in this run the assumption {next(iter(broken))} was broken)" if broken else ""
        return next((f"property {name} is violated: {texts[name]}{after}" for name in look_at(driver)), None)

    return (watch,) if properties else ()
