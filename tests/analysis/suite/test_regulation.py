"""The table of UN R157 and its interpolation."""

import pytest

from adeye.analysis.suite.speeds import TABLE, least_forward_range, speed_by_range
from adeye.kernel.criticality import stopping_distance

GIVEN = {60: 46, 70: 50, 80: 60, 90: 75, 100: 90, 110: 110, 120: 130, 130: 150}


def test_table_is_that_of_the_regulation() -> None:
    assert {round(speed * 3.6): distance for speed, distance in TABLE} == GIVEN


@pytest.mark.parametrize("speed", GIVEN)
def test_range_and_speed_are_inverse_in_the_table(speed: int) -> None:
    found = least_forward_range(speed / 3.6)
    assert found == pytest.approx(GIVEN[speed])
    assert speed_by_range(GIVEN[speed]) == pytest.approx(speed / 3.6)


@pytest.mark.parametrize("speed", [90, 100, 110, 120, 130])
def test_table_is_about_half_a_second_and_five_metres_per_second_squared(speed: int) -> None:
    assert stopping_distance(speed / 3.6, 0.5, 5.0) == pytest.approx(GIVEN[speed], abs=2.5)


def test_between_two_rows_is_interpolated() -> None:
    assert least_forward_range(125.0 / 3.6) == pytest.approx(140.0)
    assert speed_by_range(140.0) == pytest.approx(125.0 / 3.6)


def test_below_the_table_its_least_range_holds_and_above_there_is_none() -> None:
    assert least_forward_range(5.0) == 46.0
    assert least_forward_range(131.0 / 3.6) is None
    assert speed_by_range(45.9) is None
    assert speed_by_range(1000.0) == pytest.approx(130.0 / 3.6)
