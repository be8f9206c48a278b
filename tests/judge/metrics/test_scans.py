"""What the scans find, each against the plainest way to say it."""

from typing import Any

import numpy as np
import pytest

from adeye.judge.conflict import DRAC, GAP
from adeye.judge.metrics import scans
from adeye.judge.metrics.registry import CODES, INCOMPLETE
from adeye.judge.series import is_demand

VALUE, FREE, UNDEFINED, ERROR = scans.VALUE, scans.NO_CONFLICT, scans.UNDEFINED, scans.ERROR
NOBODY = np.full((1, 4), -1, np.int16)


def rows(*numbers: float) -> Any:
    return np.array([numbers])


def test_codes_are_different() -> None:
    codes = {VALUE, FREE, UNDEFINED, ERROR, scans.NOT_APPLICABLE, CODES[INCOMPLETE]}
    assert len(codes) == 6


def test_first_contact_is_found_within_the_run() -> None:
    contact = np.array([[-1, -1, 0, 1], [-1, -1, -1, 0]], np.int16)
    assert scans.first_contacts(np.array([4, 3]), contact).tolist() == [2, -1]


def test_worst_conflict_is_the_earliest_least() -> None:
    for values, expected in (
        (rows(3.0, 1.0, 1.0, 0.0), (1, VALUE)),
        (rows(np.inf, 2.0, 5.0, 0.0), (1, VALUE)),
        (rows(np.inf, np.inf, np.inf, 0.0), (0, FREE)),
        (rows(1.0, np.nan, np.inf, 0.0), (0, ERROR)),
    ):
        found, codes = scans.worst_conflicts(np.array([3]), values, NOBODY, NOBODY, is_demand(GAP))
        assert (found[0], codes[0]) == expected, values


def test_worst_demand_is_the_largest_of_an_object() -> None:
    actors = np.array([[-1, 0, 0, 0]], np.int16)
    found, codes = scans.worst_conflicts(
        np.array([4]), rows(0.0, 2.0, 3.0, 3.0), actors, NOBODY, is_demand(DRAC)
    )
    assert (found[0], codes[0]) == (2, VALUE)
    _, codes = scans.worst_conflicts(np.array([1]), rows(0.0, 1.0), actors, NOBODY, is_demand(DRAC))
    assert codes[0] == FREE


def test_violations_are_counted_and_the_earliest_worst_is_found() -> None:
    margins = rows(np.inf, -1.0, -2.0, -2.0)
    found = scans.worst_violations(np.array([4]), margins)
    assert [part[0] for part in found] == [2, 3, False]
    assert scans.worst_violations(np.array([2]), rows(np.nan, -1.0))[2][0]


def test_gap_counts_only_while_the_ego_stands() -> None:
    gaps = rows(1.0, 5.0, 4.0, 9.0)
    found, codes = scans.worst_at_standstill(np.array([4]), gaps, rows(9.0, 0.0, 0.01, 0.0), 0.05)
    assert (found[0], codes[0]) == (2, VALUE)
    _, codes = scans.worst_at_standstill(np.array([4]), gaps, rows(9.0, 1.0, 1.0, 1.0), 0.05)
    assert codes[0] == scans.NOT_APPLICABLE
    _, codes = scans.worst_at_standstill(np.array([4]), gaps, rows(9.0, np.nan, 0.0, 1.0), 0.05)
    assert codes[0] == ERROR


@pytest.mark.parametrize(
    ("what", "expected"),
    [(scans.CHANGE, (2, 3.0)), (scans.DECELERATION, (2, 3.0)), (scans.SIZE, (2, 3.0))],
)
def test_worst_motion(what: int, expected: tuple[int, float]) -> None:
    found, value, codes = scans.worst_motion(np.array([4]), rows(0.5, 1.0, -3.0, -1.0), what)
    assert (found[0], value[0], codes[0]) == (*expected, VALUE)
    assert scans.worst_motion(np.array([2]), rows(np.nan, 1.0), what)[2][0] == ERROR


def test_fault_counts_from_the_first_row_that_is_decided() -> None:
    active = np.array([[[False], [True], [True]], [[False], [False], [True]]])
    assert scans.first_faults(np.array([3, 3]), active).tolist() == [1, -1]


def test_safe_state_lasts_to_the_end() -> None:
    # As columns of a trace, for which the kernel is compiled.
    columns = np.stack([rows(0.0, 3.0, 0.0, 0.0), rows(1.0, 1.0, 1.0, 1.0)], axis=-1)
    speeds, d = columns[..., 0], columns[..., 1]
    on, off = rows(1.0, 1.0, 1.0, 1.0) > 0.0, rows(0.0, 0.0, 0.0, 0.0) > 0.0
    safe = scans.safe_from(np.array([4]), speeds, d, NOBODY, on, 0.05)
    assert safe.tolist() == [2]
    assert scans.safe_from(np.array([2]), speeds, d, NOBODY, on, 0.05).tolist() == [2]
    assert scans.safe_from(np.array([4]), speeds, d, NOBODY, off, 0.05).tolist() == [4]
    assert scans.safe_from(
        np.array([4]), (columns * np.nan)[..., 0], d, NOBODY, on, 0.05
    ).tolist() == [-1]


def test_takeover_is_by_another_channel_than_before_the_fault() -> None:
    authority = np.array([[0, 0, 1, 0]], np.int8)
    for onset, default, expected in ((1, 0, 2), (3, 0, -1), (0, 1, 0), (-1, 0, -1)):
        found = scans.first_takeovers(np.array([4]), np.array([onset]), authority, default)
        assert found.tolist() == [expected]


def test_channel_that_gets_authority_back_has_taken_nothing_over() -> None:
    # Another one acts before the fault; the default gets it back, perhaps with the fault in it.
    for authority, expected in (
        ([1, 1, 0, 0, 0, 0], -1),
        ([1, 1, 0, 0, 1, 1], 4),
        ([1, 1, -1, 0, -1, 2], -1),  # nothing is decided at the last row
        ([1, 2, 1, 0, -1, 2, 2], 5),
    ):
        length = np.array([len(authority)])
        codes = np.array([authority], np.int8)
        assert scans.first_takeovers(length, np.array([1]), codes, 0).tolist() == [expected]
