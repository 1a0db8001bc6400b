"""Dataclasses whose comparison, hash and text are written at first use are like the standard ones."""

import copy
import dataclasses
import inspect
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


class Many:
    """Every kind of parameter, and what `__init__` does after it has set them."""

    one: int
    listed: list[int] = dataclasses.field(default_factory=list)
    named: int = dataclasses.field(default=3, kw_only=True)
    needed: str = dataclasses.field(kw_only=True)
    derived: int = dataclasses.field(init=False, default=4)
    made: dict[str, int] = dataclasses.field(init=False, default_factory=dict)
    later: int = dataclasses.field(init=False)

    def __post_init__(self):
        object.__setattr__(self, "later", self.one + self.named)


class Passing:
    """A parameter that is not a field; and a subclass may have fields with the same machinery."""

    one: int
    passed: "dataclasses.InitVar[int]" = 2
    two: int = 0

    def __post_init__(self, passed):
        object.__setattr__(self, "two", passed)


@pytest.mark.parametrize("body", [Plain, Hashed, Many, Passing])
@pytest.mark.parametrize("options", OPTIONS[:5], ids=str)
def test_it_is_made_as_by_the_standard_one(body, options):
    standard, ours = both(body, options)
    calls = [(), (1,), (1, [2]), (1, 2, 3), (1, 2, 3, 4)], [{}, {"needed": "n"}, {"needed": "n", "named": 5}, {"no": 1}]
    seen = []
    for made in (standard, ours):
        made.__qualname__ = body.__name__
        seen.append([str(inspect.signature(made))])
        for positional in calls[0]:
            for named in calls[1]:
                try:
                    value = made(*positional, **named)
                except TypeError as error:
                    seen[-1].append(str(error).partition(".")[2])
                else:
                    seen[-1].append([getattr(value, one.name) for one in dataclasses.fields(value)])
        seen[-1].append(str(inspect.signature(made)))
    assert seen[0] == seen[1]
    assert ours.__dataclass_params__.frozen == standard.__dataclass_params__.frozen
    assert body is not Many or ours(1, needed="").listed is not ours(1, needed="").listed


def test_a_subclass_of_a_frozen_class_has_attributes_of_its_own():
    class Wider(Kept):
        """Not declared as a dataclass."""

        def __init__(self, one, wide):
            super().__init__(one)
            self.wide = wide

    assert inspect.signature(Wider).parameters.keys() == {"one", "wide"}
    wider = Wider(1, 2)
    assert (wider.one, wider.wide) == (1, 2)
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'one'"):
        wider.one = 2
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot delete field 'one'"):
        del wider.one
    del wider.wide
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'none'"):
        Kept(1).none = 2


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
