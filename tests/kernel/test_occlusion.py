"""Occlusion: hand-made scenes, and the exact share against dense ray casting."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from adeye.kernel.boxes import boxes_overlap, contains_point
from adeye.kernel.sight import ray_box_distance, visible_fraction

Floats = NDArray[np.float64]


def scene(*boxes: tuple[float, float, float, float, float]) -> tuple[Floats, Floats]:
    rows = np.array(boxes)
    return np.ascontiguousarray(rows[:, :3]), np.ascontiguousarray(rows[:, 3:])


def cast(sensor: tuple[float, float], target: int, objects: Floats, sizes: Floats) -> float:
    """Count rays: of those that meet the target, the share that meets it first."""
    met = first = 0
    for turn in np.linspace(-math.pi, math.pi, 8001):
        c, s = math.cos(turn), math.sin(turn)
        ways = [
            ray_box_distance(*sensor, c, s, *place, *size)
            for place, size in zip(objects, sizes, strict=True)
        ]
        if ways[target] < math.inf:
            met += 1
            first += ways[target] <= min(ways)
    return first / met


def test_lone_box_is_fully_visible() -> None:
    objects, sizes = scene((20.0, 0.0, 0.0, 4.0, 2.0))
    assert visible_fraction(0.0, 0.0, 0, objects, sizes) == 1.0


def test_box_behind_a_wider_one_is_invisible() -> None:
    objects, sizes = scene((20.0, 0.0, 0.0, 4.0, 2.0), (10.0, 0.0, 0.0, 4.0, 2.0))
    assert visible_fraction(0.0, 0.0, 0, objects, sizes) == 0.0
    assert visible_fraction(0.0, 0.0, 1, objects, sizes) == 1.0


def test_box_behind_the_sensor_covers_nothing() -> None:
    objects, sizes = scene((20.0, 0.0, 0.0, 4.0, 2.0), (-10.0, 0.0, 0.0, 4.0, 2.0))
    assert visible_fraction(0.0, 0.0, 0, objects, sizes) == 1.0


def test_half_covered_box_is_half_visible() -> None:
    # The occluder's edge lies exactly on the line to the target's centre.
    objects, sizes = scene((20.0, 0.0, 0.0, 0.0001, 2.0), (10.0, 5.0, 0.0, 0.0001, 10.0))
    assert visible_fraction(0.0, 0.0, 0, objects, sizes) == pytest.approx(0.5, abs=1e-9)


def test_two_covers_of_the_same_part_count_once() -> None:
    half = (10.0, 5.0, 0.0, 0.0001, 10.0)
    objects, sizes = scene((20.0, 0.0, 0.0, 0.0001, 2.0), half, (12.0, 5.0, 0.0, 0.0001, 10.0))
    assert visible_fraction(0.0, 0.0, 0, objects, sizes) == pytest.approx(0.5, abs=1e-9)


def test_long_barrier_beside_the_target_is_not_in_front() -> None:
    # The barrier's centre is nearer to the sensor than the target, but it lies beyond it.
    objects, sizes = scene((30.0, 2.0, 0.0, 4.0, 2.0), (25.0, 5.0, 0.0, 80.0, 0.5))
    assert visible_fraction(0.0, 0.0, 0, objects, sizes) == 1.0


def test_walls_on_both_sides_that_meet_ahead_by_a_few_degrees() -> None:
    # A wall on the left over 169 degrees; one from behind on the right ends just in front of it.
    start, end = np.array([-1.0, -5.0]), np.array([5.0, 0.9])
    x, y = 0.5 * (start + end)
    along = end - start
    wall = (x, y, math.atan2(along[1], along[0]), math.hypot(*along), 1e-6)
    objects, sizes = scene((0.0, 1.1, 0.0, 20.0, 0.2), wall)
    hidden = math.atan2(0.9, 5.0) - math.atan2(1.0, 10.0)
    extent = math.pi - 2.0 * math.atan2(1.0, 10.0)
    assert visible_fraction(0.0, 0.0, 0, objects, sizes) == pytest.approx(1.0 - hidden / extent)
    assert visible_fraction(0.0, 0.0, 1, objects, sizes) == 1.0


def test_sensor_inside_a_box() -> None:
    objects, sizes = scene((20.0, 0.0, 0.0, 4.0, 2.0), (0.0, 0.0, 0.3, 4.0, 2.0))
    assert visible_fraction(0.0, 0.0, 1, objects, sizes) == 1.0
    assert visible_fraction(0.0, 0.0, 0, objects, sizes) == 0.0


@pytest.mark.slow
def test_unknown_place_has_no_visible_share() -> None:
    objects, sizes = scene((20.0, 0.0, 0.0, 4.0, 2.0), (10.0, math.nan, 0.0, 4.0, 2.0))
    assert math.isnan(visible_fraction(0.0, 0.0, 0, objects, sizes))
    assert math.isnan(visible_fraction(0.0, 0.0, 1, objects, sizes))


def random_scene(seed: int) -> tuple[Floats, Floats]:
    """Draw boxes all around the sensor that neither overlap nor hold it."""
    draw = np.random.default_rng(seed)
    boxes: list[tuple[float, ...]] = []
    while len(boxes) < 6:
        x, y = draw.uniform(-18.0, 18.0, 2)
        box = (x, y, draw.uniform(-3.0, 3.0), draw.uniform(0.5, 12.0), draw.uniform(0.3, 2.5))
        if not contains_point(0.0, 0.0, *box) and not any(
            boxes_overlap(*box, *other) for other in boxes
        ):
            boxes.append(box)
    rows = np.array(boxes)
    return np.ascontiguousarray(rows[:, :3]), np.ascontiguousarray(rows[:, 3:])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_exact_share_equals_dense_ray_casting(seed: int) -> None:
    objects, sizes = random_scene(seed)
    exact = [visible_fraction(0.0, 0.0, k, objects, sizes) for k in range(len(objects))]
    counted = [cast((0.0, 0.0), k, objects, sizes) for k in range(len(objects))]
    assert exact == pytest.approx(counted, abs=0.02)
    assert min(exact) < 0.9


@pytest.mark.parametrize("seed", range(4))
def test_share_does_not_depend_on_place_or_orientation(seed: int) -> None:
    objects, sizes = random_scene(seed)
    turn = 2.5
    moved = objects.copy()
    moved[:, 0] = 100.0 + objects[:, 0] * math.cos(turn) - objects[:, 1] * math.sin(turn)
    moved[:, 1] = -40.0 + objects[:, 0] * math.sin(turn) + objects[:, 1] * math.cos(turn)
    moved[:, 2] += turn
    for k in range(len(objects)):
        assert visible_fraction(100.0, -40.0, k, moved, sizes) == pytest.approx(
            visible_fraction(0.0, 0.0, k, objects, sizes), abs=1e-9
        )


@pytest.mark.parametrize("seed", range(4))
def test_another_object_never_uncovers(seed: int) -> None:
    objects, sizes = random_scene(seed)
    for k in range(4):
        few = visible_fraction(0.0, 0.0, k, objects[:4].copy(), sizes[:4].copy())
        assert visible_fraction(0.0, 0.0, k, objects, sizes) <= few + 1e-12
