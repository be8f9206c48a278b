"""The cut-in rule as a driver: when it brakes, by the text and by published code."""

import math

import numpy as np
import pytest

from adeye.kernel.reference_drivers import parameters as columns
from adeye.kernel.reference_drivers.drivers import reg157_limit
from adeye.kernel.reference_drivers.parameters import parameters_of, vector

STEP = 0.01
THRESHOLD = 10.0 / 12.0 + 0.35


def view(**seen: float) -> np.ndarray:
    """Return what is seen behind a vehicle that is 10 m/s slower, with changes."""
    row = np.zeros(columns.VIEW_SIZE)
    known = {
        "EGO_SPEED": 20.0, "OTHER_SPEED": 10.0, "GAP": 50.0, "LENGTHS": 8.6,
        "LATERAL_GAP": -1.0, "INTRUSION": 1.5, "OVERLAP": 0.5,
    }  # fmt: skip
    for name, value in (known | seen).items():
        row[getattr(columns, name)] = value
    return row


def limits(rows: list[np.ndarray], *variant: str, edition: str = "r157-01") -> list[float]:
    numbers = vector(parameters_of("reg157", edition, variant))
    memory = np.zeros(columns.STATE_SIZE)
    return [reg157_limit(row, numbers, memory, STEP) for row in rows]


def is_answered(gap: float, *variant: str, edition: str = "r157-01") -> bool:
    return limits([view(GAP=gap)], *variant, edition=edition) != [math.inf]


@pytest.mark.parametrize(
    ("edition", "threshold"),
    [
        ("r157", THRESHOLD),
        ("eu-2022-1426", THRESHOLD - 0.1),
        ("eu-2022-1426-standing", 10 / 4.8 + 0.16),
    ],
)
def test_edition_is_braked_in_the_last_tick_above_its_threshold(
    edition: str, threshold: float
) -> None:
    assert is_answered(10.0 * (threshold + 0.0099), edition=edition)
    assert not is_answered(10.0 * (threshold + 0.0101), edition=edition)


def test_guard_is_a_tenth_of_a_second_above_the_threshold() -> None:
    assert is_answered(10.0 * (THRESHOLD + 0.0999), "jrc-guard")
    assert not is_answered(10.0 * (THRESHOLD + 0.1001), "jrc-guard")


def test_text_brakes_on_and_published_code_releases_above_the_threshold() -> None:
    rows = [view(GAP=10.0)] * 40 + [view(GAP=50.0)] * 2
    assert limits(rows)[-3:] == [-6.0] * 3
    assert limits(rows, "jrc-release")[-3:] == [-6.0, math.inf, math.inf]


def test_published_code_of_esmini_has_no_delay_and_the_same_threshold() -> None:
    near = [view(GAP=10.0)] * 36
    assert limits(near) == [0.0] * 35 + [-6.0]
    assert limits(near, "esmini-reaction") == [-6.0] * 36
    for gap in (10.0 * (THRESHOLD + 0.0099), 10.0 * (THRESHOLD + 0.0101)):
        assert is_answered(gap) == is_answered(gap, "esmini-reaction")


def test_published_code_stops_for_any_lead_that_closes_in_and_for_no_cut_in() -> None:
    assert not is_answered(50.0)
    assert is_answered(50.0, "jrc-lead")
    from_the_side = [view(LATERAL_GAP=0.6, INTRUSION=0.1), view()]
    assert limits(from_the_side, "jrc-lead") == [math.inf, math.inf]


def test_lead_that_brakes_on_is_answered_before_its_braking_is_too_hard() -> None:
    lead = {"OTHER_SPEED": 20.0, "GAP": 40.0}
    assert limits([view(OTHER_ACCELERATION=-2.0, **lead)]) == [math.inf]
    assert limits([view(OTHER_ACCELERATION=-5.0, **lead)]) == [0.0]
    assert limits([view(OTHER_ACCELERATION=-4.0, OTHER_SPEED=20.0, GAP=8.0)]) == [math.inf]
    assert limits([view(OTHER_ACCELERATION=-4.0, OTHER_SPEED=12.0, GAP=14.0)]) == [0.0]


@pytest.mark.slow
def test_what_is_unknown_asks_for_no_number() -> None:
    assert all(math.isnan(value) for value in limits([view(GAP=math.nan)]))
