"""The lateral shape of sine lanes and the points of polylines."""

import math

import numpy as np
import pytest

from adeye.kernel.traffic import lanes as k
from adeye.signals import Floats

CORNER = [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]
BEND = [[0.0, 0.0], [10.0, 0.0], [18.0, 6.0]]


def polyline(knots: list[list[float]]) -> tuple[Floats, Floats, float]:
    """Return the points, the knots and the length of a polyline."""
    given = np.array(knots)
    points = np.zeros((k.count_points(given), k.CURVE_WIDTH))
    table = np.zeros((len(given), k.CURVE_WIDTH))
    return points, table, k.write_polyline(given, points, table)


@pytest.mark.parametrize("s", [-3.0, 0.0, 12.5, 40.0])
def test_sine_heading_is_the_slope_of_the_offset(s: float) -> None:
    shape = (3.25, 0.04, 0.7)
    h = 1e-5
    slope = (k.sine_offset(s + h, *shape) - k.sine_offset(s - h, *shape)) / (2.0 * h)
    assert k.sine_heading(s, *shape) == pytest.approx(math.atan(slope), abs=1e-9)


def test_sine_offset_is_largest_a_quarter_turn_on() -> None:
    assert k.sine_offset(25.0, 2.0, 2.0 * math.pi / 100.0, 0.0) == pytest.approx(2.0)
    assert k.sine_heading(25.0, 2.0, 2.0 * math.pi / 100.0, 0.0) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(("length", "points"), [(9.5, 10), (10.0, 11), (10.999, 11)])
def test_points_are_a_metre_apart(length: float, points: int) -> None:
    assert k.count_points(np.array([[0.0, 0.0], [length, 0.0]])) == points


@pytest.mark.slow
def test_a_straight_polyline_is_a_straight_lane() -> None:
    points, knots, length = polyline([[1.0, 2.0], [1.0, 22.5]])
    assert length == 20.5
    np.testing.assert_allclose(points[:, k.KNOT_Y], 2.0 + np.arange(21))
    np.testing.assert_allclose(points[:, k.KNOT_HEADING], math.pi / 2.0)
    assert k.polyline_local(points, 0.0, 7.25) == (5.25, 1.0)
    assert k.polyline_point(points, knots, 5.25, 1.0) == pytest.approx((0.0, 7.25))


@pytest.mark.slow
def test_a_polyline_goes_on_beyond_both_ends() -> None:
    points, knots, _ = polyline(BEND)
    assert k.polyline_point(points, knots, -3.0, 0.0) == pytest.approx((-3.0, 0.0))
    assert k.polyline_point(points, knots, 24.0, 0.0) == pytest.approx((21.2, 8.4))
    assert k.polyline_local(points, -3.0, 1.5) == (-3.0, 1.5)
    assert k.polyline_local(points, 20.6, 9.2) == pytest.approx((24.0, 1.0))


def test_a_place_belongs_to_the_last_piece_that_it_is_not_behind() -> None:
    points, _, _ = polyline(CORNER)
    # Within the corner both legs claim it; the second one comes last.
    s, lateral = k.polyline_local(points, 7.0, 4.25)
    assert s == pytest.approx(14.25)
    assert lateral == pytest.approx(3.0)


def test_heading_before_and_past_a_polyline_is_that_of_its_end_pieces() -> None:
    points, _, _ = polyline(CORNER)
    assert k.polyline_heading(points, -5.0) == 0.0
    assert k.polyline_heading(points, 9.99) == 0.0
    assert k.polyline_heading(points, 10.0) == pytest.approx(math.pi / 2.0)
    assert k.polyline_heading(points, 1e6) == pytest.approx(math.pi / 2.0)


def test_directions_are_unit_vectors_that_agree_with_the_headings() -> None:
    points, _, _ = polyline([[0.0, 0.0], [7.3, -2.0], [12.0, 9.0], [11.0, 30.0]])
    np.testing.assert_allclose(np.hypot(points[:, k.ALONG_X], points[:, k.ALONG_Y]), 1.0)
    np.testing.assert_allclose(np.cos(points[:, k.KNOT_HEADING]), points[:, k.ALONG_X], atol=1e-12)
    np.testing.assert_allclose(np.sin(points[:, k.KNOT_HEADING]), points[:, k.ALONG_Y], atol=1e-12)


@pytest.mark.parametrize("s", [0.5, 8.25, 13.0, 19.5])
@pytest.mark.parametrize("lateral", [0.0, -1.5])
def test_local_place_of_a_point_beside_a_leg_leads_back(s: float, lateral: float) -> None:
    points, knots, _ = polyline(BEND)
    x, y = k.polyline_point(points, knots, s, lateral)
    assert k.polyline_local(points, x, y) == pytest.approx((s, lateral))
