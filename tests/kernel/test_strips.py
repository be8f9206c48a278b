"""What lies across an imported road: lanes are found where they are, and nowhere else."""

import math

import numpy as np
import pytest

from adeye.kernel import strips

# A shoulder, two lanes of which the right one begins at 100 m from nothing, one of the other way
# behind a kerb of none, and a walk beyond a gap.
SLABS = np.array([[0.0, 0.0, 4.0, 1.0], [100.0, 4.0, 5.0, 2.0], [math.inf, 0.0, 0.0, 0.0]])
STRIPS = np.array(
    [
        [strips.SHOULDER, 0, 20.0, -1, -2.5, 0.0, 0.0, 0.0],
        [strips.DRIVING, 1, 20.0, 0, 0.0, 0.0, 3.5, 0.0],
        [strips.DRIVING, -1, 15.0, -1, 3.5, 0.0, 6.5, 0.0],
        [strips.WALKING, 0, 1.0, -1, 7.0, 0.0, 8.5, 0.0],
        [strips.SHOULDER, 0, 20.0, -1, -5.5, 0.0, -3.0, 0.0],
        [strips.DRIVING, 1, 10.0, 0, -3.0, 0.0, 0.0, 0.02],
        [strips.DRIVING, 1, 20.0, 1, 0.0, 0.02, 3.5, 0.02],
        [strips.DRIVING, -1, 15.0, -1, 3.5, 0.02, 6.5, 0.02],
        [strips.WALKING, 0, 1.0, -1, 7.0, 0.02, 8.5, 0.02],
    ]
)


def test_a_slab_goes_on_to_the_next_and_the_outer_ones_for_ever() -> None:
    found = [strips.slab_at(SLABS, s) for s in (-9.0, 0.0, 99.9, 100.0, 1e6)]
    assert found == [0, 0, 0, 1, 1]


def test_lanes_of_the_way_are_counted_from_the_right_where_they_are() -> None:
    assert [strips.lanes_at(SLABS, s) for s in (50.0, 150.0)] == [1, 2]
    assert strips.lane_ends(SLABS, STRIPS, 50.0, 0) == (0.0, 3.5)
    assert strips.lane_ends(SLABS, STRIPS, 150.0, 1) == pytest.approx((1.0, 4.5))


def test_a_lane_that_is_not_there_is_beside_the_outermost_and_as_wide() -> None:
    assert strips.lane_ends(SLABS, STRIPS, 50.0, 1) == (3.5, 7.0)
    assert strips.lane_ends(SLABS, STRIPS, 50.0, -1) == (-3.5, 0.0)


@pytest.mark.parametrize(
    ("s", "d", "lane"),
    [(50.0, 0.0, 0), (50.0, 3.5, -1), (50.0, -0.1, -1), (150.0, -1.0, 0), (150.0, 4.4, 1)],
)
def test_a_place_is_in_the_lane_between_whose_edges_it_lies(s: float, d: float, lane: int) -> None:
    assert strips.lane_of(SLABS, STRIPS, s, d) == lane


def test_lanes_of_the_other_way_are_counted_from_the_right_of_who_drives_there() -> None:
    assert strips.opposite_ends(SLABS, STRIPS, 50.0, 0) == (3.5, 6.5)
    assert math.isnan(strips.opposite_ends(SLABS, STRIPS, 50.0, 1)[0])


def test_lanes_of_the_other_way_beyond_a_median_are_not_met_by_who_is_oncoming() -> None:
    divided = np.vstack([STRIPS[:2], STRIPS[2], STRIPS[2]])
    divided[2, strips.STRIP_KIND], divided[2, strips.STRIP_WAY] = strips.OTHER, 0.0
    divided[3, strips.STRIP_RIGHT], divided[3, strips.STRIP_LEFT] = 6.5, 10.0
    slabs = np.array([[0.0, 0.0, 4.0, 1.0], [math.inf, 0.0, 0.0, 0.0]])
    assert math.isnan(strips.opposite_ends(slabs, divided, 50.0, 0)[0])
    divided[2] = STRIPS[2]
    assert strips.opposite_ends(slabs, divided, 50.0, 1) == (3.5, 6.5)
    # Lanes of the ego's way may lie on either side of a strip for nobody.
    both = np.vstack([STRIPS[1], STRIPS[3], STRIPS[1], STRIPS[2]])
    both[1, strips.STRIP_KIND] = strips.OTHER
    assert strips.opposite_ends(slabs, both, 50.0, 0) == (3.5, 6.5)
    # What lies to the right of the ego's lanes is not met, either.
    assert math.isnan(strips.opposite_ends(slabs, both[[3, 1, 2, 0]], 50.0, 0)[0])


def test_the_limit_is_that_of_the_nearest_lane_of_the_way() -> None:
    places = [(50.0, 1.0), (150.0, -1.0), (150.0, 2.0), (150.0, 9.0), (150.0, -9.0)]
    assert [strips.limit_at(SLABS, STRIPS, *place) for place in places] == [20, 10, 20, 20, 10]


def test_what_carries_a_vehicle_ends_where_strips_do_not_touch_or_one_walks() -> None:
    assert strips.paved_ends(SLABS, STRIPS, 50.0) == (-2.5, 6.5)
    apart = STRIPS.copy()
    apart[0, strips.STRIP_LEFT] = -1.0
    assert strips.paved_ends(SLABS, apart, 50.0) == (0.0, 6.5)


def test_a_shoulder_is_one_only_beside_the_rightmost_lane() -> None:
    assert strips.shoulder_ends(SLABS, STRIPS, 50.0) == (-2.5, 0.0)
    assert strips.shoulder_ends(SLABS, STRIPS, 150.0) == (-5.5, -3.0)
    apart = STRIPS.copy()
    apart[0, strips.STRIP_LEFT] = -1.0
    assert strips.shoulder_ends(SLABS, apart, 50.0) == (0.0, 0.0)


def own(*lanes: tuple[int, float, float, float, float]) -> list[list[float]]:
    """Return strips of the ego's way by number and edges with their slopes, right and left."""
    return [[strips.DRIVING, strips.OWN, 30.0, *lane] for lane in lanes]


# The right of three lanes narrows from 200 m on, and is none any more at 300 m; the left one ends
# at 400 m as wide as it was, where the middle one begins to move aside.
ENDING = [
    (0.0, own((0, 0.0, 0.0, 3.5, 0.0), (1, 3.5, 0.0, 7.0, 0.0), (2, 7.0, 0.0, 10.5, 0.0))),
    (200.0, own((0, 0.0, 0.015, 3.5, 0.0), (1, 3.5, 0.0, 7.0, 0.0), (2, 7.0, 0.0, 10.5, 0.0))),
    (300.0, own((-1, 1.5, 0.015, 3.5, 0.0), (0, 3.5, 0.0, 7.0, 0.0), (1, 7.0, 0.0, 10.5, 0.0))),
    (400.0, own((0, 3.5, 0.02, 7.0, 0.02))),
    (500.0, own((0, 5.5, 0.0, 9.0, 0.0))),
]


def left(s: float, lane: int, far: float = 1e3) -> tuple[float, int]:
    slabs = np.array(
        [
            [begin, 3.0 * number, len(lanes), sum(lane[strips.STRIP_LANE] >= 0 for lane in lanes)]
            for number, (begin, lanes) in enumerate(ENDING)
        ]
        + [[math.inf, 0.0, 0.0, 0.0]]
    )
    rows = [row for _, lanes in ENDING for row in [*lanes, *[[0.0] * 8] * (3 - len(lanes))]]
    ends, limits = np.zeros((len(rows), strips.ENDS_WIDTH)), np.zeros((len(slabs), 2))
    strips.look_ahead(slabs, np.array(rows), ends, limits)
    return strips.lane_left(slabs, np.array(rows), ends, s, lane, far)


def test_a_lane_is_left_where_it_is_too_narrow_or_where_it_stops() -> None:
    assert left(100.0, 0) == pytest.approx((200.0 - 100.0 + 1.0 / 0.015, 1))
    assert left(100.0, 2) == pytest.approx((300.0, -1))
    assert left(350.0, 1) == pytest.approx((50.0, -1))
    assert left(280.0, 0) == (0.0, 1)


@pytest.mark.parametrize(("right", "left_slope"), [(0.02, 0.005), (0.03, 0.015), (0.0, -0.015)])
def test_a_lane_is_left_where_both_edges_leave_too_little_of_it(
    right: float, left_slope: float
) -> None:
    middle = own((0, 0.0, right, 3.5, left_slope), (1, 3.5, left_slope, 9.0, 0.0))
    ends = own((-1, 100 * right, 0.0, 3.5 + 100 * left_slope, 0.0))
    slabs = np.array([[0.0, 0.0, 2.0, 2.0], [100.0, 2.0, 2.0, 1.0], [math.inf, 0.0, 0.0, 0.0]])
    beside = own((0, 3.5 + 100 * left_slope, 0.0, 9.0, 0.0))
    rows = np.array([*middle, *ends, *beside])
    found, limits = np.zeros((4, strips.ENDS_WIDTH)), np.zeros((3, 2))
    strips.look_ahead(slabs, rows, found, limits)
    room, aside = strips.lane_left(slabs, rows, found, 10.0, 0, 1e3)
    assert room == pytest.approx(1.0 / (right - left_slope) - 10.0)
    assert aside == 1


def test_limits_are_one_as_long_as_no_lane_has_another() -> None:
    begins = (0.0, 100.0, 200.0, math.inf)
    slabs = np.array([[s, 2.0 * (k % 3), 2.0 * (k < 3), 2.0] for k, s in enumerate(begins)])
    rows = np.array([*own((0, 0.0, 0.0, 3.5, 0.0), (1, 3.5, 0.0, 7.0, 0.0))] * 3)
    rows[5, strips.STRIP_LIMIT] = 20.0
    ends, limits = np.zeros((6, strips.ENDS_WIDTH)), np.zeros((4, strips.LIMITS_WIDTH))
    strips.look_ahead(slabs, rows, ends, limits)
    assert limits[:3, strips.LIMIT_ALL].tolist() == pytest.approx(
        [30.0, 30.0, math.nan], nan_ok=True
    )
    assert limits[:3, strips.LIMIT_NEXT].tolist() == [2.0, 2.0, 3.0]


def test_a_lane_that_moves_aside_goes_on_and_what_is_far_is_not_looked_at() -> None:
    assert left(100.0, 1) == left(450.0, 0) == left(-50.0, 1) == (math.inf, 0)
    assert left(100.0, 0, far=150.0) == (math.inf, 0)
    assert (left(100.0, 2, far=300.0), left(100.0, 2, far=299.0)) == ((300.0, -1), (math.inf, 0))
