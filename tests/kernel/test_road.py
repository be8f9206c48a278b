"""Roads: a place and its point are inverse to each other, on every kind of road."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from adeye.kernel.road import (
    lane_center,
    lane_of,
    lane_way,
    local,
    offset_curvature,
    position,
    road_length,
)
from adeye.kernel.storyboard import advance

Floats = NDArray[np.float64]


def chain(*pieces: tuple[float, float], heading: float = 0.0) -> Floats:
    """Join (length, curvature) pieces, each from the end of the one before."""
    rows = []
    x, y = 12.0, -7.0
    for length, curvature in pieces:
        rows.append((x, y, heading, length, curvature))
        steps = 20000
        for k in range(steps):
            middle = heading + curvature * length * (k + 0.5) / steps
            x += length / steps * math.cos(middle)
            y += length / steps * math.sin(middle)
        heading += curvature * length
    return np.array(rows)


ROADS = {
    "straight": chain((1000.0, 0.0)),
    "oblique": chain((400.0, 0.0), heading=2.9),
    "left_curve": chain((100.0, 0.0), (300.0, 1.0 / 250.0), (500.0, 0.0)),
    "right_curve": chain((100.0, 0.0), (300.0, -1.0 / 250.0), (500.0, 0.0)),
    "s_curve": chain((100.0, 0.0), (200.0, 0.004), (200.0, -0.004), (300.0, 0.0), heading=-1.0),
    "lone_arc": chain((500.0, 0.003)),
    "wide_arc": chain((1000.0, 1e-9)),
}


@pytest.mark.parametrize("name", ROADS)
@pytest.mark.parametrize("d", [-3.0, 0.0, 1.75, 5.25, 14.0])
def test_point_of_a_place_is_at_that_place(name: str, d: float) -> None:
    segments = ROADS[name]
    end = road_length(segments)
    for s in (-30.0, -1e-6, 0.0, 55.0, 100.0, 150.0, 299.9, 0.99 * end, end, end + 40.0):
        x, y, heading = position(segments, s, d)
        back_s, back_d, back_heading, _ = local(segments, x, y)
        assert back_s == pytest.approx(s, abs=2e-6)
        assert back_d == pytest.approx(d, abs=2e-6)
        assert back_heading == pytest.approx(heading, abs=1e-7)


def test_straight_road_is_its_frame() -> None:
    straight = np.array([[0.0, 0.0, 0.0, 100.0, 0.0]])
    assert position(straight, 30.0, 1.75) == (30.0, 1.75, 0.0)
    assert local(straight, 30.0, 1.75) == (30.0, 1.75, 0.0, 0.0)
    assert position(straight, -5.0, 0.0) == (-5.0, 0.0, 0.0)
    assert position(straight, 130.0, 0.0) == (130.0, 0.0, 0.0)


def test_quarter_circle_to_the_left_ends_up_north() -> None:
    quarter = np.array([[0.0, 0.0, 0.0, 50.0 * math.pi, 0.01]])
    x, y, heading = position(quarter, 50.0 * math.pi, 10.0)
    assert (x, y) == pytest.approx((90.0, 100.0), abs=1e-9)
    assert heading == pytest.approx(math.pi / 2, rel=1e-14)


def test_left_is_positive_on_a_right_curve() -> None:
    curve = np.array([[0.0, 0.0, 0.0, 100.0, -0.01]])
    s, d, heading, curvature = local(curve, 0.0, 2.0)
    assert (s, d, heading, curvature) == pytest.approx((0.0, 2.0, 0.0, -0.01), abs=1e-12)


@pytest.mark.slow
def test_curvature_is_that_of_the_segment() -> None:
    segments = ROADS["s_curve"]
    curvatures = [local(segments, *position(segments, s, 2.0)[:2])[3] for s in (50, 150, 350, 650)]
    assert curvatures == [0.0, 0.004, -0.004, 0.0]


def test_way_along_the_road_is_continuous() -> None:
    segments = ROADS["s_curve"]
    ways = [local(segments, *position(segments, s, 6.0)[:2])[0] for s in np.linspace(-5, 805, 1621)]
    assert np.diff(ways) == pytest.approx(0.5, abs=1e-5)


def test_chords_of_the_line_are_as_long_as_the_way() -> None:
    segments = ROADS["s_curve"]
    points = np.array([position(segments, s, 0.0)[:2] for s in np.linspace(0.0, 800.0, 801)])
    assert np.hypot(*np.diff(points, axis=0).T) == pytest.approx(1.0, abs=1e-4)


def test_headings_stay_within_half_a_turn() -> None:
    winding = chain((700.0, 0.008))
    for s in np.linspace(0.0, 700.0, 71):
        assert -math.pi < position(winding, s, 0.0)[2] <= math.pi


def test_unknown_point_has_no_place() -> None:
    assert all(math.isnan(value) for value in local(ROADS["s_curve"], math.nan, 0.0))
    assert math.isnan(position(ROADS["s_curve"], math.nan, 0.0)[0])


def test_inner_lane_of_a_left_curve_is_tighter() -> None:
    assert offset_curvature(0.01, 20.0) == pytest.approx(1.0 / 80.0, rel=1e-15)
    assert offset_curvature(-0.01, 20.0) == pytest.approx(-1.0 / 120.0, rel=1e-15)
    assert offset_curvature(0.0, 20.0) == 0.0
    assert math.isnan(offset_curvature(0.01, 100.0))


def test_lanes_are_counted_from_the_right() -> None:
    assert [lane_of(d, 3.5, 3) for d in (0.0, 1.75, 3.5, 5.0, 10.49)] == [0, 0, 1, 1, 2]
    assert [lane_of(d, 3.5, 3) for d in (-0.01, 10.5, 99.0, math.nan)] == [-1, -1, -1, -1]


@pytest.mark.parametrize("width", [2.9, 3.1, 3.5, 3.7])
def test_centre_of_a_lane_is_in_it_up_to_its_edges(width: float) -> None:
    for lane in range(4):
        assert lane_of(lane_center(lane, width), width, 4) == lane
    assert lane_of(math.nextafter(4 * width, 0.0), width, 4) == 3


def way(segments: Floats, s: float, d: float, other_s: float) -> float:
    headings = [position(segments, place, 0.0)[2] for place in (s, other_s)]
    return lane_way(s, headings[0], d, other_s, headings[1])


@pytest.mark.parametrize("name", ROADS)
@pytest.mark.parametrize("d", [-3.0, 0.0, 8.75, 14.0])
def test_way_along_a_lane_is_the_length_of_its_line(name: str, d: float) -> None:
    segments = ROADS[name]
    for first, last in ((20.0, 390.0), (120.0, 380.0), (-30.0, 60.0), (390.0, 150.0)):
        points = np.array([position(segments, s, d)[:2] for s in np.linspace(first, last, 2001)])
        length = np.hypot(*np.diff(points, axis=0).T).sum()
        assert abs(way(segments, first, d, last)) == pytest.approx(length, abs=1e-4)
        assert way(segments, last, d, first) == pytest.approx(-way(segments, first, d, last))
        assert (way(segments, first, d, last) > 0.0) == (last > first)


def test_way_along_a_lane_of_a_mirrored_bend_mirrors() -> None:
    left, right = ROADS["left_curve"], ROADS["right_curve"]
    for d in (-3.0, 1.75, 8.75):
        assert way(left, 50.0, d, 380.0) == pytest.approx(way(right, 50.0, -d, 380.0), rel=1e-12)


def test_way_along_a_straight_is_that_along_the_road_to_the_bit() -> None:
    generator = np.random.Generator(np.random.Philox(5))
    for s, other, d in generator.uniform(0.0, 390.0, (200, 3)):
        for name in ("straight", "oblique"):
            assert way(ROADS[name], s, d, other) == other - s


def test_place_at_the_end_of_a_way_is_that_far_along_the_lane() -> None:
    for name in ("left_curve", "s_curve"):
        for length in (200.0, 13.7, -90.0):
            end = advance(ROADS[name], 150.0, 8.75, length)
            assert way(ROADS[name], 150.0, 8.75, end) == pytest.approx(length, abs=1e-6)


def test_at_the_centre_of_a_bend_no_way_is_left_and_beyond_an_unknown_place_none_is_known() -> None:
    assert lane_way(0.0, 0.0, 300.0, 50.0, 0.2) == 0.0
    for bad in range(5):
        numbers = [0.0, 0.0, 5.0, 50.0, 0.2]
        numbers[bad] = math.nan
        assert math.isnan(lane_way(*numbers))
