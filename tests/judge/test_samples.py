"""Samples of conflicts and signals: what a value stands for."""

from __future__ import annotations

import numpy as np
import pytest

from adeye.judge.conflict import DRAC, GAP, REQUIRED, TTC
from adeye.judge.series import fill_statuses, is_demand, mark_errors, mark_undecided, status_of
from adeye.judge.stl.series import SampleStatus

VALUE, FREE, NOT_APPLICABLE, ERROR = SampleStatus


def test_decelerations_are_demands() -> None:
    assert [is_demand(column) for column in (GAP, TTC, DRAC, REQUIRED)] == [
        False,
        False,
        True,
        True,
    ]


@pytest.mark.parametrize(
    ("value", "actor", "touched", "column", "expected"),
    [
        (1.0, 0, -1, GAP, VALUE),
        (1.0, -1, -1, GAP, VALUE),
        (np.inf, -1, -1, TTC, FREE),
        (-np.inf, 0, -1, TTC, ERROR),
        (np.nan, 0, -1, TTC, ERROR),
        (0.0, 0, -1, DRAC, VALUE),
        (0.0, -1, -1, DRAC, FREE),
        (np.inf, 0, 0, REQUIRED, NOT_APPLICABLE),
        (np.inf, 0, -1, REQUIRED, ERROR),
        (np.nan, 0, 0, REQUIRED, ERROR),
    ],
)
def test_value_stands_for(
    value: float, actor: int, touched: int, column: int, expected: SampleStatus
) -> None:
    demands = is_demand(column)
    assert status_of(value, actor, touched, demands) == expected
    status = np.full((1, 2), -1, dtype=np.int8)
    actors, contact = np.full((1, 2), actor, np.int16), np.full((1, 2), touched, np.int16)
    fill_statuses(np.array([1]), np.full((1, 2), value), actors, contact, demands, status)
    # Beyond the run there is nothing.
    assert status.tolist() == [[expected, FREE if demands else VALUE]]


def test_what_is_not_finite_is_an_error() -> None:
    status = np.zeros((2, 3), dtype=np.int8)
    mark_errors(np.array([[0.0, np.nan, 1.0], [np.inf, 0.0, -np.inf]]), status)
    assert status.tolist() == [[0, ERROR, 0], [ERROR, 0, ERROR]]


def test_nothing_is_decided_from_the_last_row_on() -> None:
    status = np.zeros((2, 3), dtype=np.int8)
    mark_undecided(np.array([3, 2]), status)
    assert status.tolist() == [[0, 0, NOT_APPLICABLE], [0, NOT_APPLICABLE, NOT_APPLICABLE]]
