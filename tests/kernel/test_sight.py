"""Sight: hand-made scenes, and the same bits for one box or many."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from adeye.kernel import sight
from adeye.kernel.boxes import Box, box_of, boxes_overlap

Floats = NDArray[np.float64]


def test_ray_meets_a_box_where_it_first_touches_it_or_never() -> None:
    box = (20.0, 0.0, 0.0, 4.0, 2.0)
    beside = (0.0, 20.0, math.pi / 2, 4.0, 2.0)
    rays: dict[str, tuple[Any, Any]] = {
        "the near face": (((0.0, 0.0), (1.0, 0.0), box), 18.0),
        "of a turned box": (((0.0, 0.0), (0.0, 1.0), beside), pytest.approx(18.0, rel=1e-15)),
        "past it": (((0.0, 1.01), (1.0, 0.0), box), math.inf),
        "away from it": (((0.0, 0.0), (-1.0, 0.0), box), math.inf),
        "from inside": (((19.0, 0.5), (0.6, 0.8), box), 0.0),
        "along an edge": (((0.0, 1.0), (1.0, 0.0), box), 18.0),
    }
    for why, (ray, expected) in rays.items():
        assert sight.ray_box_distance(*ray) == expected, why
    assert math.isnan(sight.ray_box_distance((0.0, math.nan), (1.0, 0.0), box))


POINT = (0.0, 0.0, 0.0)
"""Heading and size of a box without any."""


def test_ray_hit_lies_on_the_outline() -> None:
    for turn in np.linspace(-0.15, 0.15, 31):
        c, s = math.cos(turn), math.sin(turn)
        way = sight.ray_box_distance((0.0, 0.0), (c, s), (15.0, 0.0, 0.7, 4.5, 1.8))
        if way < math.inf:
            box = (15.0, 0.0, 0.7, 4.5, 1.8)
            assert boxes_overlap(((way + 1e-9) * c, (way + 1e-9) * s, *POINT), box)
            assert not boxes_overlap(((way - 1e-9) * c, (way - 1e-9) * s, *POINT), box)


def test_ray_goes_as_far_in_a_world_that_is_turned_and_moved() -> None:
    draw, hits = np.random.default_rng(23), 0
    for _ in range(200):
        x, y, heading, aim, turn = draw.uniform(-3.0, 3.0, 5)
        box = (15.0 + x, y, heading, 4.5, 1.8)
        direct = 0.1 * aim
        way = sight.ray_box_distance((0.0, 0.0), (math.cos(direct), math.sin(direct)), box)
        c, s = math.cos(turn), math.sin(turn)
        moved = (7.0 + c * box[0] - s * box[1], -3.0 + s * box[0] + c * box[1], heading + turn)
        ray = (7.0, -3.0), (math.cos(direct + turn), math.sin(direct + turn))
        assert sight.ray_box_distance(*ray, (*moved, 4.5, 1.8)) == pytest.approx(way, abs=1e-9)
        hits += way < math.inf
    assert 20 < hits < 180


def nearest_and_bearings(
    sensor_x: float, sensor_y: float, boresight: float, box: tuple[float, ...], *size: float
) -> tuple[float, float, float]:
    look, extent = np.zeros(sight.OUTLINE_WIDTH), np.array(size)
    sight.outline(sensor_x, sensor_y, np.array(box), extent, look)
    return float(look[sight.NEAREST]), *sight.bearings(
        math.cos(boresight), math.sin(boresight), look
    )


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
        if boxes_overlap((0.0, 0.0, *POINT), box_of(box, size)):
            continue
        look = np.zeros(sight.OUTLINE_WIDTH)
        sight.outline(0.0, 0.0, box, size, look)
        c, s = 0.5 * math.cos(box[2]), 0.5 * math.sin(box[2])
        for u, v in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            x = box[0] + u * size[0] * c - v * size[1] * s
            y = box[1] + u * size[0] * s + v * size[1] * c
            assert look[sight.RIGHT_X] * y - look[sight.RIGHT_Y] * x >= -1e-9
            assert look[sight.LEFT_X] * y - look[sight.LEFT_Y] * x <= 1e-9


def test_many_boxes_look_as_each_of_them_does() -> None:
    boxes, sizes = drawn(503)
    boxes[11, 0], boxes[12, 2] = math.nan, math.inf
    extents, looks = np.zeros((3, 503)), np.zeros((sight.OUTLINE_WIDTH, 500))
    sight.fill_extents(sizes[np.newaxis], extents)
    looks[[sight.DX, sight.DY, sight.HEADING]] = boxes[3:].T
    sight.outlines(500, 3, extents, looks)
    for place in range(500):
        alone = np.zeros(sight.OUTLINE_WIDTH)
        sight.outline(0.0, 0.0, boxes[3 + place], sizes[3 + place], alone)
        assert np.array_equal(looks[:, place], alone, equal_nan=True)


# --- Occlusion: hand-made scenes, and the exact share against dense ray casting -------------------


def scene(*boxes: tuple[float, float, float, float, float]) -> tuple[Floats, Floats]:
    rows = np.array(boxes)
    return np.ascontiguousarray(rows[:, :3]), np.ascontiguousarray(rows[:, 3:])


def cast(sensor: tuple[float, float], target: int, objects: Floats, sizes: Floats) -> float:
    """Count rays: of those that meet the target, the share that meets it first."""
    met = first = 0
    for turn in np.linspace(-math.pi, math.pi, 8001):
        c, s = math.cos(turn), math.sin(turn)
        ways = [
            sight.ray_box_distance(sensor, (c, s), box_of(place, size))
            for place, size in zip(objects, sizes, strict=True)
        ]
        if ways[target] < math.inf:
            met += 1
            first += ways[target] <= min(ways)
    return first / met


def share(target: int, *boxes: tuple[float, float, float, float, float]) -> float:
    objects, sizes = scene(*boxes)
    return sight.visible_fraction(0.0, 0.0, target, objects, sizes)


def test_what_hides_a_box_and_what_does_not() -> None:
    box, nearer, behind = ((x, 0.0, 0.0, 4.0, 2.0) for x in (20.0, 10.0, -10.0))
    around = (0.0, 0.0, 0.3, 4.0, 2.0)
    # Its edge lies exactly on the line to the target's centre.
    thin, half, too = ((x, y, 0.0, 0.0001, w) for x, y, w in ((20, 0, 2), (10, 5, 10), (12, 5, 10)))
    # The barrier's centre is nearer to the sensor than the target, but it lies beyond it.
    beside, barrier = (30.0, 2.0, 0.0, 4.0, 2.0), (25.0, 5.0, 0.0, 80.0, 0.5)
    scenes: dict[str, tuple[float, float]] = {
        "alone": (share(0, box), 1.0),
        "behind a wider one": (share(0, box, nearer), 0.0),
        "which is seen": (share(1, box, nearer), 1.0),
        "one behind the sensor": (share(0, box, behind), 1.0),
        "a long one beside it": (share(0, beside, barrier), 1.0),
        "one around the sensor": (share(0, box, around), 0.0),
        "which is seen itself": (share(1, box, around), 1.0),
    }
    for why, (found, expected) in scenes.items():
        assert found == expected, why
    assert share(0, thin, half) == pytest.approx(0.5, abs=1e-9)
    # Two covers of the same part count once.
    assert share(0, thin, half, too) == pytest.approx(0.5, abs=1e-9)


def test_walls_on_both_sides_that_meet_ahead_by_a_few_degrees() -> None:
    # A wall on the left over 169 degrees; one from behind on the right ends just in front of it.
    start, end = np.array([-1.0, -5.0]), np.array([5.0, 0.9])
    x, y = 0.5 * (start + end)
    along = end - start
    wall = (x, y, math.atan2(along[1], along[0]), math.hypot(*along), 1e-6)
    objects, sizes = scene((0.0, 1.1, 0.0, 20.0, 0.2), wall)
    hidden = math.atan2(0.9, 5.0) - math.atan2(1.0, 10.0)
    extent = math.pi - 2.0 * math.atan2(1.0, 10.0)
    assert sight.visible_fraction(0.0, 0.0, 0, objects, sizes) == pytest.approx(
        1.0 - hidden / extent
    )
    assert sight.visible_fraction(0.0, 0.0, 1, objects, sizes) == 1.0


def test_unknown_place_has_no_visible_share() -> None:
    objects, sizes = scene((20.0, 0.0, 0.0, 4.0, 2.0), (10.0, math.nan, 0.0, 4.0, 2.0))
    assert math.isnan(sight.visible_fraction(0.0, 0.0, 0, objects, sizes))
    assert math.isnan(sight.visible_fraction(0.0, 0.0, 1, objects, sizes))


def random_scene(seed: int) -> tuple[Floats, Floats]:
    """Draw boxes all around the sensor that neither overlap nor hold it."""
    draw = np.random.default_rng(seed)
    boxes: list[Box] = []
    while len(boxes) < 6:
        x, y = draw.uniform(-18.0, 18.0, 2)
        box = (x, y, draw.uniform(-3.0, 3.0), draw.uniform(0.5, 12.0), draw.uniform(0.3, 2.5))
        sensor = (0.0, 0.0, 0.0, 0.0, 0.0)
        if not any(boxes_overlap(box, other) for other in (sensor, *boxes)):
            boxes.append(box)
    rows = np.array(boxes)
    return np.ascontiguousarray(rows[:, :3]), np.ascontiguousarray(rows[:, 3:])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_exact_share_equals_dense_ray_casting(seed: int) -> None:
    objects, sizes = random_scene(seed)
    exact = [sight.visible_fraction(0.0, 0.0, k, objects, sizes) for k in range(len(objects))]
    counted = [cast((0.0, 0.0), k, objects, sizes) for k in range(len(objects))]
    assert exact == pytest.approx(counted, abs=0.02)
    assert min(exact) < 0.9


@pytest.mark.parametrize("seed", range(4))
def test_share_is_that_of_any_place_and_no_object_uncovers(seed: int) -> None:
    objects, sizes = random_scene(seed)
    turn = 2.5
    moved = objects.copy()
    moved[:, 0] = 100.0 + objects[:, 0] * math.cos(turn) - objects[:, 1] * math.sin(turn)
    moved[:, 1] = -40.0 + objects[:, 0] * math.sin(turn) + objects[:, 1] * math.cos(turn)
    moved[:, 2] += turn
    for k in range(len(objects)):
        assert sight.visible_fraction(100.0, -40.0, k, moved, sizes) == pytest.approx(
            sight.visible_fraction(0.0, 0.0, k, objects, sizes), abs=1e-9
        )
    for k in range(4):
        few = sight.visible_fraction(0.0, 0.0, k, objects[:4].copy(), sizes[:4].copy())
        assert sight.visible_fraction(0.0, 0.0, k, objects, sizes) <= few + 1e-12
