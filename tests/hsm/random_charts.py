"""Random machines within the subset that the library ``transitions`` shares, and random events for them."""

from hypothesis import strategies as st

from hsm.model.chart import TransitionKind
from tests.hsm.charts import active, compare, model, no, noting, number, on, put, state, variable

EVENTS = ("e", "f")


@st.composite
def shared_models(draw):
    """A tree of states with transitions by events, guarded by counters and by what is active."""
    numbers = iter(range(10_000))
    names = []

    def tree(depth):
        name = f"s{len(names)}"
        names.append(name)
        inner = [tree(depth + 1) for _ in range(draw(st.integers(0, 3 if depth < 3 else 0)))]
        return name, inner

    trees = [tree(1) for _ in range(draw(st.integers(1, 3)))]
    parents = {}

    def walk(one, parent):
        parents[one[0]] = parent
        for child in one[1]:
            walk(child, one[0])

    for one in trees:
        walk(one, None)

    def inside(name, around):
        while name is not None:
            name = parents[name]
            if name == around:
                return True
        return False

    def ways(name, inner):
        found = []
        for _ in range(draw(st.integers(1, 4))):
            target = draw(st.sampled_from([None, *names]))
            # From a state to one deep inside it the engines differ: it is one of its own or lies elsewhere.
            if target is not None and inside(target, name) and parents[target] != name:
                target = parents[target] if parents[target] != name else target
                target = None if inside(target, name) and parents[target] != name else target
            guard = draw(
                st.one_of(
                    st.none(),
                    st.builds(active, st.sampled_from(names)),
                    st.builds(lambda one: no(active(one)), st.sampled_from(names)),
                    st.builds(lambda limit: compare(variable("n"), "<", number(limit)), st.integers(0, 3)),
                )
            )
            actions = [noting(next(numbers))]
            if draw(st.booleans()):
                actions.append(put("n", draw(st.integers(0, 3))))
            kind = TransitionKind.LOCAL if target else TransitionKind.INTERNAL
            found.append(on(draw(st.sampled_from(EVENTS)), target, guard=guard, actions=actions, kind=kind))
        return found

    def spec(one):
        name, inner = one
        return state(
            name,
            *map(spec, inner),
            *ways(name, inner),
            entry=[noting(next(numbers))],
            exit=[noting(next(numbers))],
        )

    return model(*map(spec, trees), variables={"n": 0})


def event_lists(most=20):
    """Events to send one after the other, some of which nobody waits for."""
    return st.lists(st.sampled_from([*EVENTS, "nobody"]), max_size=most)
