"""What Tremaux's marks tell in a second attempt."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception.marks import Direction, Marks
from perception.places import NotedPlace, Places
from perception.settings import PerceptionSettings
from perception.world import WorldModel
from transport.messages import Pose

WAYS = (Direction.AHEAD, Direction.LEFT, Direction.BACK, Direction.RIGHT)
"""Counter-clockwise from ahead, as quarters are."""


def leading(marks, heading=0.0, at=(2.0, 1.0)):
    """The ways that lead out, at a junction with these marks that the robot comes to."""
    known = Marks(0.35, known=Places(kept=[NotedPlace(Pose(2.0, 1.0), marks=list(marks)), NotedPlace(Pose(9.0, 9.0))]))
    known.arrive(Pose(*at, heading))
    return [way for way in WAYS if known.leads_out(way)]


@pytest.mark.parametrize("quarter", range(4))
@pytest.mark.parametrize(
    ("marks", "ways"),
    [
        ((1, 0, 1, 0), [Direction.AHEAD]),
        ((0, 1, 1, 2), [Direction.LEFT]),
        ((2, 2, 1, 1), [Direction.RIGHT]),
        ((2, 0, 2, 2), [Direction.BACK]),
        ((0, 0, 1, 0), []),  # the run ended here
        ((1, 1, 2, 0), []),  # one leads to the start, one to the exit
    ],
)
def test_the_way_with_one_mark_leads_out_whichever_way_the_junction_is_turned(marks, ways, quarter):
    turned = [marks[(way - quarter) % 4] for way in range(4)]
    assert leading(turned, quarter * math.pi / 2 + 0.1) == ways


def test_a_junction_that_is_not_known_or_not_new_tells_nothing():
    assert leading((1, 0, 1, 0), at=(2.0, 1.4)) == []
    marks = Marks(0.35, known=Places(kept=[NotedPlace(Pose(), marks=[1, 0, 1, 0])]))
    assert not marks.leads_out(Direction.AHEAD)
    marks.arrive(Pose())
    assert marks.leads_out(Direction.AHEAD)
    marks.arrive(Pose())
    assert not marks.leads_out(Direction.AHEAD)


def test_known_marks_are_not_changed_and_drift_is_allowed_for():
    places = [NotedPlace(Pose(float(x), 0.0), marks=[1, 0, 1, 0]) for x in range(10)]
    marks = Marks(0.35, known=Places(kept=places))
    for x in range(10):
        marks.arrive(Pose(1.08 * x + 0.1, 0.0))
        assert marks.leads_out(Direction.AHEAD)
    assert [place.marks for place in places] == [[1, 0, 1, 0]] * 10
    assert [place.pose.x for place in places] == list(range(10))


@st.composite
def explorations(draw):
    """A grid of junctions in which some neighbours are joined, and the order in which ways are preferred."""
    ways = [((x, y), way) for x in range(4) for y in range(4) for way in (0, 1)]
    joined = draw(st.sets(st.sampled_from(ways), min_size=8))
    return joined, draw(st.permutations(range(4))), draw(st.sampled_from([(x, y) for x in range(4) for y in range(4)]))


STEPS = ((1, 0), (0, 1), (-1, 0), (0, -1))


def tremaux(joined, order, goal, marks):
    """Follow Tremaux's rules from the junction at (0, 0), first come to along +x, to the goal: the steps, or None."""

    def free(here, quarter):
        there = (here[0] + STEPS[quarter][0], here[1] + STEPS[quarter][1])
        return ((here, quarter) if quarter < 2 else (there, quarter - 2)) in joined

    here, quarter = (0, 0), 0
    for steps in range(200):
        if here == goal:
            return steps
        marks.arrive(Pose(*map(float, here), quarter * math.pi / 2))
        onward = [way for way in order if way != 2 and free(here, (quarter + way) % 4)]
        told = [way for way in (*onward, 2) if marks.leads_out(WAYS[way])]
        fresh = [way for way in onward if marks.count(WAYS[way]) == 0]
        if not marks.new and marks.count(Direction.BACK) == 1:
            way = 2
        elif told or fresh:
            way = (told or fresh)[0]
        elif marks.count(Direction.BACK) == 1:
            way = 2
        else:
            way = next((way for way in onward if marks.count(WAYS[way]) == 1), None)
        if way is None or not (way in onward or here != (0, 0) or free(here, (quarter + 2) % 4)):
            return None  # nothing is left but the way by which it came in
        marks.mark(WAYS[way])
        quarter = (quarter + way) % 4
        here = (here[0] + STEPS[quarter][0], here[1] + STEPS[quarter][1])
    raise AssertionError("the rules end before so many steps")


@given(explorations())
def test_in_any_maze_the_second_attempt_takes_no_step_twice_and_none_more_than_the_first(exploration):
    joined, order, goal = exploration
    first = WorldModel(PerceptionSettings())
    explored = tremaux(joined, order, goal, first.marks)
    if explored is None:
        return
    second = first.from_the_start()
    assert (second.pose, second.doors, second.travelled) == (Pose(), [], 0.0)
    direct = tremaux(joined, order, goal, second.marks)
    assert direct is not None
    assert direct <= explored
    assert len(second.marks.places.kept) == direct, "no junction is come to twice"
