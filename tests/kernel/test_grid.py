"""Cells around the ego: what bodies occupy, when they come, and what the ground is."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from adeye.kernel.grid import count_cover, cover, cover_at, fill_ground, sweep
from adeye.kernel.road import Ground, local, position
from adeye.kernel.stops import DEFAULT_RULES, RULE_OFF_ROAD, RULE_REFUGE, rate_footprint

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

CELL = 0.5
XS = np.arange(-24.75, 50.0, CELL)
YS = np.arange(-17.25, 17.5, CELL)
STRAIGHT = np.array([[0.0, 0.0, 0.0, 2000.0, 0.0]])
ROAD = 3.5, 3, 2.5, 0.0, 36.0
"""Lane width, lanes, shoulder, verge, speed limit."""
BAYS = np.array([[1.0, 330.0, 60.0, 8.0, 20.0], [0.0, 110.0, 20.0, 4.0, 10.0]])
"""A rest area and a parking bay: kind, s, length, depth, taper."""


def layer(value: float = math.inf) -> Floats:
    return np.full((len(XS), len(YS)), value)


def covered(x: float, y: float, heading: float, length: float, width: float) -> Floats:
    made = layer()
    box = np.array([x, y, math.sin(heading), math.cos(heading), length, width])
    cover(box, 0.0, XS, YS, CELL, made)
    return made


def ground(segments: Floats, ego: tuple[float, float, float], refuges: Floats = BAYS) -> list[Any]:
    place, lane, refuge = (layer(0.0).astype(np.int64) for _ in range(3))
    number = layer(0.0)
    fill_ground(
        np.array(DEFAULT_RULES), Ground(segments, refuges, *ROAD), np.array(ego), XS, YS, CELL,
        place, lane, refuge, number,
    )  # fmt: skip
    return [place, lane, refuge, number]


def swept(
    body: tuple[float, ...],
    velocity: tuple[float, float],
    acceleration: float = 0.0,
    *,
    is_free: bool = False,
    ego: tuple[float, float, float] = (0.0, 5.25, 0.0),
    segments: Floats = STRAIGHT,
) -> Floats:
    times = layer()
    where = np.array(ego)
    cover_at(where, np.array(body), 0.0, XS, YS, CELL, times)
    sweep(
        Ground(segments, BAYS, *ROAD), where, np.array(body), np.array(velocity), acceleration,
        is_free, 0.2, 80, XS, YS, CELL, times,
    )  # fmt: skip
    return times


def test_body_on_the_edges_of_cells_occupies_these_cells_and_no_other() -> None:
    made = covered(14.0, 0.0, 0.0, 4.0, 2.0)
    inside = (abs(XS[:, None] - 14.0) < 2.0) & (abs(YS) < 1.0)
    assert inside.sum() == 32
    assert np.array_equal(made == 0.0, inside)


def test_body_that_reaches_a_little_into_a_cell_occupies_it() -> None:
    assert (covered(14.01, 0.0, 0.0, 4.0, 2.0) == 0.0).sum() == 36
    assert (covered(14.01, 0.01, math.pi, 4.0, 2.0) == 0.0).sum() == 45


@pytest.mark.parametrize("heading", [0.3, math.pi / 4, 2.0, -1.1])
def test_turned_body_occupies_every_cell_that_has_a_point_of_it(heading: float) -> None:
    made = covered(10.13, 3.21, heading, 4.6, 1.9)
    along, across = np.meshgrid(np.linspace(-2.3, 2.3, 400), np.linspace(-0.95, 0.95, 200))
    x = 10.13 + math.cos(heading) * along - math.sin(heading) * across
    y = 3.21 + math.sin(heading) * along + math.cos(heading) * across
    found = np.zeros(made.shape, dtype=np.bool_)
    found[np.floor((x + 25.0) / CELL).astype(int), np.floor((y + 17.5) / CELL).astype(int)] = True
    # A fine enough pattern of points misses slivers at most.
    assert np.all(made[found] == 0.0)
    assert (made == 0.0).sum() - found.sum() <= 2


def test_earliest_time_stays() -> None:
    made = covered(0.0, 0.0, 0.0, 4.0, 2.0)
    cover(np.array([1.0, 0.0, 0.0, 1.0, 4.0, 2.0]), 3.0, XS, YS, CELL, made)
    assert made[XS == 0.25, YS == 0.25] == 0.0
    assert made[XS == 2.75, YS == 0.25] == 3.0


@pytest.mark.slow
def test_what_is_outside_of_the_window_covers_nothing() -> None:
    for far in (500.0, -500.0, 1e300, -1e300, math.inf, math.nan):
        assert np.isinf(covered(far, 0.0, 0.0, 4.0, 2.0)).all()
        assert np.isinf(covered(0.0, far, 0.0, 4.0, 2.0)).all()
    assert np.isinf(covered(-25.0 - 2.0, 0.0, 0.0, 4.0, 2.0)).all()
    assert (covered(-25.0 - 1.9, 0.0, 0.0, 4.0, 2.0) == 0.0).sum() == 4


def test_oncoming_car_comes_into_a_cell_when_its_front_does() -> None:
    times = swept((44.0, 5.25, math.pi, 4.0, 2.0), (-20.0, 0.0))
    row = times[:, YS == 0.25][:, 0]
    ahead = XS < 41.5
    # Its front is at 42 m, and reaches the far edge of the cell first.
    assert row[ahead] == pytest.approx((42.0 - (XS[ahead] + 0.25)) / 20.0, abs=0.25 / 20.0 + 1e-9)
    assert np.isinf(times[:, abs(YS) > 1.0]).all()


def test_braking_car_is_not_predicted_beyond_where_it_stands() -> None:
    times = swept((0.0, 5.25, 0.0, 4.0, 2.0), (12.0, 0.0), -4.0)
    row = times[:, YS == 0.25][:, 0]
    way = XS - 0.25 - 2.0
    reached = (way > 0.0) & (way < 17.5)
    expected = (12.0 - np.sqrt(144.0 - 8.0 * way[reached])) / 4.0
    assert row[reached] == pytest.approx(expected, abs=0.2)
    assert np.isinf(row[XS > 20.5]).all()
    assert np.isinf(row[XS < -2.0]).all()


def test_pedestrian_goes_on_across_the_road() -> None:
    times = swept((20.0, -2.0, math.pi / 2, 0.5, 0.5), (0.0, 1.5), is_free=True)
    column = times[XS == 20.25, :][0]
    ahead = (YS > -6.0) & (YS < 15.0)
    expected = (YS[ahead] - 0.25 - (-7.25 + 0.25)) / 1.5
    assert column[ahead] == pytest.approx(expected, abs=0.25 / 1.5 + 1e-9)


def test_prediction_follows_the_curve() -> None:
    curve = np.array([[0.0, 0.0, 0.0, 800.0, 1.0 / 200.0]])
    x, y, heading = position(curve, 100.0, 5.25)
    x_1, y_1, heading_1 = position(curve, 70.0, 5.25)
    velocity = 20.0 * math.cos(heading_1), 20.0 * math.sin(heading_1)
    times = swept((x_1, y_1, heading_1, 4.0, 2.0), velocity, ego=(x, y, heading), segments=curve)
    ahead_x, ahead_y, _ = position(curve, 130.0, 5.25)
    dx, dy, sine, cosine = ahead_x - x, ahead_y - y, math.sin(heading), math.cos(heading)
    i = round((cosine * dx + sine * dy + 24.75) / CELL)
    j = round((cosine * dy - sine * dx + 17.25) / CELL)
    # The speed counts along the reference line.
    assert times[i, j] == pytest.approx((60.0 - 2.0) / 20.0, abs=0.1)


def test_unknown_place_or_speed_covers_nothing() -> None:
    assert np.isinf(swept((math.nan, 5.25, 0.0, 4.0, 2.0), (12.0, 0.0))).all()


def test_lanes_of_a_curve_are_rings() -> None:
    curve = np.array([[0.0, 0.0, 0.0, 1000.0, 1.0 / 150.0]])
    ego = position(curve, 200.0, 5.25)
    place, lane, _, _ = ground(curve, ego, np.zeros((0, 5)))
    x = ego[0] + math.cos(ego[2]) * XS[:, None] - math.sin(ego[2]) * YS
    y = ego[1] + math.sin(ego[2]) * XS[:, None] + math.cos(ego[2]) * YS
    # The centre of the circle is 150 m to the left of the start of the reference line.
    d = 150.0 - np.hypot(x, y - 150.0)
    expected = np.where((d >= 0.0) & (d < 10.5), np.floor(d / 3.5), -1)
    assert np.array_equal(lane, expected)
    assert np.array_equal(place == RULE_OFF_ROAD, (d < -2.5) | (d > 10.5))


@pytest.mark.parametrize("turned", [0.0, 0.4, 1.0, 2.5, -3.0])
def test_number_of_a_cell_is_that_of_a_body_of_its_size(turned: float) -> None:
    curve = np.array([[0.0, 0.0, 0.0, 300.0, 0.0], [300.0, 0.0, 0.0, 500.0, 1.0 / 400.0]])
    x, y, heading = position(curve, 290.0, 4.1)
    _, _, _, number = ground(curve, (x, y, heading + turned))
    for i, j in np.random.default_rng(3).integers((0, 0), number.shape, (300, 2)):
        sine, cosine = math.sin(heading + turned), math.cos(heading + turned)
        place = local(curve, x + cosine * XS[i] - sine * YS[j], y + sine * XS[i] + cosine * YS[j])
        # A square may be turned by any number of right angles.
        turn = heading + turned - place[2]
        turn -= math.pi / 2 * round(turn / (math.pi / 2))
        assert number[i, j] == rate_footprint(
            np.array(DEFAULT_RULES),
            Ground(curve, BAYS, *ROAD),
            place[0],
            place[1],
            math.tan(turn),
            CELL,
            CELL,
        )


def test_rotated_and_moved_world_looks_the_same_to_the_ego() -> None:
    shapes = [[0.0, 0.0, 0.0, 120.0, 0.0], [120.0, 0.0, 0.0, 900.0, -1.0 / 250.0]]
    turn, x_0, y_0 = 2.1, 830.7, -412.3
    sine, cosine = math.sin(turn), math.cos(turn)
    here = np.array(shapes)
    there = here.copy()
    there[:, 0] = x_0 + cosine * here[:, 0] - sine * here[:, 1]
    there[:, 1] = y_0 + sine * here[:, 0] + cosine * here[:, 1]
    there[:, 2] += turn

    def seen(segments: Floats) -> list[Any]:
        x, y, heading = position(segments, 131.3, 4.417)
        place = position(segments, 142.2, 5.03)
        body = (place[0], place[1], place[2] + 0.03, 4.43, 1.83)
        velocity = 14.0 * math.cos(place[2]), 14.0 * math.sin(place[2])
        ego = x, y, heading + 0.021
        return [*ground(segments, ego), swept(body, velocity, -2.0, ego=ego, segments=segments)]

    for one, other in zip(seen(here), seen(there), strict=True):
        # A cell whose edge meets another one may fall on either side of it.
        assert (~np.isclose(one, other, rtol=0.0, atol=1e-6)).sum() <= 2


def test_bay_is_where_the_map_says_and_rated_as_a_refuge() -> None:
    place, lane, refuge, number = ground(STRAIGHT, (100.0, 1.75, 0.0))
    s, d = XS[:, None] + 100.0, YS + 1.75
    taper = np.clip(1.0 - np.maximum(110.0 - s, s - 130.0) / 10.0, 0.0, 1.0)
    inside = (d < -2.5) & (d >= -2.5 - 4.0 * taper) & (taper > 0.0)
    assert np.array_equal(refuge, np.where(inside, 1, -1))
    assert np.array_equal(place == RULE_REFUGE, inside)
    assert not (lane[inside] >= 0).any()
    assert number[XS == 20.25, YS == -6.25] == 0.0
    # On the edge of the taper the worst corner is off the road.
    assert number[XS == 5.25, YS == -6.25] == 7.0


def test_sensor_of_90_degrees_covers_its_quarter() -> None:
    counts = layer(0.0).astype(np.int64)
    count_cover(2.0, 0.5, math.radians(30.0), math.pi / 2, 20.0, XS, YS, counts)
    dx, dy = XS[:, None] - 2.0, YS - 0.5
    bearing = np.degrees(np.arctan2(dy, dx))
    expected = (np.hypot(dx, dy) <= 20.0) & (bearing >= -15.0) & (bearing <= 75.0)
    assert np.array_equal(counts, expected)
    count_cover(0.0, 0.0, math.pi, 2.0 * math.pi, 20.0, XS, YS, counts)
    assert counts.max() == 2
    assert (counts > 0).sum() == ((np.hypot(XS[:, None], YS) <= 20.0) | expected).sum()
