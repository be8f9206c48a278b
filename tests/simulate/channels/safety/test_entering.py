"""A stop may enter or cross a lane only where nobody from behind is cut up."""

import pytest

from adeye.kernel.stops import SHOULDER, STRAIGHT
from adeye.simulate.channels.safety.stop_planner import FOUND_FEASIBLE
from tests.simulate.channels.safety.test_planner import HARD_SHOULDER, MIDDLE, SLOW, number, plan


@pytest.mark.parametrize("place", [MIDDLE, MIDDLE + 1.2])
def test_straight_on_leads_into_another_lane_only_where_that_is_seen_to_be_free(
    place: float,
) -> None:
    """From the middle lane towards the left one: also once the side is over the edge."""
    # The gentle one leads off the road.
    straight = slice(number(STRAIGHT, 1), number(STRAIGHT, 3) + 1)
    _, blind = plan([], d=place, align=0.03)
    assert not blind[straight, FOUND_FEASIBLE].any()
    _, seen = plan([], d=place, align=0.03, rear_sight=500.0)
    assert seen[straight, FOUND_FEASIBLE].all()
    _, taken = plan([(-20.0, 8.75, 30.0, 0.0)], d=place, align=0.03, rear_sight=500.0)
    assert not taken[straight, FOUND_FEASIBLE].any()
    _, away = plan([(-20.0, SLOW, 30.0, 0.0)], d=place, align=0.03, rear_sight=500.0)
    assert away[straight, FOUND_FEASIBLE].all()
    _, along = plan([], d=MIDDLE)
    assert along[straight, FOUND_FEASIBLE].all()


def test_path_to_the_right_crosses_a_lane_only_where_that_is_seen_to_be_free() -> None:
    across = number(SHOULDER, 1)
    for things, rear_sight, is_free in (
        ([], 0.0, 0.0),
        ([], 500.0, 1.0),
        ([(-20.0, SLOW, 33.0, 0.0)], 500.0, 0.0),
        ([(-20.0, 8.75, 33.0, 0.0)], 500.0, 1.0),
    ):
        _, found = plan(things, d=MIDDLE, rear_sight=rear_sight)
        assert found[across, FOUND_FEASIBLE] == is_free


def test_shoulder_is_entered_only_where_nobody_comes_along_it() -> None:
    aside = number(SHOULDER, 1)
    for things, is_free in (
        ([(-20.0, HARD_SHOULDER, 30.0, 0.0)], 0.0),
        ([(-300.0, HARD_SHOULDER, 10.0, 0.0)], 1.0),
    ):
        _, found = plan(things)
        assert found[aside, FOUND_FEASIBLE] == is_free
