"""Distance and gap to one object: at the rows that are asked for, with one unknown number."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from adeye.judge.series import TraceSeries


def test_distance_and_gap_to_an_object_ahead(hand_made: Any) -> None:
    series = TraceSeries(hand_made().trace())
    np.testing.assert_allclose(series.object_distance(0), 40.0)
    np.testing.assert_allclose(series.object_gap(0), 40.0)


def test_gap_behind_is_negative_and_a_touched_object_is_at_no_distance(hand_made: Any) -> None:
    made = hand_made().object("lead", s=-44.0 + 20.0 * np.arange(21) * 0.1)
    assert TraceSeries(made.trace()).object_gap(0)[0, 3] == pytest.approx(-40.0)
    touched = TraceSeries(hand_made().touch(7, "lead").trace())
    assert touched.object_distance(0)[0, 7] == 0.0


def test_unknown_number_makes_no_distance(hand_made: Any) -> None:
    made = hand_made()
    made.columns["objects"][0, 5, 0, 4] = np.nan
    series = TraceSeries(made.trace())
    for found in (series.object_distance(0)[0], series.object_gap(0)[0]):
        assert np.flatnonzero(np.isnan(found)).tolist() == [5]


def test_distance_at_a_row_is_that_of_the_series(hand_made: Any) -> None:
    series = TraceSeries(hand_made(runs=2).object("lead", run=1, speed=3.0).trace())
    row, chosen = np.array([4, 6]), np.array([True, True])
    found = series.object_distance_at(0, row, chosen)
    np.testing.assert_array_equal(found, series.object_distance(0)[np.arange(2), row])
