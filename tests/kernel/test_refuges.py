"""Bays beside the road: linear tapers, edges, and whether a body is on the road or inside."""

import math

import numpy as np
import pytest

from adeye.kernel.road import (
    PARKING_BAY,
    REST_AREA,
    body_edge,
    depth_at,
    is_in_refuge,
    mark_in_refuge,
    mark_on_road,
    position,
    refuge_depth,
    right_edge,
)
from adeye.signals import REFUGE_KINDS

BAY = np.array([0.0, 400.0, 60.0, 4.0, 20.0])
TWO = np.array([BAY, [1.0, 600.0, 100.0, 8.0, 0.0]])
NONE = np.zeros((0, 5))


def test_kinds_are_numbered_as_they_are_named() -> None:
    assert (REFUGE_KINDS[PARKING_BAY], REFUGE_KINDS[REST_AREA]) == ("parking_bay", "rest_area")


@pytest.mark.parametrize(
    ("s", "depth"),
    [
        *((379.9, 0.0), (380.0, 0.0), (385.0, 1.0), (390.0, 2.0), (400.0, 4.0), (460.0, 4.0)),
        *((465.0, 3.0), (480.0, 0.0), (1000.0, 0.0)),
    ],
)
def test_depth_is_linear_over_the_tapers(s: float, depth: float) -> None:
    assert depth_at(BAY, s) == pytest.approx(depth)


@pytest.mark.parametrize("away", np.linspace(0.0, 60.0, 13))
def test_a_bay_is_the_same_from_both_ends(away: float) -> None:
    assert depth_at(BAY, 430.0 - away) == pytest.approx(depth_at(BAY, 430.0 + away))


def test_a_taper_without_length_is_a_step() -> None:
    assert [refuge_depth(TWO, s) for s in (599.9, 600.0, 700.0, 700.1)] == [0.0, 8.0, 8.0, 0.0]


def test_the_edge_is_that_of_shoulder_bay_or_verge() -> None:
    assert right_edge(NONE, 0.0, 2.5, 0.0) == -2.5
    assert right_edge(NONE, 0.0, 2.5, 1.0) == -3.5
    assert right_edge(TWO, 430.0, 2.5, 1.0) == -6.5
    # The bay lies in the verge.
    assert right_edge(TWO, 382.5, 2.5, 1.0) == -3.5


def test_a_body_keeps_its_corners_on_the_road() -> None:
    straight = body_edge(NONE, 0.0, 0.0, 4.5, 1.8, 2.5, 0.0)
    assert straight == pytest.approx(0.9 - 2.5)
    for slope in (-0.2, 0.2):
        turned = body_edge(NONE, 0.0, slope, 4.5, 1.8, 2.5, 0.0)
        assert turned == pytest.approx(straight + 0.45)
    # Of the corners in the taper the rear one has less room, unless the body is turned into it.
    assert body_edge(TWO, 390.0, 0.0, 4.5, 1.8, 2.5, 0.0) == pytest.approx(0.9 - 2.5 - 1.55)
    assert body_edge(TWO, 390.0, -0.2, 4.5, 1.8, 2.5, 0.0) == pytest.approx(0.9 - 2.5 - 2.0)


@pytest.mark.parametrize(
    ("s", "d", "slope", "inside"),
    [
        (430.0, -4.5, 0.0, True),
        (430.0, -3.4, 0.0, True),
        (430.0, -3.3, 0.0, False),
        (430.0, -5.7, 0.0, False),
        (430.0, -3.4, 0.1, False),
        (392.0, -3.4, 0.0, True),
        (386.0, -3.4, 0.0, False),
        (300.0, -3.4, 0.0, False),
    ],
)
def test_a_body_is_in_a_bay_with_all_of_its_corners(
    s: float,
    d: float,
    slope: float,
    inside: bool,  # noqa: FBT001 - of a table
) -> None:
    assert is_in_refuge(BAY, s, d, slope, 4.5, 1.8, 2.5) == inside


def test_places_on_the_road_are_marked_run_by_run() -> None:
    refuges = np.stack([TWO, TWO])
    s = np.array([[430.0, 430.0, 430.0, 300.0, 300.0, math.nan]] * 2)
    d = np.array([[10.5, 10.6, -6.0, -6.0, -3.0, math.nan]] * 2)
    shoulder, verge, left = np.array([2.5, 0.0]), np.array([0.0, 3.0]), np.array([10.5, 10.5])
    marks = mark_on_road(refuges, shoulder, verge, left, s, d)
    assert marks.tolist() == [
        [True, False, True, False, False, False],
        [True, False, False, False, True, False],
    ]


@pytest.mark.slow
def test_bodies_in_refuges_are_marked_run_by_run() -> None:
    s, d = np.array([[430.0, 650.0, 500.0]]), np.array([[-4.5, -4.5, -4.5]])
    size = np.array([[4.5, 1.8, 1.5]])
    marks = mark_in_refuge(TWO[np.newaxis], np.array([2.5]), size, s, d, np.zeros((1, 3)))
    assert marks.tolist() == [[True, True, False]]
    across = mark_in_refuge(
        TWO[np.newaxis], np.array([2.5]), size, s, d, np.full((1, 3), 0.5 * math.pi)
    )
    assert not across.any()


def test_the_width_of_a_bay_in_a_curve_is_across_the_road() -> None:
    """Road coordinates bend with the road: the edge of a bay is a line of equal distance."""
    segments = np.array([[0.0, 0.0, 0.0, 900.0, 1.0 / 600.0]])
    for s in (400.0, 430.0, 460.0):
        inner = position(segments, s, right_edge(NONE, s, 2.5, 0.0))
        outer = position(segments, s, right_edge(TWO, s, 2.5, 0.0))
        assert math.dist(inner[:2], outer[:2]) == pytest.approx(4.0)
