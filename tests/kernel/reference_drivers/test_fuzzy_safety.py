"""Fuzzy safety metrics: golden values of the regulation's numbers and laws."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from adeye.kernel.reference_drivers.reactions import critical_fuzzy_safety, proactive_fuzzy_safety

SPEED = st.floats(0.0, 60.0)
GAP = st.floats(0.0, 300.0)


def pfs(gap: float, rear: float, front: float) -> float:
    return proactive_fuzzy_safety(gap, rear, front, 0.75, 4.0, 6.0, 7.0, 2.0)


def cfs(gap: float, rear: float, front: float, acceleration: float, *, raw: bool = False) -> float:
    return critical_fuzzy_safety(gap, rear, front, acceleration, 0.75, 4.0, 6.0, raw)


def test_golden_values() -> None:
    assert pfs(60.0, 25.0, 20.0) == pytest.approx(0.4388, abs=5e-5)
    assert pfs(20.0, 25.0, 20.0) == 1.0
    assert cfs(6.0, 25.0, 20.0, 0.0) == pytest.approx(0.84, rel=1e-9)
    assert cfs(8.0, 25.0, 20.0, 0.0) == 0.0


@given(GAP, SPEED, SPEED, st.floats(-10.0, 3.0))
def test_both_are_between_0_and_1(gap: float, rear: float, front: float, a: float) -> None:
    assert 0.0 <= pfs(gap, rear, front) <= 1.0
    assert 0.0 <= cfs(gap, rear, front, a) <= 1.0


@given(GAP, st.floats(0.0, 50.0), SPEED, SPEED, st.floats(-10.0, 3.0))
def test_more_gap_is_never_less_safe(
    gap: float, more: float, rear: float, front: float, a: float
) -> None:
    assert pfs(gap + more, rear, front) <= pfs(gap, rear, front)
    assert cfs(gap + more, rear, front, a) <= cfs(gap, rear, front, a)


@given(GAP, SPEED, SPEED)
def test_faster_rear_vehicle_is_never_safer(gap: float, rear: float, front: float) -> None:
    assert pfs(gap, rear + 1.0, front) >= pfs(gap, rear, front)
    assert cfs(gap, rear + 1.0, front, 0.0) >= cfs(gap, rear, front, 0.0) - 1e-12


def test_opening_gap_is_not_critical() -> None:
    assert cfs(0.1, 20.0, 20.0, 0.0) == 0.0


def test_raw_acceleration_shortens_the_distance_of_a_hard_braking_ego() -> None:
    # Slow enough after the delay: 3^2 / (2 4) = 1.125 m by the text, 3^2 / (2 8) by the code.
    assert cfs(1.0, 10.0, 7.0, -8.0) == 1.0
    assert cfs(1.0, 10.0, 7.0, -8.0, raw=True) == 0.0


def test_unknown_is_no_number() -> None:
    assert math.isnan(pfs(math.nan, 1.0, 1.0))
    assert math.isnan(cfs(1.0, 1.0, math.nan, 0.0))
