"""Boxes of hand-made clusters: the nearest face, and the depth where a side shows it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from adeye.signals import (
    DETECTION_CLASS,
    DETECTION_HAS_RANGE_RATE,
    DETECTION_LENGTH,
    DETECTION_WIDTH,
    DETECTION_X,
    DETECTION_Y,
)
from adeye.simulate.channels.perception.clustering import SLOTS, fit_box, insert_box

SPACING = math.radians(0.4)
Points = list[tuple[float, float]]


def fit(
    points: Points, mount: tuple[float, float] = (0.0, 0.0), cut: float = 0.0
) -> tuple[float, ...]:
    xs, ys = np.array(points).T
    following = np.arange(1, len(points) + 1)
    following[-1] = -1
    return fit_box(*mount, SPACING, 0, following, np.array(xs), np.array(ys), cut)


def face(x: float, low: float, high: float, count: int = 10) -> Points:
    return [(x, float(y)) for y in np.linspace(low, high, count)]


def flank(y: float, low: float, high: float, count: int = 10) -> Points:
    return [(float(x), y) for x in np.linspace(low, high, count)]


def test_rear_of_a_lead_is_a_face_of_unknown_depth() -> None:
    x, y, length, width = fit(face(30.0, -0.9, 0.9))
    assert [x, y, length] == pytest.approx([30.0, 0.0, 0.0])
    # On average a beam's spacing wider than from the first return to the last.
    assert width == pytest.approx(1.8 + 30.0 * SPACING)


@pytest.mark.slow
def test_front_of_a_follower_is_its_nearest_face_too() -> None:
    assert fit(face(-12.0, -0.9, 0.9))[:3] == pytest.approx((-12.0, 0.0, 0.0))


def test_noise_does_not_draw_the_face_towards_the_sensor() -> None:
    noise = [0.5, -0.5, 0.3, -0.3, 0.4, -0.4]
    points = [(30.0 + n, -0.9 + 0.36 * k) for k, n in enumerate(noise)]
    assert fit(points)[0] == pytest.approx(30.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_two_faces_of_a_near_neighbour_show_its_box(side: float) -> None:
    rear = [(x, side * y) for x, y in face(6.0, 2.6, 4.4)]
    along = [(x, side * y) for x, y in flank(2.6, 6.0, 10.5, 20)]
    x, y, length, width = fit(rear + along)
    assert [x, y] == pytest.approx([8.25, side * 3.5])
    assert length == pytest.approx(4.5)
    assert width == pytest.approx(1.8, abs=0.1)


def test_two_faces_of_a_neighbour_behind_show_its_box() -> None:
    x, _, length, _ = fit(face(-5.0, 2.6, 4.4) + flank(2.6, -9.5, -5.0, 20))
    assert [x, length] == pytest.approx([-7.25, 4.5])


def test_side_far_away_whose_end_no_beam_shows_leaves_the_depth_unknown() -> None:
    # At 45 m a beam meets a side that is 2.6 m off every 5 m.
    x, y, length, _ = fit([*face(40.0, 2.6, 4.4), (42.0, 2.6), (44.4, 2.6)])
    assert [x, y, length] == pytest.approx([40.0, 3.5, 0.0])


def test_shallow_side_leaves_the_depth_unknown() -> None:
    # A rear that stands aslant.
    assert fit(face(6.0, 2.6, 4.4) + flank(2.6, 6.0, 6.8, 4))[2] == 0.0


@pytest.mark.slow
def test_side_alone_is_a_box_of_unknown_width_whose_side_stays() -> None:
    x, y, length, width = fit(flank(2.6, 8.0, 12.0, 20))
    assert [x, length, width] == pytest.approx([10.0, 4.0, 0.0])
    # Half an assumed width beyond the side.
    assert y == pytest.approx(2.6 + 0.9)


def test_vehicle_alongside_is_a_box_as_long_as_it_is_seen() -> None:
    x, y, length, width = fit(flank(-2.6, -2.0, 2.5, 30))
    assert [x, y] == pytest.approx([0.25, -3.5])
    assert [length, width] == pytest.approx([4.5, 0.0])


def test_side_is_seen_from_the_mount_not_from_the_centre() -> None:
    # Ahead of the centre of the body, behind a lidar in its grille.
    points = face(1.5, 2.6, 4.4)
    assert fit(points)[2] == 0.0
    assert fit(points, mount=(2.3, 0.0))[0] == pytest.approx(1.5)
    beside = flank(2.6, 2.0, 5.0, 20)
    assert fit(beside, mount=(2.3, 0.0))[2] == pytest.approx(3.0)


def listed(rows: list[tuple[float, float]]) -> tuple[int, np.ndarray, np.ndarray]:
    detections, source = np.zeros((SLOTS, 7)), np.full(SLOTS, -1)
    count = 0
    for thing, (x, y) in enumerate(rows):
        count = insert_box(count, (x, y, 0.0, 1.5), thing, detections, source)
    return count, detections, source


@pytest.mark.slow
def test_boxes_stand_in_order_of_distance_with_what_is_behind_them() -> None:
    count, detections, source = listed([(30.0, 0.0), (-10.0, 2.0), (0.0, 20.0)])
    assert count == 3
    assert source[:4].tolist() == [1, 2, 0, -1]
    assert detections[:3, DETECTION_X].tolist() == [-10.0, 0.0, 30.0]
    assert detections[:3, DETECTION_Y].tolist() == [2.0, 20.0, 0.0]
    assert (detections[:3, DETECTION_CLASS] == -1.0).all()
    assert (detections[:3, DETECTION_WIDTH] == 1.5).all()
    assert not detections[:3, [DETECTION_LENGTH, DETECTION_HAS_RANGE_RATE]].any()


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, -1])
def test_full_list_keeps_the_nearest(order: int) -> None:
    ways = [float(way) for way in range(1, SLOTS + 6)][::order]
    count, detections, _ = listed([(way, 0.0) for way in ways])
    assert count == SLOTS
    assert detections[:, DETECTION_X].tolist() == [float(way) for way in range(1, SLOTS + 1)]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_part_of_a_car_in_view_is_placed_from_the_edge_that_is_seen(side: float) -> None:
    # A car from -2.5 to -0.7 m, of which a sensor that looks aside sees the outer 0.2 m.
    points = [(7.0, side * y) for y in (-2.5, -2.4, -2.3)]
    x, y, length, width = fit(points, (1.4, side * -0.9), cut=side)
    assert (x, y) == pytest.approx((7.0, side * -1.6))
    assert (length, width) == (0.0, 0.0)


def test_part_that_is_as_wide_as_a_car_is_placed_as_it_is_seen() -> None:
    assert fit(face(7.0, -1.2, 1.2), cut=1.0) == fit(face(7.0, -1.2, 1.2))
