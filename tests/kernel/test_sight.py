"""Sight: hand-made scenes, and the same bits for one box or many."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from adeye.kernel.boxes import contains_point
from adeye.kernel.sight import (
    DX,
    DY,
    HEADING,
    LEFT_X,
    LEFT_Y,
    NEAREST,
    OUTLINE_WIDTH,
    RIGHT_X,
    RIGHT_Y,
    bearings,
    fill_extents,
    outline,
    outlines,
    ray_box_distance,
)

Floats = NDArray[np.float64]


def test_ray_meets_the_near_face() -> None:
    assert ray_box_distance(0.0, 0.0, 1.0, 0.0, 20.0, 0.0, 0.0, 4.0, 2.0) == 18.0
    assert ray_box_distance(0.0, 0.0, 0.0, 1.0, 0.0, 20.0, math.pi / 2, 4.0, 2.0) == pytest.approx(
        18.0, rel=1e-15
    )


def test_ray_past_or_away_from_the_box_never_meets_it() -> None:
    assert ray_box_distance(0.0, 1.01, 1.0, 0.0, 20.0, 0.0, 0.0, 4.0, 2.0) == math.inf
    assert ray_box_distance(0.0, 0.0, -1.0, 0.0, 20.0, 0.0, 0.0, 4.0, 2.0) == math.inf


def test_ray_from_inside_meets_at_once() -> None:
    assert ray_box_distance(19.0, 0.5, 0.6, 0.8, 20.0, 0.0, 0.0, 4.0, 2.0) == 0.0


def test_ray_along_an_edge_meets_the_corner() -> None:
    assert ray_box_distance(0.0, 1.0, 1.0, 0.0, 20.0, 0.0, 0.0, 4.0, 2.0) == 18.0


def test_ray_with_nan_has_no_distance() -> None:
    assert math.isnan(ray_box_distance(0.0, math.nan, 1.0, 0.0, 20.0, 0.0, 0.0, 4.0, 2.0))


def test_ray_hit_lies_on_the_outline() -> None:
    for turn in np.linspace(-0.15, 0.15, 31):
        c, s = math.cos(turn), math.sin(turn)
        way = ray_box_distance(0.0, 0.0, c, s, 15.0, 0.0, 0.7, 4.5, 1.8)
        if way < math.inf:
            box = (15.0, 0.0, 0.7, 4.5, 1.8)
            assert contains_point((way + 1e-9) * c, (way + 1e-9) * s, *box)
            assert not contains_point((way - 1e-9) * c, (way - 1e-9) * s, *box)


def nearest_and_bearings(
    sensor_x: float, sensor_y: float, boresight: float, box: tuple[float, ...], *size: float
) -> tuple[float, float, float]:
    look, extent = np.zeros(OUTLINE_WIDTH), np.array(size)
    outline(sensor_x, sensor_y, np.array(box), extent, look)
    return float(look[NEAREST]), *bearings(math.cos(boresight), math.sin(boresight), look)


def test_bearings_of_a_box_ahead_are_symmetric() -> None:
    nearest, right, left = nearest_and_bearings(0.0, 0.0, 0.0, (20.0, 0.0, 0.0), 4.0, 2.0)
    assert nearest == 18.0
    assert left == -right == pytest.approx(math.atan(1.0 / 18.0), rel=1e-15)


def test_bearings_turn_with_the_boresight() -> None:
    _, right, left = nearest_and_bearings(3.0, 4.0, 0.5, (20.0, 8.0, 0.3), 4.0, 2.0)
    _, other_right, other_left = nearest_and_bearings(3.0, 4.0, 0.2, (20.0, 8.0, 0.3), 4.0, 2.0)
    assert other_right - right == pytest.approx(0.3)
    assert other_left - left == pytest.approx(0.3)


def test_box_behind_spans_the_seam() -> None:
    nearest, right, left = nearest_and_bearings(0.0, 0.0, 0.0, (-20.0, 0.0, 0.0), 4.0, 2.0)
    assert nearest == 18.0
    assert right == pytest.approx(math.pi - math.atan(1.0 / 18.0))
    assert left == pytest.approx(math.pi + math.atan(1.0 / 18.0))


def test_box_around_the_sensor_is_everywhere() -> None:
    assert nearest_and_bearings(0.0, 0.0, 0.3, (0.5, 0.0, 0.0), 4.0, 2.0) == (
        0.0,
        -math.pi,
        math.pi,
    )


def test_nearest_point_may_be_a_corner() -> None:
    nearest, _, _ = nearest_and_bearings(0.0, 0.0, 0.0, (5.0, 5.0, 0.0), 4.0, 2.0)
    assert nearest == 5.0


def drawn(count: int) -> tuple[Floats, Floats]:
    """Draw boxes all around the sensor, some of which hold it."""
    draw = np.random.default_rng(5)
    boxes = np.column_stack([draw.uniform(-9.0, 9.0, (count, 2)), draw.uniform(-9.0, 9.0, count)])
    boxes[:7, 2] = [0.0, -0.0, 0.5 * math.pi, math.pi, -0.5 * math.pi, 0.785, 1e5]
    return boxes, draw.uniform(0.2, 9.0, (count, 3))


def test_corners_are_those_that_no_other_lies_beyond() -> None:
    boxes, sizes = drawn(500)
    for box, size in zip(boxes, sizes, strict=True):
        if contains_point(0.0, 0.0, *box.tolist(), *size.tolist()[:2]):
            continue
        look = np.zeros(OUTLINE_WIDTH)
        outline(0.0, 0.0, box, size, look)
        c, s = 0.5 * math.cos(box[2]), 0.5 * math.sin(box[2])
        for u, v in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            x = box[0] + u * size[0] * c - v * size[1] * s
            y = box[1] + u * size[0] * s + v * size[1] * c
            assert look[RIGHT_X] * y - look[RIGHT_Y] * x >= -1e-9
            assert look[LEFT_X] * y - look[LEFT_Y] * x <= 1e-9


@pytest.mark.slow
def test_many_boxes_look_as_each_of_them_does() -> None:
    boxes, sizes = drawn(503)
    boxes[11, 0], boxes[12, 2] = math.nan, math.inf
    extents, looks = np.zeros((3, 503)), np.zeros((OUTLINE_WIDTH, 500))
    fill_extents(sizes[np.newaxis], extents)
    looks[[DX, DY, HEADING]] = boxes[3:].T
    outlines(500, 3, extents, looks)
    for place in range(500):
        alone = np.zeros(OUTLINE_WIDTH)
        outline(0.0, 0.0, boxes[3 + place], sizes[3 + place], alone)
        assert np.array_equal(looks[:, place], alone, equal_nan=True)
