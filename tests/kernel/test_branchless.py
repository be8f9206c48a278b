"""Functions without a jump: the bits of those with jumps, over their whole range."""

import math

import numpy as np

from adeye.kernel import elementary
from adeye.kernel import elementary as branchless


def same(found: tuple[float, float], expected: tuple[float, float]) -> bool:
    return np.array(found).tobytes() == np.array(expected).tobytes()


def test_any_angle() -> None:
    draw = np.random.default_rng(1)
    edges = [0.0, -0.0, 5e-324, -1e-300, elementary.LARGEST_ANGLE, -elementary.LARGEST_ANGLE]
    quarters = [k * math.pi / 4.0 + off for k in range(-9, 10) for off in (-1e-15, 0.0, 1e-15)]
    for angle in (*edges, *quarters, *draw.uniform(-7.0, 7.0, 2000), *draw.uniform(-1e6, 1e6, 500)):
        assert same(branchless.sin_cos_of_any(angle), elementary.sin_cos(angle)), angle


def test_angle_that_is_unknown_or_too_large() -> None:
    for angle in (math.nan, math.inf, -math.inf, 1.7e6):
        assert all(math.isnan(part) for part in branchless.sin_cos_of_any(angle))


def test_turn() -> None:
    for angle in np.random.default_rng(2).uniform(0.0, 2.0 * math.pi, 2000):
        assert same(branchless.sin_cos_of_turn(angle), elementary.sin_cos(angle)), angle


def test_logarithm_of_a_fraction() -> None:
    draws = np.random.default_rng(3).uniform(0.0, 1.0, 2000)
    for x in (2.0**-53, 0.5, 1.0 - 2.0**-53, *draws, *draws * 1e-12):
        assert branchless.log_of_fraction(x) == elementary.log(x)
