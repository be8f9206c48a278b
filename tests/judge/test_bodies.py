"""Bodies on the road: extents, what is finite, and who is in the path."""

from __future__ import annotations

import math

import numpy as np
import pytest

from adeye.judge.conflict import (
    ACROSS,
    ALONG,
    HALF_LENGTH,
    HALF_WIDTH,
    Body,
    are_finite,
    is_in_path,
    on_road,
    reach_of,
    turn,
)

EGO: Body = (0.0, 0.0, 20.0, 0.0, 2.0, 1.0)


def turned(angle: float, speed: float = 10.0) -> Body:
    return on_road(0.0, 0.0, speed, 4.0, 2.0, math.sin(angle), math.cos(angle))


def test_straight_body_is_as_long_and_wide_as_it_is() -> None:
    body = turned(0.0)
    assert (body[ALONG], body[ACROSS]) == (10.0, 0.0)
    assert (body[HALF_LENGTH], body[HALF_WIDTH]) == (2.0, 1.0)


@pytest.mark.parametrize("angle", [0.1, 0.7, -0.7, 2.0, math.pi])
def test_turned_body_keeps_its_speed_and_its_corners_reach_its_extents(angle: float) -> None:
    body = turned(angle)
    assert math.hypot(body[ALONG], body[ACROSS]) == pytest.approx(10.0)
    corners = [
        (
            x * math.cos(angle) - y * math.sin(angle),
            x * math.sin(angle) + y * math.cos(angle),
        )
        for x in (-2.0, 2.0)
        for y in (-1.0, 1.0)
    ]
    assert body[HALF_LENGTH] == pytest.approx(max(along for along, _ in corners))
    assert body[HALF_WIDTH] == pytest.approx(max(across for _, across in corners))


@pytest.mark.parametrize("size", [(4.0, 2.0), (0.6, 0.6), (18.75, 2.55)])
def test_reach_is_a_little_more_than_half_of_the_diagonal(size: tuple[float, float]) -> None:
    half = 0.5 * math.hypot(*size)
    assert half < reach_of(*size) < half * 1.00001 + 2e-6


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("place", range(10))
def test_one_number_that_is_not_finite_spoils_all(place: int, bad: float) -> None:
    numbers = [1.0, -2.0, 0.0, 1e300, -1e-300, -0.0, 5.0, 6.0, 7.0, 8.0]
    assert are_finite(*numbers)
    numbers[place] = bad
    assert not are_finite(*numbers)


def test_angle_is_turned_anew_only_where_it_changes() -> None:
    turns = np.full((2, 3), np.nan)
    turn(turns, 1, 0.5)
    assert turns[1].tolist() == pytest.approx([0.5, math.sin(0.5), math.cos(0.5)])
    assert np.isnan(turns[0]).all()
    turns[1, 1] = 9.0
    turn(turns, 1, 0.5)
    assert turns[1, 1] == 9.0
    turn(turns, 1, 0.25)
    assert turns[1, 1] == pytest.approx(math.sin(0.25))


def walker(d: float, across: float) -> Body:
    return (40.0, d, 0.0, across, 0.3, 0.3)


@pytest.mark.parametrize(
    ("d", "across", "is_met"),
    [
        (0.0, 0.0, True),
        (1.29, 0.0, True),
        (1.3, 0.0, False),
        (-1.3, 0.0, False),
        (4.0, -1.5, True),
        (-4.0, 1.5, True),
        (4.0, 1.5, False),
        (9.0, -1.5, False),
        (2.0, -4.0, False),
    ],
)
def test_walker_is_in_the_path_if_in_the_corridor_as_the_ego_passes(
    d: float, across: float, *, is_met: bool
) -> None:
    # The ego is beside the walker from 1.885 s to 2.115 s on.
    assert is_in_path(EGO, 1.0, walker(d, across), 37.7) is is_met
    mirrored = walker(-d, -across)
    assert is_in_path(EGO, 1.0, mirrored, 37.7) is is_met


def test_walker_beside_the_corridor_is_met_by_no_ego_that_stands() -> None:
    standing: Body = (0.0, 0.0, 0.0, 0.0, 2.0, 1.0)
    assert not is_in_path(standing, 1.0, walker(4.0, -1.5), 37.7)
    assert not is_in_path(EGO, 1.0, walker(4.0, -1.5), 0.0)
