"""Boxes: hand-made contacts, symmetry, and a sweep that lets nothing through."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from adeye.kernel import boxes

CAR = (4.5, 1.8)
UNIT = (0.0, 0.0, 0.0, 4.0, 2.0)
Pose = tuple[float, float, float]


def sweep(
    start_1: Pose, end_1: Pose, start_2: Pose, end_2: Pose, size: tuple[float, float] = CAR
) -> tuple[bool, float]:
    return boxes.swept_contact(start_1, end_1, size, start_2, end_2, size)


def random_pairs(count: int) -> NDArray[np.float64]:
    low, high = [-6.0, -6.0, -3.2, 0.5, 0.5] * 2, [6.0, 6.0, 3.2, 6.0, 3.0] * 2
    return np.random.default_rng(5).uniform(low, high, (count, 10))


def test_wrapping_keeps_the_direction() -> None:
    for angle in (*np.linspace(-50.0, 50.0, 401).tolist(), math.pi, -math.pi, 3.0 * math.pi):
        wrapped = boxes.wrap_to_pi(angle)
        assert -math.pi < wrapped <= math.pi
        assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-13)
        assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-13)
    assert math.isnan(boxes.wrap_to_pi(math.inf))
    assert math.isnan(boxes.wrap_to_pi(math.nan))


def test_distance_is_that_of_sides_or_corners_and_negative_in_overlap() -> None:
    for other, distance in (
        ((10.0, 0.0, 0.0, 4.0, 2.0), 6.0),
        ((7.0, 6.0, 0.0, 4.0, 2.0), 5.0),
        ((4.0, 0.0, math.pi / 4, 2.0, 2.0), 2.0 - math.sqrt(2.0)),
        ((4.0, 0.0, 0.0, 4.0, 2.0), 0.0),
        ((0.5, 1.5, 0.0, 4.0, 2.0), -0.5),
    ):
        assert boxes.signed_box_distance(UNIT, other) == pytest.approx(distance, rel=1e-14)
        assert boxes.box_distance(UNIT, other) == pytest.approx(max(distance, 0.0), rel=1e-14)


def test_touching_and_crossed_boxes_are_in_contact() -> None:
    assert boxes.boxes_overlap(UNIT, (4.0, 0.0, 0.0, 4.0, 2.0))
    assert not boxes.boxes_overlap(UNIT, (math.nextafter(4.0, 5.0), 0.0, 0.0, 4.0, 2.0))
    # Without a corner of one inside the other.
    assert boxes.boxes_overlap((0.0, 0.0, 0.0, 10.0, 1.0), (0.0, 0.0, math.pi / 2, 10.0, 1.0))


def test_unknown_box_is_never_apart() -> None:
    assert boxes.boxes_overlap(UNIT, (math.nan, 0.0, 0.0, 4.0, 2.0))
    assert math.isnan(boxes.box_distance(UNIT, (10.0, 0.0, math.nan, 4.0, 2.0)))
    assert math.isnan(boxes.signed_box_distance(UNIT, (math.nan, 0.0, 0.0, 4.0, 2.0)))


def test_distance_is_symmetric_and_agrees_with_overlap() -> None:
    overlapping = 0
    for pair in random_pairs(300):
        one, other = tuple(pair[:5].tolist()), tuple(pair[5:].tolist())
        there = boxes.signed_box_distance(one, other)
        back = boxes.signed_box_distance(other, one)
        assert there == pytest.approx(back, abs=1e-12)
        assert boxes.boxes_overlap(one, other) == (there <= 0.0)
        overlapping += there <= 0.0
    assert 30 < overlapping < 270


def test_distance_is_that_of_the_nearest_corner_to_the_other_box() -> None:
    apart = 0
    for pair in random_pairs(300):
        ways = [math.inf]
        for mine, other in ((pair[:5], pair[5:]), (pair[5:], pair[:5])):
            c, s = math.cos(mine[2]), math.sin(mine[2])
            for u, v in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                along, across = 0.5 * u * mine[3], 0.5 * v * mine[4]
                dx = mine[0] + c * along - s * across - other[0]
                dy = mine[1] + s * along + c * across - other[1]
                oc, os = math.cos(other[2]), math.sin(other[2])
                beyond = abs(dx * oc + dy * os) - 0.5 * other[3]
                aside = abs(dy * oc - dx * os) - 0.5 * other[4]
                ways.append(math.hypot(max(beyond, 0.0), max(aside, 0.0)))
        one, other_one = tuple(pair[:5].tolist()), tuple(pair[5:].tolist())
        found = boxes.box_distance(one, other_one)
        if found > 0.0:
            apart += 1
            assert found == pytest.approx(min(ways), abs=1e-9)
    assert apart > 30


@pytest.mark.slow
def test_sweep_finds_the_contact_of_a_step_and_its_share() -> None:
    thin, turned = (0.2, 0.2), math.pi / 2
    near, far = math.radians(179.0), math.radians(-179.0)
    scenes: dict[str, tuple[tuple[Any, ...], tuple[bool, Any]]] = {
        # 7.5 m between bumpers, 6 m closed in a step of 0.05 s and 12 m in one of 0.1 s.
        "head-on at 60 m/s each": (
            ((0, 0, 0), (6.0, 0, 0), (12.0, 0, math.pi), (6.0, 0, math.pi)),
            (True, pytest.approx(7.5 / 12.0, rel=1e-12)),
        ),
        # Neither pose of the step overlaps: the one passes through the other in between.
        "thin boxes that cross": (
            ((0.0, -1.5, turned), (0.0, 1.5, turned), (-3.0, 0.0, 0.0), (3.0, 0.0, 0.0), thin),
            (True, pytest.approx((3.0 - 0.2) / 6.0, rel=1e-9)),
        ),
        "passing beside each other": (
            ((0, 0, 0), (6, 0, 0), (12, 1.81, math.pi), (6, 1.81, math.pi)),
            (False, math.inf),
        ),
        "contact at the start": (((0, 0, 0), (3, 0, 0), (4, 0, 0), (9, 0, 0)), (True, 0.0)),
        "at rest apart": (((0, 0, 0), (0, 0, 0), (5, 0, 0), (5, 0, 0)), (False, math.inf)),
        # From 179 to -179 degrees: 2 degrees, not a full spin that would sweep the neighbour.
        "a turn over the seam": (
            ((0, 0, near), (0, 0, far), (0, 2.2, 0), (0, 2.2, 0)),
            (False, math.inf),
        ),
        "unknown place": (((0, 0, 0), (math.nan, 0, 0), (50, 0, 0), (50, 0, 0)), (True, 0.0)),
        "unknown heading": (((0, 0, math.nan), (0, 0, 0), (50, 0, 0), (50, 0, 0)), (True, 0.0)),
    }
    for why, (poses, expected) in scenes.items():
        assert sweep(*poses) == expected, why
    assert sweep((0, 0, 0), (6, 0, 0), (9, 1.8, math.pi), (0, 1.8, math.pi))[0]


def test_turning_box_hits_what_only_its_corner_sweeps() -> None:
    # A quarter turn; at both ends the neighbour is clear, in between the corner reaches it.
    end = (0.0, 0.0, math.pi / 2)
    corner = 0.5 * math.hypot(4.0, 4.0)
    square = (4.0, 4.0)
    place = (2.0 + corner - 0.1, 0.0, 0.0)
    assert not boxes.boxes_overlap((0.0, 0.0, 0.0, *square), (*place, *square))
    contact, share = sweep((0.0, 0.0, 0.0), end, place, place, size=square)
    assert contact
    assert 0.2 < share < 0.5
    beyond = (2.0 + corner + 2.0 * boxes.SWEEP_TOLERANCE, 0.0, 0.0)
    assert not sweep((0.0, 0.0, 0.0), end, beyond, beyond, size=square)[0]


def test_sweep_agrees_with_many_small_steps() -> None:
    draw = np.random.default_rng(11)
    found = 0
    for _ in range(60):
        a, b, c, d = (
            (float(x), float(y), float(h))
            for x, y, h in draw.uniform([-7.0, -7.0, -3.1], [7.0, 7.0, 3.1], (4, 3))
        )
        turn_1, turn_2 = boxes.wrap_to_pi(b[2] - a[2]), boxes.wrap_to_pi(d[2] - c[2])
        nearest, first = math.inf, math.inf
        for share in np.linspace(0.0, 1.0, 401):
            one = a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * turn_1
            other = (
                c[0] + share * (d[0] - c[0]), c[1] + share * (d[1] - c[1]), c[2] + share * turn_2
            )  # fmt: skip
            distance = boxes.signed_box_distance((*one, *CAR), (*other, *CAR))
            nearest = min(nearest, distance)
            if distance <= 0.0:
                first = min(first, float(share))
        contact, share = sweep(a, b, c, d)
        found += contact
        if nearest <= 0.0:
            assert contact
            assert first - 1.0 / 400.0 - 1e-3 <= share <= first
        elif nearest > 0.15:
            assert not contact
    assert 10 < found < 50
