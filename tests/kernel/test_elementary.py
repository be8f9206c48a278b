"""Elementary functions: within an ulp of the mathematical library, exact where they must be."""

import math
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from adeye.kernel import elementary as own

UNIT = 2.0**-52


def samples(low: float, high: float, count: int = 2001) -> list[float]:
    """Even and clustered arguments, so that every branch near zero is met."""
    even = np.linspace(low, high, count)
    near_zero = np.sign(even) * np.abs(even / max(abs(low), abs(high))) ** 7
    return [float(x) for x in np.concatenate([even, near_zero]) if low <= x <= high]


def ulps(value: float, exact: float) -> float:
    return abs(value - exact) / math.ulp(exact) if value != exact else 0.0


AGREE: list[tuple[Any, Any, float, float, float]] = [
    (own.sin, math.sin, -40.0, 40.0, 1.0),
    (own.cos, math.cos, -40.0, 40.0, 1.0),
    (own.sin, math.sin, -1.5e6, 1.5e6, 1.0),
    (own.tan, math.tan, -1.5, 1.5, 2.5),
    (own.atan, math.atan, -50.0, 50.0, 1.0),
    (own.asin, math.asin, -1.0, 1.0, 3.0),
    (own.asin, math.asin, -0.5, 0.5, 1.0),
    (own.asin, math.asin, -0.07, 0.07, 1.0),
    (own.exp, math.exp, -700.0, 700.0, 1.5),
    (own.exp, math.exp, -2.0, 2.0, 1.5),
    (own.log, math.log, 1e-9, 3.0, 1.0),
    (own.log, math.log, 1e-9, 1e12, 1.0),
]
"""Ours and the library's, between which arguments they agree to so many ulps."""


def test_agrees_with_the_mathematical_library() -> None:
    for function, oracle, low, high, bound in AGREE:
        worst = max(ulps(function(x), oracle(x)) for x in samples(low, high))
        assert worst <= bound, (function, low)


def test_inlined_sine_and_cosine_have_the_same_bits() -> None:
    for x in [*samples(-4.0, 4.0), 0.785, -0.785, 0.0, -0.0]:
        found, expected = own.sin_cos_of_small(x), own.sin_cos(x)
        assert [math.copysign(1.0, part) for part in found] == [
            math.copysign(1.0, part) for part in expected
        ]
        assert found == expected
    assert all(math.isnan(part) for part in own.sin_cos_of_small(math.nan))


def test_direction_agrees_in_every_quadrant() -> None:
    for turn in samples(-math.pi, math.pi, 401):
        y, x = 3.0 * math.sin(turn), 3.0 * math.cos(turn)
        assert ulps(own.atan2(y, x), math.atan2(y, x)) <= 2.0


def test_direction_of_axes_is_exact() -> None:
    quarter = math.pi / 2
    axes = {(0.0, 0.0): 0.0, (0.0, 2.0): 0.0, (2.0, 0.0): quarter, (-2.0, 0.0): -quarter}
    assert [own.atan2(*axis) for axis in axes] == list(axes.values())
    assert own.atan2(0.0, -2.0) == own.atan2(-0.0, -2.0) == math.pi
    assert all(math.isnan(own.atan2(*pair)) for pair in ((math.nan, 0.0), (1.0, math.nan)))


def test_zero_and_the_ends_are_exact() -> None:
    assert own.sin_cos(0.0) == (0.0, 1.0)
    assert (own.exp(0.0), own.exp(710.0), own.exp(-750.0)) == (1.0, math.inf, 0.0)
    assert (own.log(1.0), own.log(0.0), own.log(math.inf)) == (0.0, -math.inf, math.inf)


def test_odd_functions_are_odd_to_the_bit() -> None:
    for x in samples(0.0, 30.0, 301):
        assert own.sin(-x) == -own.sin(x)
        assert own.cos(-x) == own.cos(x)
        assert own.atan(-x) == -own.atan(x)


def test_logarithm_inverts_exponential() -> None:
    for x in samples(-20.0, 20.0, 301):
        assert own.log(own.exp(x)) == pytest.approx(x, rel=1e-15, abs=4 * UNIT)


def test_powers_are_products_and_those_of_the_library() -> None:
    whole = dict.fromkeys((-3.0, 0.0, 1.0, 4.0, 16.0), 16 * UNIT)
    broken = dict.fromkeys((0.5, 3.7, 4.3, -1.25), 1e-14)
    for exponent, bound in (whole | broken).items():
        for base in samples(0.01, 5.0, 51):
            assert own.power(base, exponent) == pytest.approx(base**exponent, rel=bound)


def test_powers_of_zero() -> None:
    powers = {4.0: 0.0, 4.2: 0.0, 0.0: 1.0, -1.0: math.inf, -1.5: math.inf}
    assert [own.power(0.0, exponent) for exponent in powers] == list(powers.values())
    assert math.isnan(own.power(-1.0, 0.5))


def test_outside_the_domain_is_never_a_number() -> None:
    beyond = 2.0 * own.LARGEST_ANGLE
    assert all(math.isnan(f(beyond)) for f in (own.sin, own.cos, own.tan))
    assert all(math.isnan(f(math.inf)) for f in (own.sin, own.cos, own.tan))
    assert all(math.isnan(f(math.nan)) for f in (own.sin, own.atan, own.asin, own.exp, own.log))
    assert math.isnan(own.asin(1.0 + 1e-9))
    assert math.isnan(own.log(-1.0))


@pytest.mark.slow
def test_machine_code_and_plain_python_give_the_same_bits() -> None:
    program = (
        "from adeye.kernel import elementary as e\n"
        "xs = [0.001 * k * k - 7.0 for k in range(200)]\n"
        "for x in xs:\n"
        "    row = (e.sin(x), e.cos(x), e.atan(x), e.atan2(x, 1.3 - x), e.exp(x),\n"
        "           e.log(abs(x) + 0.1), e.power(abs(x), 3.3))\n"
        "    print(*(float(value).hex() for value in row))\n"
    )
    outputs = [
        subprocess.run(
            [sys.executable, "-c", program],
            env={"NUMBA_DISABLE_JIT": flag, "PYTHONPATH": ":".join(sys.path)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for flag in ("0", "1")
    ]
    assert outputs[0].count("\n") == 200
    assert outputs[0] == outputs[1]


# --- Functions without a jump: the bits of those with jumps, over their whole range ---------------


def same(found: tuple[float, float], expected: tuple[float, float]) -> bool:
    return np.array(found).tobytes() == np.array(expected).tobytes()


def test_any_angle() -> None:
    draw = np.random.default_rng(1)
    edges = [0.0, -0.0, 5e-324, -1e-300, own.LARGEST_ANGLE, -own.LARGEST_ANGLE]
    quarters = [k * math.pi / 4.0 + off for k in range(-9, 10) for off in (-1e-15, 0.0, 1e-15)]
    for angle in (*edges, *quarters, *draw.uniform(-7.0, 7.0, 2000), *draw.uniform(-1e6, 1e6, 500)):
        assert same(own.sin_cos_of_any(angle), own.sin_cos(angle)), angle


def test_angle_that_is_unknown_or_too_large() -> None:
    for angle in (math.nan, math.inf, -math.inf, 1.7e6):
        assert all(math.isnan(part) for part in own.sin_cos_of_any(angle))


def test_turn() -> None:
    for angle in np.random.default_rng(2).uniform(0.0, 2.0 * math.pi, 2000):
        assert same(own.sin_cos_of_turn(angle), own.sin_cos(angle)), angle


def test_logarithm_of_a_fraction() -> None:
    draws = np.random.default_rng(3).uniform(0.0, 1.0, 2000)
    for x in (2.0**-53, 0.5, 1.0 - 2.0**-53, *draws, *draws * 1e-12):
        assert own.log_of_fraction(x) == own.log(x)
