"""Ratings of places to stop at: lanes, shoulders, curves, refuges and verges."""

import math

import numpy as np
import pytest

from adeye.kernel.stops import (
    CONTACT,
    DEFAULT_RULES,
    RULE_CURVE,
    RULE_FAST_LANE,
    RULE_NAMES,
    RULE_OFF_ROAD,
    RULE_REFUGE,
    RULE_SHOULDER,
    RULE_SLOW_LANE,
    RULE_SLOW_LANE_IN_SIGHT,
    RULE_VERGE,
    RULES,
    SCALE,
    Ground,
    curvature_at,
    place_kind,
    rate_footprint,
    sight_distance,
)
from adeye.spec.channels import StopRatings

LIMIT = 130.0 / 3.6
ROAD = np.array([[0.0, 0.0, 0.0, 500.0, 0.0], [500.0, 0.0, 0.0, 500.0, 1.0 / 250.0]])
NONE = np.zeros((0, 5))
VALUES = np.array(DEFAULT_RULES)
PLAIN = 3.5, 3, 2.5, 0.0, LIMIT
"""Lane width, lanes, shoulder, verge, speed limit."""


def kind(d: float, curvature: float = 0.0, limit: float = LIMIT) -> int:
    return place_kind(Ground(ROAD, NONE, 3.5, 3, 2.5, 0.0, limit), curvature, d, 0.0)


def rate(s: float, d: float, slope: float = 0.0) -> float:
    return rate_footprint(VALUES, Ground(ROAD, NONE, *PLAIN), s, d, slope, 4.5, 1.8)


def test_table_is_the_one_that_users_write() -> None:
    assert dict(zip(RULE_NAMES, DEFAULT_RULES, strict=True)) == dict(StopRatings())
    assert len(DEFAULT_RULES) == len(RULE_NAMES) == RULES
    assert len(SCALE) == int(CONTACT) + 1


def test_places_across_a_straight_road() -> None:
    places = [-2.6, -2.4, -0.1, 0.1, 3.4, 3.6, 10.4, 10.6]
    assert [kind(d) for d in places] == [
        RULE_OFF_ROAD,
        RULE_SHOULDER,
        RULE_SHOULDER,
        RULE_SLOW_LANE_IN_SIGHT,
        RULE_SLOW_LANE_IN_SIGHT,
        RULE_FAST_LANE,
        RULE_FAST_LANE,
        RULE_OFF_ROAD,
    ]
    assert kind(math.nan) == RULE_OFF_ROAD


def test_sight_in_a_curve_is_that_of_the_circle() -> None:
    radius, inside = 400.0, 3.0
    # Half the chord that touches the inner edge; the formula is for small angles.
    exact = 2.0 * radius * math.acos(1.0 - inside / radius)
    assert sight_distance(1.0 / radius, inside) == pytest.approx(exact, rel=2e-3)
    assert sight_distance(0.0, inside) == math.inf


def test_tighter_curves_are_rated_worse() -> None:
    kinds = [kind(1.75, -1.0 / radius) for radius in (5000.0, 900.0, 300.0)]
    assert kinds == [RULE_SLOW_LANE_IN_SIGHT, RULE_SLOW_LANE, RULE_CURVE]
    assert kind(1.75, -1.0 / 300.0, 15.0) == RULE_SLOW_LANE_IN_SIGHT
    assert kind(-1.0, -1.0 / 300.0) == RULE_SHOULDER


def test_worst_cell_under_the_body_counts() -> None:
    assert [rate(100.0, d) for d in (-1.25, -0.8, 1.75, 3.5, 5.25)] == [1.0, 3.0, 3.0, 5.0, 5.0]
    assert rate(100.0, -1.25, 0.1) == 1.0
    assert rate(100.0, -1.25, 0.6) == 7.0


def test_body_that_reaches_into_a_curve_is_in_it() -> None:
    assert curvature_at(ROAD, 499.0) == 0.0
    assert curvature_at(ROAD, 501.0) == 1.0 / 250.0
    assert (rate(497.0, 1.75), rate(499.0, 8.75)) == (3.0, 6.0)


def test_beside_the_shoulder_a_refuge_is_best_then_a_verge() -> None:
    def beside(d: float) -> int:
        return place_kind(Ground(ROAD, NONE, 3.5, 3, 2.5, 3.0, LIMIT), 0.0, d, 2.0)

    kinds = [beside(d) for d in (-2.4, -2.6, -4.5, -4.6, -5.5, -5.6)]
    assert kinds == [
        *(RULE_SHOULDER, RULE_REFUGE, RULE_REFUGE),
        *(RULE_VERGE, RULE_VERGE, RULE_OFF_ROAD),
    ]
    assert place_kind(Ground(ROAD, NONE, 3.5, 3, 2.5, 3.0, LIMIT), 0.0, -2.6, 0.0) == RULE_VERGE
    assert [VALUES[kind] for kind in kinds] == [1.0, 0.0, 0.0, 2.0, 2.0, 7.0]


def test_a_footprint_across_the_line_of_a_bay_is_rated_by_the_shoulder() -> None:
    bay = np.array([[0.0, 80.0, 60.0, 4.0, 20.0]])

    def rated(s: float, d: float) -> float:
        return rate_footprint(VALUES, Ground(ROAD, bay, *PLAIN), s, d, 0.0, 4.5, 1.8)

    assert [rated(100.0, d) for d in (-4.5, -3.0, -1.25)] == [0.0, 1.0, 1.0]
    # In the taper the outer corner is off the road.
    assert rated(70.0, -4.5) == 7.0
