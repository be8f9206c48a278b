"""Bounds that leave out objects: never one that would have been the worst case."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np
import pytest

from adeye.judge.conflict import (
    ALONG,
    HALF_WIDTH,
    distance_below,
    is_far_beside,
    is_in_path,
    lateral_reach,
    least_so_far,
    on_road,
)
from adeye.judge.series import RssParameters
from adeye.kernel.boxes import box_distance
from adeye.kernel.criticality import rss_lateral_distance

RSS = np.array(astuple(RssParameters()))
BRAKING = 0.5 / RSS[7]


def scene(seed: int, rows: int = 30, objects: int = 3) -> tuple[np.ndarray, ...]:
    bits = np.random.default_rng(seed)
    ego, others = np.zeros((1, rows, 7)), np.zeros((1, rows, objects, 5))
    ego[..., :3], others[..., :3] = (bits.uniform(-9.0, 9.0, (*part.shape[:-1], 3)) for part in
                                     (ego, others))  # fmt: skip
    return ego, np.array([[4.0, 2.0, 1.5]]), others, bits.uniform(0.5, 6.0, (1, objects, 3))


def distances(
    ego: np.ndarray, size: np.ndarray, others: np.ndarray, sizes: np.ndarray
) -> np.ndarray:
    return np.array(
        [
            [
                box_distance(
                    *ego[0, row, :3], *size[0, :2], *others[0, row, at, :3], *sizes[0, at, :2]
                )
                for at in range(others.shape[2])
            ]
            for row in range(ego.shape[1])
        ]
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_least_so_far_is_the_distance_of_some_row(seed: int) -> None:
    ego, size, others, sizes = scene(seed)
    others[..., :2] += 40.0
    found = least_so_far(0, 20, ego, size, others, sizes)
    every = distances(ego, size, others, sizes)[:20]
    assert found in every
    assert found >= every.min() > 0.0


@pytest.mark.slow
def test_without_a_number_or_an_object_nothing_is_left_out() -> None:
    ego, size, others, sizes = scene(0)
    assert least_so_far(0, 20, ego, size, others[:, :, :0], sizes) == np.inf
    assert least_so_far(0, 20, ego, size, others * np.nan, sizes) == np.inf


@pytest.mark.parametrize("seed", range(5))
def test_distance_is_exact_up_to_what_is_enough(seed: int) -> None:
    ego, size, others, sizes = scene(seed)
    every = distances(ego, size, others, sizes)
    turns = np.full((others.shape[2] + 1, 3), np.nan)
    bounds = 0
    for row in range(ego.shape[1]):
        x, y, heading = ego[0, row, :3]
        for at in range(others.shape[2]):
            ox, oy, o_heading = others[0, row, at, :3]
            o_length, o_width = sizes[0, at, :2]
            found = distance_below(
                ox - x, oy - y, heading, 4.0, 2.0, o_heading, o_length, o_width, turns, at, 3.0
            )
            bounds += found != every[row, at]
            assert found == every[row, at] or 3.0 < found <= every[row, at] + 1e-9
    assert bounds > 0


@pytest.mark.slow
def test_far_beside_is_neither_in_the_path_nor_laterally_unsafe() -> None:
    bits = np.random.default_rng(1)
    culled = 0
    for _ in range(3000):
        beside, across = bits.uniform(-8.0, 8.0), bits.uniform(-2.0, 2.0)
        speed, angle = bits.uniform(-20.0, 20.0), bits.uniform(-0.7, 0.7)
        length, width = bits.uniform(0.3, 12.0), bits.uniform(0.3, 3.0)
        reach = lateral_reach(abs(across), RSS[0], RSS[6], BRAKING) + RSS[8]
        if not is_far_beside(beside, 1.0, reach, speed, angle, length, width, RSS, BRAKING):
            continue
        culled += 1
        own = (0.0, 0.0, 20.0, across, 2.0, 1.0)
        other = on_road(30.0, beside, speed, length, width, np.sin(angle), np.cos(angle))
        assert own[ALONG] == 20.0
        assert not is_in_path(own, 1.0, other, 20.0)
        side = np.copysign(1.0, beside)
        lateral = rss_lateral_distance(side * across, side * other[3], *RSS[[0, 1, 6, 7, 8]])
        assert abs(beside) - 1.0 - other[HALF_WIDTH] >= lateral
    assert 100 < culled < 2900
