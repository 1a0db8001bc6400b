"""Dataclasses whose comparison, hash and text are written at first use are like the standard ones."""

import copy
import dataclasses
import pickle

import pytest

from hsm.model import values

OPTIONS = [
    {},
    {"frozen": True},
    {"slots": True},
    {"frozen": True, "slots": True},
    {"frozen": True, "slots": True, "eq": False},
    {"frozen": True, "repr": False},
    {"frozen": True, "slots": True, "order": True},
]


class Plain:
    """Two fields and one that does not count."""

    one: int
    other: float = 0.5
    aside: object = dataclasses.field(default=None, compare=False, repr=False)


class Speaking(Plain):  # noqa: PLW1641 - the decorator decides about the hash
    """What is written by hand is kept."""

    own: str = ""

    def __repr__(self):
        return "spoken"

    def __eq__(self, other):
        return type(other).__name__ == "Speaking"


class Hashed:
    """A hash by hand."""

    one: int

    def __hash__(self):
        return 7


def both(body, options):
    parts = {name: value for name, value in vars(body).items() if name not in ("__dict__", "__weakref__")}
    for decorator in (dataclasses.dataclass, values.dataclass):
        bases = tuple(decorator(**options)(type(base.__name__, (), dict(vars_of(base)))) for base in own_bases(body))
        yield decorator(**options)(type(body.__name__, bases, dict(parts)))


def own_bases(body):
    return [base for base in body.__bases__ if base is not object]


def vars_of(body):
    return {name: value for name, value in vars(body).items() if name not in ("__dict__", "__weakref__")}


@pytest.mark.parametrize("body", [Plain, Speaking, Hashed])
@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_it_is_as_the_standard_one(body, options):
    standard, ours = both(body, options)
    assert [one.name for one in dataclasses.fields(ours)] == [one.name for one in dataclasses.fields(standard)]
    assert ours.__match_args__ == standard.__match_args__
    for made in (standard, ours):
        made.__qualname__ = body.__name__
    seen = []
    for made in (standard, ours):
        first, same, different = made(1), made(1), made(2)
        text = repr(first).split(" at 0x")[0]
        seen.append((text, first == same, first != different, first == different, first == 1, first == (1, 0.5)))
        if made.__hash__ is None:
            seen[-1] += ("no hash",)
        elif options.get("eq", True):
            seen[-1] += (hash(first) == hash(same), len({first, same, different}))
        if options.get("frozen"):
            with pytest.raises(dataclasses.FrozenInstanceError):
                first.one = 3
        assert dataclasses.replace(first, one=2) == different or not options.get("eq", True)
        assert copy.copy(first).one == 1
    assert seen[0] == seen[1]


@values.dataclass(frozen=True, slots=True)
class Kept:
    """One that pickle finds by its name."""

    one: int
    other: tuple[int, ...] = ()


def test_a_value_goes_through_pickle_and_a_subclass_is_another_kind():
    @values.dataclass(frozen=True, slots=True)
    class More(Kept):
        """One field more."""

        more: int = 0

    assert pickle.loads(pickle.dumps(Kept(1, (2,)))) == Kept(1, (2,))
    assert hash(Kept(1)) == hash(Kept(1))
    assert More(1) != Kept(1)
    assert Kept(1) != More(1)
    assert "More(one=1, other=(), more=0)" in repr(More(1))
